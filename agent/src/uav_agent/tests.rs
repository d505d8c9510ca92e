use super::*;
use crate::reception::{Take, sample::test_state};
use ringwing_flight::{FlightMode, SensedObstacle, payload::MAX_SENSED_OBSTACLES};
use ringwing_scenario::{Fault, FaultSchedule};
use std::{
    collections::{BTreeMap, BTreeSet, VecDeque},
    convert::Infallible,
};

const TIMEOUT_TICKS: i64 = 10;

/// Inputs over plain queues.
#[derive(Default)]
struct Queues {
    sensed: VecDeque<Sensed>,
    states: BTreeMap<UavId, VecDeque<UavState>>,
    leader: VecDeque<LeaderState>,
    open: BTreeSet<UavId>,
    /// No more inputs can be opened.
    is_full: bool,
}

fn hand_over<T>(queue: Option<&mut VecDeque<T>>, take: &mut Take<T>) {
    let Some(queue) = queue else { return };
    while queue.pop_front().is_some_and(|sample| !take(&sample)) {}
}

impl Inputs for Queues {
    type Error = Infallible;

    fn sensed(&mut self, take: &mut Take<Sensed>) -> Result<(), Infallible> {
        hand_over(Some(&mut self.sensed), take);
        Ok(())
    }

    fn state(&mut self, from: UavId, take: &mut Take<UavState>) -> Result<(), Infallible> {
        hand_over(self.states.get_mut(&from), take);
        Ok(())
    }

    fn leader(&mut self, take: &mut Take<LeaderState>) -> Result<(), Infallible> {
        hand_over(Some(&mut self.leader), take);
        Ok(())
    }

    fn open_state(&mut self, from: UavId) -> Result<bool, Infallible> {
        Ok(!self.is_full && self.open.insert(from))
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
fn agent() -> (UavAgent, Queues) {
    let mut scenario = Scenario::default();
    scenario.control.ring_closes = true;
    scenario.membership.loss_timeout_s = TIMEOUT_TICKS as f64 * scenario.period_s();
    let agent = UavAgent::new(&scenario, UavId(1));
    let queues = Queues { open: agent.listened().iter().copied().collect(), ..Queues::default() };
    (agent, queues)
}

/// One tick: the agent receives what is in the queues, flies, and updates its inputs.
fn step(agent: &mut UavAgent, queues: &mut Queues, now: i64) -> Answer {
    let Ok(()) = agent.receive(Tick(now), queues);
    let answer = agent.fly(Tick(now));
    let Ok(()) = agent.update_inputs(queues);
    answer
}

/// Flies the ticks `from..to` with own senses, and with states from each of `senders`.
fn fly(agent: &mut UavAgent, queues: &mut Queues, [from, to]: [i64; 2], senders: &[u32]) {
    for now in from..to {
        queues.sensed.push_back(senses(now));
        for uav in senders.iter().map(|number| UavId(*number)) {
            let state = UavState { uav, ..test_state(now - 1) };
            queues.states.entry(uav).or_default().push_back(state);
        }
        step(agent, queues, now);
    }
}

fn link_faults(sentence: &str) -> Vec<LinkFault> {
    let faults: [Fault; 1] = [sentence.parse().unwrap()];
    FaultSchedule { faults: &faults, seed: 1, rate_hz: 100, uavs: 6 }.link_faults()
}

#[test]
fn an_agent_without_senses_answers_by_withholding_its_command() {
    let (mut agent, mut queues) = agent();
    queues.sensed.push_back(senses(0));
    for now in 0..TIMEOUT_TICKS {
        let answer = step(&mut agent, &mut queues, now);
        assert_eq!((answer.command.tick, answer.command.withheld), (Tick(now), 0));
        assert!(answer.state.is_some() && answer.account.is_some());
    }
    let answer = step(&mut agent, &mut queues, TIMEOUT_TICKS);
    assert_eq!(answer.command, Command::withheld(Tick(TIMEOUT_TICKS), UavId(1)));
    assert!(answer.state.is_none() && answer.account.is_none());
}

#[test]
fn senses_can_be_used_in_their_own_tick_and_leader_states_in_the_next() {
    let (mut agent, mut queues) = agent();
    queues.sensed.push_back(senses(0));
    queues.leader.push_back(leader_state(0));
    let account = step(&mut agent, &mut queues, 0).account.unwrap();
    assert_eq!(account.leader_age.ticks(), None);
    assert_eq!(agent.newest_leader_arrived(), Some(Tick(0)));
    let account = step(&mut agent, &mut queues, 1).account.unwrap();
    assert_eq!(account.leader_age.ticks(), Some(1));
}

#[test]
fn the_input_beyond_a_silent_neighbour_opens_and_closes_again_when_the_neighbour_returns() {
    let (mut agent, mut queues) = agent();
    let open = |queues: &Queues| queues.open.iter().map(|uav| uav.0).collect::<Vec<_>>();
    fly(&mut agent, &mut queues, [0, 10], &[2, 6]);
    assert_eq!(open(&queues), [2, 6]);
    fly(&mut agent, &mut queues, [10, 30], &[3, 6]);
    assert_eq!(open(&queues), [2, 3, 6]);
    // UAV 2 returns in its next incarnation.
    let mut state = test_state(29);
    state.rumours[0] = ringwing_flight::Rumour { uav: 2, standing: 3 };
    queues.states.get_mut(&UavId(2)).unwrap().push_back(state);
    fly(&mut agent, &mut queues, [30, 32], &[2, 6]);
    assert_eq!(open(&queues), [2, 6]);
}

#[test]
fn an_input_that_cannot_be_opened_is_tried_again() {
    let (mut agent, mut queues) = agent();
    queues.is_full = true;
    fly(&mut agent, &mut queues, [0, 30], &[6]);
    assert!(agent.listened().contains(&UavId(3)) && !queues.open.contains(&UavId(3)));
    queues.is_full = false;
    fly(&mut agent, &mut queues, [30, 31], &[6]);
    assert!(queues.open.contains(&UavId(3)));
}

#[test]
fn links_with_faults_report_their_counts_once_a_second_and_at_the_last_tick() {
    let (mut agent, _) = agent();
    let last = agent.last_tick.0;
    assert_eq!(agent.link_counts(Tick(100)).count(), 0, "no link has a fault");
    agent.set_faults(&link_faults("at 0 s link 2->1 blackout"));
    for (now, reports) in [(0, 1), (1, 0), (99, 0), (100, 1), (last - 1, 0), (last, 1)] {
        assert_eq!(agent.link_counts(Tick(now)).count(), reports, "at {now}");
    }
    agent.set_faults(&link_faults("at 0 s isolate 1"));
    assert_eq!(agent.link_counts(Tick(0)).count(), 3, "both neighbours and the leader");
}

#[test]
fn an_input_that_opens_later_has_the_faults_of_its_link() {
    let (mut agent, mut queues) = agent();
    agent.set_faults(&link_faults("at 0 s link 3->1 blackout"));
    assert_eq!(agent.link_counts(Tick(0)).count(), 0);
    fly(&mut agent, &mut queues, [0, 30], &[6]);
    assert!(agent.listened().contains(&UavId(3)));
    assert_eq!(agent.link_counts(Tick(0)).count(), 1);
}
