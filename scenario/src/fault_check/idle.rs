//! Which faults can have no effect, and why, as far as the scenario alone decides it.
//!
//! Never claims what depends on how a flight goes: a fault that may have an effect is not mentioned here, and the
//! recorder measures whether it had one.

use crate::{
    Action, Fault, Scenario,
    fault::{
        Links, Receiver, Sender, SensorDrift, idle_reason, rounded_delay,
        schedule::{AirframeFailure, LinkFault, SlowAnswers},
    },
};
use ringwing_flight::{Part, ProcessAction, ProcessState, Tick, UavId};
use std::collections::BTreeMap;

/// What is noteworthy about the faults of `scenario`: the number of a fault, counted from 1, and a sentence about it.
pub(crate) fn warnings(scenario: &Scenario) -> Vec<(u32, String)> {
    let idle = IdleFaults::of(scenario);
    let rate_hz = scenario.time.rate_hz;
    let mut all: Vec<(u32, String)> = Vec::new();
    for (number, fault) in (1..).zip(&scenario.faults) {
        let rounding = match &fault.action {
            Action::Link { impairment, .. } => rounded_delay(impairment, rate_hz),
            _ => None,
        };
        match idle.reasons.get(&number) {
            Some(reason) => all.push((number, format!("the fault will have no effect: {reason}"))),
            None => all.extend(rounding.map(|sentence| (number, sentence))),
        }
    }
    all
}

impl Scenario {
    /// What is noteworthy about `added`, a fault that is to be added: that it will have no effect, or that rounding changes
    /// its delay. Faults of processes are left out: only the launcher knows which processes run.
    pub fn warning_about(&self, added: &Fault) -> Option<String> {
        let is_known = match &added.action {
            Action::Link { .. } => true,
            Action::Process { fault, .. } => fault.is_of_airframe(),
            Action::Heal(_) => false,
        };
        if !is_known {
            return None;
        }
        let all = self.faults.iter().chain([added]).cloned().collect();
        let together = Self { faults: all, ..self.clone() };
        // Faults are numbered from 1 and the added one is last, so the count is its number.
        let number = together.faults.len() as u32;
        warnings(&together).into_iter().find(|(warned, _)| *warned == number).map(|(_, warning)| warning)
    }
}

/// The faults that can have no effect, by number, each with the reason.
struct IdleFaults {
    reasons: BTreeMap<u32, String>,
}

impl IdleFaults {
    fn of(scenario: &Scenario) -> Self {
        let mut idle = Self { reasons: BTreeMap::new() };
        let presence = Presence::planned(scenario);
        idle.note_processes(scenario, &presence);
        idle.note_links(scenario, &presence);
        idle.note_airframes(scenario);
        idle.note_late(scenario);
        idle
    }

    /// Faults whose every action will be refused, and delayed answers of agents that are gone.
    fn note_processes(&mut self, scenario: &Scenario, presence: &Presence) {
        for (number, refusals) in &presence.refusals {
            // One action that is applied gives the fault an effect, even if its others are refused.
            if !presence.applied.contains(number) {
                self.reasons.insert(*number, refusals.join(", "));
            }
        }
        let slow = scenario.schedule().slow_answers();
        for one in &slow {
            let is_absent = |other: &&SlowAnswers| {
                other.number == one.number && !presence.is_ever_running(other.part, other.begin, other.end)
            };
            // A fault with several targets is idle only if none of them runs.
            let of_fault = slow.iter().filter(|other| other.number == one.number).count();
            if slow.iter().filter(is_absent).count() == of_fault {
                self.reasons.insert(one.number, format!("{} is not running then", one.part));
            }
        }
        for number in scenario.schedule().idle_healings() {
            self.reasons.insert(number, "there is nothing to heal then".into());
        }
    }

    fn note_links(&mut self, scenario: &Scenario, presence: &Presence) {
        for fault in scenario.schedule().link_faults() {
            let reason = idle_reason(&fault.impairment, scenario.time.rate_hz)
                .or_else(|| unheard(&fault, scenario))
                .or_else(|| cut_off(&fault, presence));
            if let Some(reason) = reason {
                self.reasons.insert(fault.number, reason);
            }
        }
    }

