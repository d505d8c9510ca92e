use super::*;
use crate::{
    controller::{Controller, Guest, Wish},
    pilot::Situation,
    reception::{Sample, Take, sample::test_state},
};
use nalgebra::Point2;
use ringwing_flight::{FlightMode, SensedObstacle, payload::MAX_SENSED_OBSTACLES};
use ringwing_scenario::{Fault, FaultSchedule};
use std::{
    collections::{BTreeMap, BTreeSet},
    convert::Infallible,
    ops::RangeInclusive,
};

const TIMEOUT_TICKS: i64 = 10;

/// Inputs over plain lists, which keep everything.
#[derive(Default)]
struct Lists {
    sensed: Vec<Sensed>,
    traffic: Vec<Traffic>,
    states: BTreeMap<UavId, Vec<UavState>>,
    leader: Vec<LeaderState>,
    open: BTreeSet<UavId>,
}

fn hand_over<T: Sample>(list: &[T], ticks: &RangeInclusive<Tick>, take: &mut Take<T>) {
    list.iter().filter(|sample| ticks.contains(&sample.tick())).for_each(take);
}

impl Inputs for Lists {
    type Error = Infallible;

    fn sensed(&mut self, ticks: RangeInclusive<Tick>, take: &mut Take<Sensed>) -> Result<(), Infallible> {
        hand_over(&self.sensed, &ticks, take);
        Ok(())
    }

    fn traffic(&mut self, ticks: RangeInclusive<Tick>, take: &mut Take<Traffic>) -> Result<(), Infallible> {
        hand_over(&self.traffic, &ticks, take);
        Ok(())
    }

    fn state(
        &mut self,
        from: UavId,
        ticks: RangeInclusive<Tick>,
        take: &mut Take<UavState>,
    ) -> Result<(), Infallible> {
        hand_over(self.states.entry(from).or_default(), &ticks, take);
        Ok(())
    }

    fn leader(
        &mut self,
        ticks: RangeInclusive<Tick>,
        take: &mut Take<LeaderState>,
    ) -> Result<(), Infallible> {
        hand_over(&self.leader, &ticks, take);
        Ok(())
    }

    fn open_state(&mut self, from: UavId) -> Result<(), Infallible> {
        assert!(self.open.insert(from), "{from} is open already");
        Ok(())
    }

    fn close_state(&mut self, from: UavId) {
        self.open.remove(&from);
    }
}

fn senses(tick: i64) -> Sensed {
    Sensed {
        tick: Tick(tick),
        position_m: [0.0; 2],
        heading_rad: 0.0,
        speed_m_s: 15.0,
        turn_rate_rad_s: 0.0,
        uav: UavId(1),
        mode: FlightMode::COMMANDED,
        obstacle_count: 0,
        obstacles_omitted: 0,
        obstacles: [SensedObstacle::default(); MAX_SENSED_OBSTACLES],
        position_age_ticks: 0,
        heading_age_ticks: 0,
    }
}

fn leader_state(tick: i64) -> LeaderState {
    LeaderState {
        tick: Tick(tick),
        position_m: [0.0; 2],
        heading_rad: 0.0,
        speed_m_s: 15.0,
        turn_rate_rad_s: 0.0,
    }
}

/// UAV 1's agent of a swarm of six whose ring closes, with its inputs.
fn agent() -> (UavAgent, Lists) {
    let mut scenario = Scenario::default();
    scenario.control.ring_closes = true;
    scenario.membership.loss_timeout_s = TIMEOUT_TICKS as f64 * scenario.period_s();
    let agent = UavAgent::new(&scenario, UavId(1));
    let lists = Lists { open: agent.listened().iter().copied().collect(), ..Lists::default() };
    (agent, lists)
}

/// One tick: the agent receives what is in the lists, flies, and updates its inputs.
fn step(agent: &mut UavAgent, lists: &mut Lists, now: i64) -> Answer {
    let Ok(()) = agent.receive(Tick(now), lists);
    let answer = agent.fly(Tick(now));
    let Ok(()) = agent.update_inputs(lists);
    answer
}

