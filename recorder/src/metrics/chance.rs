//! What nobody asked for: processes that were lost, and everything else by which the flight depends on chance.
//!
//! Must never forget an event: what is not listed is counted.

use ringwing_flight::{Event, Part, ProcessEnd, Tick, TimedEvent};
use ringwing_scenario::Scenario;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Losses and chance events that are listed each; further ones are only counted. More make the summary of a run in which
/// everything fails too long to read.
const LISTED: usize = 100;

/// A process that was lost although no fault of the run asked for it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct UnplannedLoss {
    /// Which one: `uav 3`, `leader` or `recorder`.
    pub process: String,
    /// When the launcher noticed it, in simulated time.
    pub time_s: f64,
    /// How it ended: `killed by signal 9 (SIGKILL)`.
    pub cause: String,
    /// The signal that killed it; absent if it exited, or if nobody could see how it ended.
    pub signal: Option<i32>,
}

/// Something by which the flight depends on chance.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ChanceEvent {
    /// What happened, as a sentence.
    pub what: String,
    /// When, in simulated time.
    pub time_s: f64,
}

/// Collects what nobody asked for.
#[derive(Debug, Clone)]
pub(super) struct ChanceWatch {
    rate_hz: u32,
    is_real_time: bool,
    losses: u64,
    listed_losses: Vec<UnplannedLoss>,
    /// The processes that somebody outside the run has frozen and nobody has thawed yet, each with the tick.
    frozen: BTreeMap<Part, Tick>,
    chances: u64,
    listed_chances: Vec<ChanceEvent>,
    /// The first event by which a flight in lockstep went on without waiting for everybody.
    broke_lockstep: Option<ChanceEvent>,
}

impl ChanceWatch {
    pub(super) fn new(scenario: &Scenario) -> Self {
        let mut watch = Self {
            rate_hz: scenario.time.rate_hz,
            is_real_time: scenario.time.real_time,
            losses: 0,
            listed_losses: Vec::new(),
            frozen: BTreeMap::new(),
            chances: 0,
            listed_chances: Vec::new(),
            broke_lockstep: None,
        };
        // Even an undisturbed flight in real time may differ the next time, so it is never repeatable.
        if watch.is_real_time {
            let what = "the wall clock decides which data arrive in time".to_owned();
            watch.add_chance(ChanceEvent { what, time_s: 0.0 });
        }
        watch
    }

    /// Takes an event. The flight need not have come to its tick.
    pub(super) fn on_event(&mut self, timed: &TimedEvent) {
        let TimedEvent { tick, event } = timed;
        match event {
            Event::ProcessLost { part, end, .. } => self.add_loss(*part, *tick, *end),
            Event::ProcessFrozen { part } => drop(self.frozen.insert(*part, *tick)),
            // A fault that thaws or kills a process takes over what happens to it.
            Event::ProcessThawed { part } | Event::ProcessFault { part, .. } => {
                self.frozen.remove(part);
            }
            _ => {}
        }
        if event.is_by_chance() {
            let chance = self.chance(timed);
            // Kept by itself, because the list may be full by then. In real time there is no lockstep to break.
            if event.breaks_lockstep() && !self.is_real_time {
                self.broke_lockstep.get_or_insert_with(|| chance.clone());
            }
            self.add_chance(chance);
        }
    }

    fn chance(&self, TimedEvent { tick, event }: &TimedEvent) -> ChanceEvent {
        // No event by chance involves an obstacle, so its text needs no obstacle's name.
        let what = event.text(|_| String::new());
        ChanceEvent { what, time_s: tick.seconds(self.rate_hz) }
    }

    fn add_chance(&mut self, chance: ChanceEvent) {
        self.chances += 1;
        if self.listed_chances.len() < LISTED {
            self.listed_chances.push(chance);
        }
    }

    fn add_loss(&mut self, part: Part, tick: Tick, end: ProcessEnd) {
        // A frozen process that dies is one loss and not two.
        self.frozen.remove(&part);
        self.losses += 1;
        if self.listed_losses.len() < LISTED {
            let signal = if let ProcessEnd::Killed(signal) = end { Some(signal) } else { None };
            self.listed_losses.push(self.loss(part, tick, end.cause(), signal));
        }
    }

    fn loss(&self, part: Part, tick: Tick, cause: String, signal: Option<i32>) -> UnplannedLoss {
        UnplannedLoss { process: part.to_string(), time_s: tick.seconds(self.rate_hz), cause, signal }
    }

    /// Number of processes lost so far. One that stays frozen to the end takes no part in the flight any more, like a
    /// dead one, so it counts.
    pub(super) fn losses(&self) -> u64 {
        self.losses + self.frozen.len() as u64
    }

    /// The losses, in the order in which they were noticed.
    pub(super) fn listed_losses(&self) -> Vec<UnplannedLoss> {
        let frozen = |(part, tick): (&Part, &Tick)| {
            self.loss(*part, *tick, "frozen (SIGSTOP) and never thawed".into(), None)
        };
        // This cannot underflow, because `add_loss` stops at `LISTED`.
        let room = LISTED - self.listed_losses.len();
        self.listed_losses.iter().cloned().chain(self.frozen.iter().map(frozen).take(room)).collect()
    }

    /// Number of events by which the flight depends on chance.
    pub(super) fn chances(&self) -> u64 {
        self.chances
    }