    /// Airframes that are broken to what they can do anyway, and sensors that drift nowhere.
    fn note_airframes(&mut self, scenario: &Scenario) {
        let most_m_s = scenario.airframe.speed_max_m_s;
        for fault in scenario.schedule().airframe_faults() {
            let reason = match fault.failure {
                AirframeFailure::Weak(to_m_s) if to_m_s >= most_m_s => {
                    format!("no airframe is faster than {most_m_s} m/s")
                }
                AirframeFailure::Drifting(SensorDrift::Heading { rate_rad_s: 0.0 }) => {
                    "its magnitude is 0".into()
                }
                // The first reading with an error is that of the tick after the fault begins.
                AirframeFailure::Drifting(_) if fault.end == Some(fault.begin.next()) => {
                    "it ends before the error grows".into()
                }
                _ => continue,
            };
            self.reasons.insert(fault.number, reason);
        }
    }

    /// Faults after the last tick. A sample of the last tick arrives only where the UAV senses itself.
    fn note_late(&mut self, scenario: &Scenario) {
        let (schedule, end_s) = (scenario.schedule(), scenario.time.duration_s);
        for (number, fault) in (1..).zip(&scenario.faults) {
            let is_own = matches!(&fault.action, Action::Link { links: Links::From(Sender::Own, _), .. });
            let is_link = matches!(&fault.action, Action::Link { .. });
            let last = scenario.last_tick() - i64::from(is_link && !is_own);
            if schedule.tick(fault.at_s).0 > last {
                let reason = format!("it begins at {} s, and the flight ends at {end_s} s", fault.at_s);
                self.reasons.insert(number, reason);
            }
        }
    }
}

/// Why nobody listens on any link of `fault`. Only in a ring that never closes are the listeners of each UAV certain.
fn unheard(fault: &LinkFault, scenario: &Scenario) -> Option<String> {
    let (Links::From(Sender::Uav(from), Receiver::Uav(to)) | Links::Between(from, to)) = fault.links else {
        return None;
    };
    if from == to {
        return Some(format!("uav {from} does not listen to itself: its own senses are own->{from}"));
    }
    // Neighbours are those of the slots, and not those with the next numbers.
    let order = scenario.ring_order();
    let is_neighbour = [order.previous(UavId(from)), order.next(UavId(from))].contains(&UavId(to));
    (!is_neighbour && !scenario.control.ring_closes).then(|| {
        format!("uav {from} and uav {to} are not ring neighbours, so they do not listen to each other")
    })
}

/// Why no sample crosses any link of `fault`: one of its two ends is not running for as long as it lasts.
fn cut_off(fault: &LinkFault, presence: &Presence) -> Option<String> {
    let is_gone = |uav: u32| {
        let part = Part::Agent(UavId(uav));
        (!presence.is_ever_running(part, fault.begin, fault.end))
            .then(|| format!("{part} is not running then"))
    };
    match fault.links {
        Links::From(Sender::Uav(from), Receiver::Uav(to)) | Links::Between(from, to) => {
            is_gone(from).or_else(|| is_gone(to))
        }
        Links::From(_, Receiver::Uav(uav))
        | Links::Isolate(uav)
        | Links::From(Sender::Uav(uav), Receiver::All) => is_gone(uav),
        _ => None,
    }
}

/// When each process runs, if nothing happens but the scenario's faults.
struct Presence {
    /// The changes of each process that has a fault, in order of ticks.
    states: BTreeMap<Part, Vec<(Tick, ProcessState)>>,
    /// The refused actions of each fault, in words.
    refusals: BTreeMap<u32, Vec<String>>,
    /// Faults with an action that is applied.
    applied: Vec<u32>,
}

impl Presence {
    fn planned(scenario: &Scenario) -> Self {
        let mut presence = Self { states: BTreeMap::new(), refusals: BTreeMap::new(), applied: Vec::new() };
        for scheduled in scenario.schedule().scheduled_actions() {
            let (part, action) = (scheduled.part, scheduled.action);
            let states = presence.states.entry(part).or_default();
            let state = states.last().map_or(ProcessState::Running, |(_, state)| *state);
            match state.after(action) {
                Ok(after) => {
                    // The launcher replaces a recorder at once unless its fault starts it again.
                    let is_replaced = part == Part::Recorder
                        && matches!(action, ProcessAction::Kill { returns: false } | ProcessAction::Stop);
                    states.push((scheduled.tick, if is_replaced { ProcessState::Running } else { after }));
                    presence.applied.push(scheduled.number);
                }
                Err(why) => {
                    presence.refusals.entry(scheduled.number).or_default().push(format!("{part} {why}"));
                }
            }
        }
        presence
    }