/// Flies the ticks `from..to` with own senses, and with states from each of `senders`.
fn fly(agent: &mut UavAgent, lists: &mut Lists, [from, to]: [i64; 2], senders: &[u32]) {
    for now in from..to {
        lists.sensed.push(senses(now));
        for uav in senders.iter().map(|number| UavId(*number)) {
            let state = UavState { uav, ..test_state(now - 1) };
            lists.states.entry(uav).or_default().push(state);
        }
        step(agent, lists, now);
    }
}

fn link_faults(sentence: &str) -> Vec<LinkFault> {
    let faults: [Fault; 1] = [sentence.parse().unwrap()];
    FaultSchedule { faults: &faults, seed: 1, rate_hz: 100, uavs: 6 }.link_faults()
}

#[test]
fn an_agent_without_senses_answers_by_withholding_its_command() {
    let (mut agent, mut lists) = agent();
    lists.sensed.push(senses(0));
    for now in 0..TIMEOUT_TICKS {
        let answer = step(&mut agent, &mut lists, now);
        assert_eq!((answer.command.tick, answer.command.withheld), (Tick(now), 0));
        assert!(answer.state.is_some() && answer.account.is_some());
    }
    let answer = step(&mut agent, &mut lists, TIMEOUT_TICKS);
    assert_eq!(answer.command, Command::withheld(Tick(TIMEOUT_TICKS), UavId(1)));
    assert!(answer.state.is_none() && answer.account.is_none());
}

#[test]
fn senses_can_be_used_in_their_own_tick_and_leader_states_in_the_next() {
    let (mut agent, mut lists) = agent();
    lists.sensed.push(senses(0));
    lists.leader.push(leader_state(0));
    let account = step(&mut agent, &mut lists, 0).account.unwrap();
    assert_eq!(account.leader_age.ticks(), None);
    let account = step(&mut agent, &mut lists, 1).account.unwrap();
    assert_eq!(account.leader_age.ticks(), Some(1));
}

#[test]
fn the_input_beyond_a_silent_neighbour_opens_and_closes_again_when_the_neighbour_returns() {
    let (mut agent, mut lists) = agent();
    let open = |lists: &Lists| lists.open.iter().map(|uav| uav.0).collect::<Vec<_>>();
    fly(&mut agent, &mut lists, [0, 10], &[2, 6]);
    assert_eq!(open(&lists), [2, 6]);
    fly(&mut agent, &mut lists, [10, 30], &[3, 6]);
    assert_eq!(open(&lists), [2, 3, 6]);
    // UAV 2 returns in its next incarnation.
    let mut state = test_state(29);
    state.rumours[0] = ringwing_flight::Rumour { uav: 2, standing: 3 };
    lists.states.get_mut(&UavId(2)).unwrap().push(state);
    fly(&mut agent, &mut lists, [30, 32], &[2, 6]);
    assert_eq!(open(&lists), [2, 6]);
}

#[test]
fn links_with_faults_report_their_counts_once_a_second_and_at_the_last_tick() {
    let (mut agent, _) = agent();
    let last = agent.last_tick.0;
    assert_eq!(agent.link_counts(Tick(100)).len(), 0, "no link has a fault");
    agent.set_faults(&link_faults("at 0 s link 2->1 blackout"));
    for (now, reports) in [(0, 1), (1, 0), (99, 0), (100, 1), (last - 1, 0), (last, 1)] {
        assert_eq!(agent.link_counts(Tick(now)).len(), reports, "at {now}");
    }
    agent.set_faults(&link_faults("at 0 s isolate 1"));
    assert_eq!(agent.link_counts(Tick(0)).len(), 3, "both neighbours and the leader");
}

#[test]
fn a_fault_is_reported_when_it_first_alters_a_sample_and_at_the_last_tick() {
    let (mut agent, mut lists) = agent();
    agent.set_faults(&link_faults("at 0.05 s link 2->1 blackout"));
    let mut first = None;
    for now in 0..20 {
        fly(&mut agent, &mut lists, [now, now + 1], &[2, 6]);
        let acted = agent.link_counts(Tick(now)).into_iter().filter(|counts| counts.acted == 1).count();
        if acted > 0 {
            assert_eq!(first.replace(now), None, "reported once");
        }
    }
    assert_eq!(first, Some(6), "what is sent in tick 5 is missing in tick 6");
    let last = agent.last_tick;
    assert_eq!(agent.link_counts(last).iter().map(|counts| counts.acted).collect::<Vec<_>>(), [0, 1]);
}

