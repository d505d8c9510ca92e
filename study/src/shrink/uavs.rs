//! Scenarios with one UAV less, and with names in place of drawn UAVs.
//!
//! Never changes what a fault does: it changes only the UAVs that the fault acts on.

use ringwing_flight::Part;
use ringwing_scenario::{
    Action, Fault, Scenario,
    fault::{Links, Receiver, Sender, Targets},
};
use std::collections::BTreeSet;

/// `scenario` without UAV `uav`; the UAVs after it move up by one number, also in the faults. `None` if a fault is for
/// that UAV alone.
pub(super) fn without_uav(scenario: &Scenario, uav: u32) -> Option<Scenario> {
    let mut smaller = scenario.clone();
    smaller.formation.uavs = scenario.formation.uavs.checked_sub(1)?;
    // A start or an offset that is listed goes with its UAV, or validation refuses the scenario.
    let place = uav as usize - 1;
    if place < smaller.start.uavs.len() {
        smaller.start.uavs.remove(place);
    }
    if place < smaller.formation.offsets.len() {
        smaller.formation.offsets.remove(place);
    }
    for fault in &mut smaller.faults {
        fault.action = moved_up(&fault.action, uav)?;
    }
    Some(smaller)
}

fn moved_up(action: &Action, gone: u32) -> Option<Action> {
    Some(match action {
        Action::Process { fault, targets: Targets::Uavs(uavs) } => {
            Action::Process { fault: *fault, targets: Targets::Uavs(others(uavs, gone)?) }
        }
        Action::Process { .. } => action.clone(),
        Action::Link { links, impairment, for_s } => {
            Action::Link { links: moved_links(links, gone)?, impairment: impairment.clone(), for_s: *for_s }
        }
        Action::Heal(links) => Action::Heal(moved_links(links, gone)?),
    })
}

fn moved_links(links: &Links, gone: u32) -> Option<Links> {
    Some(match links {
        Links::From(sender, receiver) => {
            let sender = match sender {
                Sender::Uav(uav) => Sender::Uav(moved(*uav, gone)?),
                other => *other,
            };
            let receiver = match receiver {
                Receiver::Uav(uav) => Receiver::Uav(moved(*uav, gone)?),
                Receiver::All => Receiver::All,
            };
            Links::From(sender, receiver)
        }
        Links::Between(one, other) => Links::Between(moved(*one, gone)?, moved(*other, gone)?),
        Links::All => Links::All,
        Links::Partition(groups) => {
            Links::Partition(groups.iter().map(|group| others(group, gone)).collect::<Option<_>>()?)
        }
        Links::Isolate(uav) => Links::Isolate(moved(*uav, gone)?),
    })
}

/// The new number of `uav`; `None` if it is the one that is gone.
fn moved(uav: u32, gone: u32) -> Option<u32> {
    (uav != gone).then(|| if uav > gone { uav - 1 } else { uav })
}

/// The new numbers of those of `uavs` that are left; `None` if nobody is left.
fn others(uavs: &[u32], gone: u32) -> Option<Vec<u32>> {
    let left: Vec<_> = uavs.iter().filter_map(|uav| moved(*uav, gone)).collect();
    (!left.is_empty()).then_some(left)
}

/// `scenario` with the UAVs that its faults draw by name; `None` if they draw none.
///
/// A draw depends on its time and on the number of UAVs, so without names a smaller scenario would be about other UAVs.
pub(super) fn with_names(scenario: &Scenario) -> Option<Scenario> {
    let schedule = scenario.schedule();
    // Sets, because a flap acts on its UAVs again and again, and each must be named once.
    let mut drawn: Vec<BTreeSet<u32>> = vec![BTreeSet::new(); scenario.faults.len()];
    // A slow answer is no scheduled action, so its draws come from a list of their own.
    let actions = schedule.scheduled_actions().into_iter().map(|action| (action.number, action.part));
    let slow = schedule.slow_answers().into_iter().map(|slow| (slow.number, slow.part));
    for (number, part) in actions.chain(slow) {
        if let Part::Agent(uav) = part {
            drawn[number as usize - 1].insert(uav.0);
        }
    }
    let mut named = scenario.clone();
    let mut is_new = false;
    for (fault, drawn) in named.faults.iter_mut().zip(drawn) {
        if let Fault { action: Action::Process { targets: targets @ Targets::Random(_), .. }, .. } = fault {
            *targets = Targets::Uavs(drawn.into_iter().collect());
            is_new = true;
        }
    }
    is_new.then_some(named)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flight::fly;
    use ringwing_scenario::Source;

    fn with(faults: &[&str]) -> Scenario {
        let faults = faults.iter().map(|text| text.parse().unwrap()).collect();
        Scenario { faults, ..Scenario::default() }
    }

    fn sentences(scenario: &Scenario) -> Vec<String> {
        scenario.faults.iter().map(|fault| fault.action.to_string()).collect()
    }

    #[test]
    fn the_uavs_after_the_one_that_is_gone_move_up_in_every_fault() {
        let scenario = with(&[
            "at 1 s kill uav 1,3,6",
            "at 1 s link 2->4 blackout",
            "at 1 s link 2<->6 loss 1 %",
            "at 1 s link leader->5 blackout",
            "at 1 s partition {1,2,3}|{4,5,6}",
            "at 1 s freeze random 2 uavs",
            "at 2 s heal all",
            "at 2 s heal isolate 5",
        ]);
        let expected = [
            "kill uav 1,5",
            "link 2->3 blackout",
            "link 2<->5 loss 1 %",
            "link leader->4 blackout",
            "partition {1,2}|{3,4,5}",
            "freeze random 2 uavs",
            "heal all",
            "heal isolate 4",
        ];
        let smaller = without_uav(&scenario, 3).unwrap();
        assert_eq!((smaller.formation.uavs, sentences(&smaller)), (5, expected.map(String::from).to_vec()));
    }

    #[test]
    fn a_uav_that_a_fault_is_for_stays_and_each_other_keeps_its_start() {
        for fault in
            ["at 1 s kill uav 3", "at 1 s link 3->4 hold", "at 1 s isolate 3", "at 1 s partition {3}|{4}"]
        {
            assert!(without_uav(&with(&[fault]), 3).is_none(), "{fault}");
        }
        let scenario = Scenario::read(&Source::find("dropout").unwrap(), &[]).unwrap();
        let smaller = without_uav(&scenario, 2).unwrap();
        assert_eq!(
            (&smaller.start.uavs[0], &smaller.start.uavs[1..]),
            (&scenario.start.uavs[0], &scenario.start.uavs[2..])
        );
    }

    #[test]
    fn names_in_place_of_draws_fly_the_same_flight() {
        let mut storm = Scenario::read(&Source::find("storm").unwrap(), &[]).unwrap();
        storm.time.duration_s = 56.0;
        let named = with_names(&storm).unwrap();
        assert!(sentences(&named).iter().all(|text| !text.contains("random")), "{:?}", sentences(&named));
        let hash = |scenario: &Scenario| fly(scenario).unwrap().payload_hash().unwrap().to_owned();
        assert_eq!(hash(&named), hash(&storm));
        assert!(with_names(&named).is_none());
    }
}