    /// Whether `part` runs in any tick from `begin` to before `end`.
    fn is_ever_running(&self, part: Part, begin: Tick, end: Option<Tick>) -> bool {
        // A process without an entry has no fault, so it runs all the time.
        let Some(states) = self.states.get(&part) else { return true };
        // Search from the back: of several changes before one tick, the last one counts.
        let before = states.iter().rev().find(|(tick, _)| *tick <= begin);
        let at_begin = before.map_or(ProcessState::Running, |(_, state)| *state);
        let is_within = |tick: Tick| tick > begin && end.is_none_or(|end| tick < end);
        at_begin == ProcessState::Running
            || states.iter().any(|(tick, state)| is_within(*tick) && *state == ProcessState::Running)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Assignment, StartState};
    use nalgebra::Point2;

    /// The warnings about the faults of a flight of 90 s at 100 Hz under this law.
    fn warned(sentences: &[&str], ring_closes: bool) -> Vec<(u32, String)> {
        let mut scenario = Scenario::default();
        scenario.control.ring_closes = ring_closes;
        scenario.faults = sentences.iter().map(|text| text.parse().unwrap()).collect();
        warnings(&scenario)
    }

    fn reason(sentence: &str) -> Option<String> {
        warned(&[sentence], false).pop().map(|(_, reason)| reason)
    }

    #[test]
    fn neighbours_are_those_of_the_slots() {
        let mut scenario = Scenario::default();
        scenario.formation.assignment = Assignment::Nearest;
        // UAVs 2 and 3 start near each other's slots.
        let slots = [1, 3, 2, 4, 5, 6].map(|slot| scenario.start_slot(slot));
        let start =
            |place: Point2<f64>| StartState { position_m: place.into(), heading_deg: 0.0, speed_m_s: 15.0 };
        scenario.start.uavs = slots.map(start).into();
        let warned = |sentence: &str| {
            let scenario = Scenario { faults: vec![sentence.parse().unwrap()], ..scenario.clone() };
            warnings(&scenario).len()
        };
        assert_eq!(["at 5 s link 1->3 blackout", "at 5 s link 1->2 blackout"].map(warned), [0, 1]);
    }

    #[test]
    fn a_fault_that_cannot_act_is_named_with_the_reason() {
        for (sentence, expected) in [
            ("at 95 s kill uav 3", "it begins at 95 s, and the flight ends at 90 s"),
            ("at 90 s link 2->3 blackout", "it begins at 90 s"),
            ("at 5 s link 2->5 blackout", "uav 2 and uav 5 are not ring neighbours"),
            ("at 5 s link 3->3 blackout", "uav 3 does not listen to itself: its own senses are own->3"),
            ("at 5 s link 2->3 delay 4 ms", "4 ms rounds to no tick at 100 Hz"),
            ("at 5 s link 2->3 delay 1 ms jitter 3 ms", "4 ms rounds to no tick"),
            ("at 5 s link 2->3 delay trace {1 ms, 4 ms}", "4 ms rounds to no tick"),
            ("at 5 s link all reorder 20 % by 3 ms", "3 ms rounds to no tick"),
            ("at 5 s link all loss 0 %", "its magnitude is 0"),
            ("at 5 s link all reorder 0 % by 50 ms", "its magnitude is 0"),
            ("at 5 s link all gilbert loss 0 % burst 80 ms", "its magnitude is 0"),
            ("at 5 s link all corrupt 0", "its magnitude is 0"),
            ("at 5 s link all gilbert 0 10 %", "its magnitude is 0"),
            ("at 5 s link all gilbert 5 % 10 % 1", "its magnitude is 0"),
            ("at 5 s link all bias x 0 m", "its magnitude is 0"),
            ("at 5 s link all noise position 0 m", "its magnitude is 0"),
            (
                "at 5 s link all rate 100 samples/s",
                "100 samples/s are enough for the 100 that each sender sends",
            ),
            ("at 5 s weaken uav 3 to 25 m/s", "no airframe is faster than 25 m/s"),
            ("at 95 s jam uav 3 turn at 5 deg/s", "it begins at 95 s"),
            ("at 5 s drift uav 3 heading at 0 deg/s", "its magnitude is 0"),
            ("at 5 s drift uav 3 position at 1 m/s toward 0 deg for 10 ms", "it ends before the error grows"),
            ("at 5 s heal all", "there is nothing to heal then"),
            ("at 5 s thaw uav 3", "uav 3 is not frozen"),
            ("at 5 s start leader", "leader is there already"),
        ] {
            let warning = reason(sentence).unwrap_or_else(|| panic!("no warning about {sentence}"));
            let reason = warning.strip_prefix("the fault will have no effect: ").unwrap();
            assert!(reason.starts_with(expected), "{sentence}: {reason}");
        }
    }