#[test]
fn an_input_that_opens_later_has_the_faults_of_its_link() {
    let (mut agent, mut lists) = agent();
    agent.set_faults(&link_faults("at 0 s link 3->1 blackout"));
    assert_eq!(agent.link_counts(Tick(0)).len(), 0);
    fly(&mut agent, &mut lists, [0, 30], &[6]);
    assert!(agent.listened().contains(&UavId(3)));
    assert_eq!(agent.link_counts(Tick(0)).len(), 1);
}

#[test]
fn an_account_says_which_commands_eq_12_cut() {
    let cut = |leader_m: [f64; 2], heading_rad: f64| {
        let mut scenario = Scenario::default();
        // The resilient law limits the force itself, which leaves little to cut.
        scenario.control.force_limited = false;
        let (mut agent, mut lists) = (UavAgent::new(&scenario, UavId(1)), Lists::default());
        lists.sensed.push(Sensed { heading_rad, ..senses(0) });
        // The leader stands where its ring would have UAV 1 in its slot, but for this displacement.
        let slot = Scenario::default().formation().slot(1, Point2::origin());
        let position_m = [leader_m[0] - slot.x, leader_m[1] - slot.y];
        lists.leader.push(LeaderState { position_m, ..leader_state(0) });
        step(&mut agent, &mut lists, 0);
        let account = step(&mut agent, &mut lists, 1).account.unwrap();
        (account.speed_saturated, account.turn_rate_saturated)
    };
    assert_eq!(cut([0.0, 0.0], 0.0), (0, 0), "in its slot");
    assert_eq!(cut([500.0, 0.0], 0.0), (1, 0), "the slot is far ahead");
    assert_eq!(cut([0.0, 500.0], 0.0).1, 1, "the slot is far to the left");
}

/// Counts its steps, and wishes for the same every time.
struct Counting {
    wish: Wish,
    steps: u32,
}

impl Controller for &mut Counting {
    fn step(&mut self, situation: &Situation<'_>) -> Wish {
        self.steps += 1;
        assert_eq!((situation.uav, situation.membership.living), (UavId(1), 6));
        self.wish
    }
}

/// What UAV 1 answers in tick 1 while a controller wishes for `speed_m_s` and `turn_rate_rad_s`.
fn answer_of_controller(speed_m_s: f64, turn_rate_rad_s: f64) -> Answer {
    let mut controller = Counting { wish: Wish::new(speed_m_s, turn_rate_rad_s), steps: 0 };
    let mut agent = UavAgent::steered_by(Guest::new(&mut controller), &Scenario::default(), UavId(1));
    // What the leader sends in tick 0 can be used in tick 1.
    let mut lists = Lists { sensed: vec![senses(0)], leader: vec![leader_state(0)], ..Lists::default() };
    let Ok(()) = agent.receive(Tick(0), &mut lists);
    agent.fly(Tick(0));
    lists.sensed.push(senses(1));
    let Ok(()) = agent.receive(Tick(1), &mut lists);
    agent.rehearsal().fly(Tick(1));
    let answer = agent.fly(Tick(1));
    assert_eq!(controller.steps, 2, "a rehearsal does not ask the controller");
    answer
}

#[test]
fn what_a_controller_wishes_is_flown_within_the_limits_of_the_airframe() {
    let Answer { state, command, account } = answer_of_controller(16.5, -0.125);
    assert_eq!((command.speed_m_s, command.turn_rate_rad_s, command.withheld), (16.5, -0.125, 0));
    assert_eq!(state.unwrap().speed_m_s, 16.5, "the neighbours hear it");
    let account = account.unwrap();
    assert_eq!((account.speed_saturated, account.turn_rate_saturated), (0, 0));
    assert!(account.slot_m != [0.0; 2], "the log knows the slot");

    let limits = Scenario::default().airframe;
    let Answer { command, account, .. } = answer_of_controller(1e9, -1e9);
    assert_eq!(
        (command.speed_m_s, command.turn_rate_rad_s),
        (limits.speed_max_m_s, -limits.turn_rate_max_rad_s)
    );
    let account = account.unwrap();
    assert_eq!((account.speed_saturated, account.turn_rate_saturated), (1, 1));
}