    /// The first of those events.
    pub(super) fn listed_chances(&self) -> Vec<ChanceEvent> {
        self.listed_chances.clone()
    }

    /// The first event by which a flight in lockstep went on without waiting for everybody.
    pub(super) fn broke_lockstep(&self) -> Option<ChanceEvent> {
        self.broke_lockstep.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing;
    use ringwing_flight::{AfterLoss, ProcessAction, UavId};

    const AGENT: Part = Part::Agent(UavId(3));

    fn watch(events: &[Event]) -> ChanceWatch {
        let mut watch = ChanceWatch::new(&testing::ring_of(6, 40.0));
        for (tick, event) in (100..).step_by(100).zip(events) {
            watch.on_event(&TimedEvent { tick: Tick(tick), event: event.clone() });
        }
        watch
    }

    fn lost(part: Part, end: ProcessEnd) -> Event {
        Event::ProcessLost { part, end, then: AfterLoss::Failsafe { before_flight: false } }
    }

    #[test]
    fn a_loss_names_the_process_the_time_and_the_signal() {
        let watch = watch(&[
            lost(AGENT, ProcessEnd::Killed(7)),
            lost(Part::Leader, ProcessEnd::Exited(0)),
            lost(Part::Recorder, ProcessEnd::Killed(9)),
        ]);
        let told = |loss: UnplannedLoss| format!("{} {} {}", loss.process, loss.time_s, loss.cause);
        let losses: Vec<String> = watch.listed_losses().into_iter().map(told).collect();
        assert_eq!(
            losses,
            [
                "uav 3 1 killed by signal 7 (SIGBUS)",
                "leader 2 exited with status 0",
                "recorder 3 killed by signal 9 (SIGKILL)",
            ]
        );
        assert_eq!((watch.losses(), watch.listed_losses()[0].signal), (3, Some(7)));
        assert_eq!(watch.chances(), 2, "the recorder never changes the flight");
    }

    #[test]
    fn a_process_that_stays_frozen_counts_as_lost_and_one_that_is_thawed_does_not() {
        let frozen = Event::ProcessFrozen { part: AGENT };
        let thawed = Event::ProcessThawed { part: AGENT };
        assert_eq!(watch(std::slice::from_ref(&frozen)).losses(), 1);
        assert_eq!(
            watch(std::slice::from_ref(&frozen)).listed_losses()[0].cause,
            "frozen (SIGSTOP) and never thawed"
        );
        assert_eq!(watch(&[frozen.clone(), thawed]).losses(), 0);
        assert_eq!(watch(&[frozen, lost(AGENT, ProcessEnd::Killed(9))]).losses(), 1);
    }

    #[test]
    fn processes_that_stay_frozen_are_listed_after_the_losses_as_far_as_there_is_room() {
        let mut events = vec![lost(AGENT, ProcessEnd::Killed(9)); LISTED - 2];
        events.extend((1..=3).map(|uav| Event::ProcessFrozen { part: Part::Agent(UavId(uav)) }));
        let watch = watch(&events);
        let listed = watch.listed_losses();
        assert_eq!((watch.losses(), listed.len()), (LISTED as u64 + 1, LISTED));
        assert_eq!(
            (listed[LISTED - 2].process.as_str(), listed[LISTED - 1].process.as_str()),
            ("uav 1", "uav 2")
        );
    }

    #[test]
    fn what_the_scenario_asks_for_is_neither_a_loss_nor_chance() {
        let action = ProcessAction::Kill { returns: false };
        let watch = watch(&[Event::ProcessFault { part: AGENT, action, sentence: "kill uav 3".into() }]);
        assert_eq!((watch.losses(), watch.chances(), watch.broke_lockstep()), (0, 0, None));
    }

    #[test]
    fn a_flight_that_did_not_wait_has_broken_lockstep() {
        let silent = Event::ProcessSilent { part: AGENT, waited_s: 2.0 };
        let watch = watch(&[Event::FaultRequested { sentence: "at 1 s kill uav 3".into() }, silent]);
        let broke = watch.broke_lockstep().unwrap();
        assert_eq!(broke.time_s, 2.0);
        assert!(broke.what.starts_with("uav 3 has not answered for 2.0 s; flying on"), "{}", broke.what);
        assert_eq!((watch.chances(), watch.listed_chances()[0].time_s), (1, 2.0), "a request is no chance");
    }

    #[test]
    fn a_flight_in_real_time_depends_on_chance_and_has_no_lockstep_to_break() {
        let mut scenario = testing::ring_of(6, 40.0);
        scenario.time.real_time = true;
        let mut watch = ChanceWatch::new(&scenario);
        assert_eq!(watch.chances(), 1);
        watch.on_event(&TimedEvent { tick: Tick(1), event: Event::FaultOverdue });
        assert_eq!((watch.chances(), watch.broke_lockstep()), (2, None));
    }

    #[test]
    fn many_losses_are_counted_and_the_first_are_listed() {
        let watch = watch(&vec![lost(AGENT, ProcessEnd::Killed(9)); 300]);
        assert_eq!((watch.losses(), watch.listed_losses().len()), (300, LISTED));
        assert_eq!((watch.chances(), watch.listed_chances().len()), (300, LISTED));
    }
}