    #[test]
    fn a_fault_that_may_act_is_not_named() {
        for sentence in [
            "at 90 s kill uav 3",
            "at 90 s link own->3 blackout",
            "at 5 s link 6->1 blackout",
            "at 5 s link 1<->6 loss 1 %",
            "at 5 s link 2->3 delay 5 ms",
            "at 5 s link 2->3 delay 1 ms normal 1 ms",
            "at 5 s link all gilbert 0 10 % 0 0.5",
            "at 5 s link all rate 99 samples/s",
            "at 5 s isolate 3",
            "at 5 s slow uav 3 by 1 ms",
            "at 5 s weaken uav 3 to 14 m/s",
            "at 5 s jam uav 3 turn at 0 deg/s for 2 s",
            "at 5 s drift uav 3 position at 0.5 m/s toward 90 deg for 20 ms",
        ] {
            let idle = reason(sentence).filter(|warning| warning.starts_with("the fault will"));
            assert_eq!(idle, None, "{sentence}");
        }
        assert_eq!(
            warned(&["at 5 s link 2->5 blackout"], true),
            [],
            "after losses they may become neighbours"
        );
    }

    #[test]
    fn what_earlier_faults_do_to_a_process_decides_whether_later_ones_act() {
        let numbers = |sentences: &[&str]| -> Vec<u32> {
            warned(sentences, false).into_iter().map(|(number, _)| number).collect()
        };
        let gone = [
            "at 5 s kill uav 3",
            "at 6 s freeze uav 3 for 1 s",
            "at 7 s link 2->3 loss 5 %",
            "at 8 s slow uav 3 by 1 ms",
        ];
        assert_eq!(numbers(&gone), [2, 3, 4]);
        assert_eq!(
            numbers(&["at 5 s restart uav 3 after 1 s", "at 5.5 s link own->3 hold for 2 s"]),
            [0_u32; 0]
        );
        assert_eq!(numbers(&["at 5 s kill recorder", "at 6 s kill recorder"]), [0_u32; 0]);
        assert_eq!(numbers(&["at 5 s kill uav 3", "at 6 s kill uav 2,3"]), [0_u32; 0], "uav 2 is there");
    }

    #[test]
    fn a_link_is_cut_off_if_either_end_is_gone_for_as_long_as_the_fault_lasts() {
        let idle = |process: &[&str], link: &str| {
            let sentences: Vec<&str> = process.iter().copied().chain([link]).collect();
            warned(&sentences, false).iter().any(|(number, _)| *number as usize == sentences.len())
        };
        let gone = ["at 4 s kill uav 3"];
        for link in ["link 3->2 hold", "link 2->3 hold", "link 3<->4 hold", "link leader->3 hold"] {
            assert!(idle(&gone, &format!("at 5 s {link}")), "{link}");
        }
        assert!(idle(&gone, "at 5 s isolate 3") && idle(&gone, "at 5 s link 3->all hold"));
        assert!(!idle(&gone, "at 5 s link 1->2 hold") && !idle(&gone, "at 5 s link all hold"));
        // It is back in tick 700.
        let away = ["at 5 s restart uav 3 after 2 s"];
        assert!(idle(&away, "at 5.5 s link own->3 hold for 1 s"));
        assert!(idle(&away, "at 5.5 s link own->3 hold for 1.5 s"));
        assert!(!idle(&away, "at 5.5 s link own->3 hold for 1.51 s"));
        let at_once = ["at 4 s kill uav 3", "at 5 s start uav 3", "at 5 s kill uav 3"];
        assert!(idle(&at_once, "at 5 s link own->3 hold for 1 s"), "the last change of a tick counts");
    }

    #[test]
    fn a_fault_that_is_added_is_warned_of_unless_only_the_launcher_can_know() {
        let planned =
            Scenario { faults: vec!["at 5 s link 2->3 delay 4 ms".parse().unwrap()], ..Scenario::default() };
        let warning = |sentence: &str| planned.warning_about(&sentence.parse().unwrap()).unwrap_or_default();
        assert!(warning("at 6 s link 3->4 delay 3 ms").contains("3 ms rounds to no tick"));
        assert!(warning("at 6 s weaken uav 2 to 25 m/s").contains("no airframe is faster than 25 m/s"));
        for fine in ["at 6 s link 3->4 delay 30 ms", "at 6 s thaw uav 3", "at 6 s heal link 4->5"] {
            assert_eq!(warning(fine), "", "{fine}");
        }
    }

    #[test]
    fn a_delay_that_rounding_changes_noticeably_is_named() {
        assert_eq!(
            reason("at 5 s link 2->3 delay 14 ms").unwrap(),
            "delays are whole ticks: 14 ms becomes 10 ms at 100 Hz"
        );
        assert_eq!(reason("at 5 s link 2->3 delay 104 ms"), None);
    }
}