#[test]
fn a_wish_that_is_not_a_finite_number_is_withheld() {
    for (speed_m_s, turn_rate_rad_s) in
        [(f64::NAN, 0.0), (15.0, f64::NAN), (f64::INFINITY, 0.0), (15.0, f64::NEG_INFINITY)]
    {
        let answer = answer_of_controller(speed_m_s, turn_rate_rad_s);
        assert!(answer.command.is_not_finite() && answer.command.speed_m_s == 0.0, "{answer:?}");
        assert_eq!((answer.state, answer.account), (None, None));
    }
}

/// Notes how often it was asked, and wishes for nothing that can be flown.
#[derive(Clone, Default)]
struct Noting(f64);

impl Controller for Noting {
    fn step(&mut self, _: &Situation<'_>) -> Wish {
        self.0 += 1.0;
        Wish::new(f64::NAN, 0.0).with_note("steps", self.0).with_note("no name", 0.0)
    }
}

#[test]
fn notes_belong_to_the_tick_in_which_they_were_made_and_come_without_a_command_too() {
    let mut agent = UavAgent::steered_by(Guest::new(Noting::default()), &Scenario::default(), UavId(4));
    let mut lists = Lists { sensed: vec![Sensed { uav: UavId(4), ..senses(0) }], ..Lists::default() };
    let noted = |agent: &UavAgent<Guest<Noting>>, tick| {
        let notes = agent.notes(Tick(tick))?;
        assert_eq!((notes.tick, notes.uav), (Tick(tick), UavId(4)));
        Some(notes.iter().map(|(name, value)| (name.to_owned(), value)).collect::<Vec<_>>())
    };
    assert_eq!(noted(&agent, 0), None);
    let Ok(()) = agent.receive(Tick(0), &mut lists);
    assert!(agent.fly(Tick(0)).command.is_not_finite());
    assert_eq!(noted(&agent, 0), Some(vec![("steps".into(), 1.0)]));
    assert_eq!(agent.notes(Tick(0)).unwrap().refused().unwrap().0, "no name");
    let mut rehearsal = agent.rehearsal();
    rehearsal.fly(Tick(1));
    assert!(rehearsal.notes(Tick(1)).is_none());
    // Nothing is sensed for longer than the loss timeout, so the controller is not asked.
    let late = Tick(1000);
    let Ok(()) = agent.receive(late, &mut lists);
    agent.fly(late);
    assert_eq!(noted(&agent, 1000), None);
}

#[test]
fn a_uav_tells_its_neighbours_and_the_log_what_it_estimates_and_not_what_it_reads() {
    let mut scenario = Scenario::default();
    scenario.sensors.position_noise_m = 1.0;
    scenario.control.pose_estimated = true;
    let mut agent = UavAgent::new(&scenario, UavId(1));
    let mut lists = Lists { open: agent.listened().iter().copied().collect(), ..Lists::default() };
    let mut answer = None;
    for now in 0..20 {
        // It flies east at 15 m/s, and the fix of the last tick is 3 m too far to the north.
        let place = [0.15 * now as f64, if now == 19 { 3.0 } else { 0.0 }];
        lists.sensed.push(Sensed { position_m: place, ..senses(now) });
        answer = Some(step(&mut agent, &mut lists, now));
    }
    let Answer { state: Some(state), account: Some(account), .. } = answer.unwrap() else { panic!("flies") };
    assert_eq!(state.position_m, account.estimate_m);
    assert!((0.1..2.0).contains(&state.position_m[1]), "{:?}", state.position_m);
    assert!((state.position_m[0] - 2.85).abs() < 0.1, "{:?}", state.position_m);
}
