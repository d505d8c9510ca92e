//! Follows what is wrong with processes, airframes and links, from events and from flight modes: `/faults`.
//!
//! Never guesses a cause: it names the processes that are lost or frozen, and the UAVs that are in their failsafe or have
//! collided.

use crate::{
    metrics::{Frame, TrueState},
    schema::Faults,
};
use ringwing_flight::{Collider, Event, Part, ProcessAction, UavId};
use std::collections::BTreeSet;

/// Processes that share a fault; a UAV is named by its agent. UAVs come last, by ascending number.
type Parts = BTreeSet<Part>;

/// Follows the faults.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct FaultWatch {
    now: CurrentFaults,
    /// Whether each UAV was ever in the sky, UAV 1 first.
    seen: Vec<bool>,
}

/// The faults in force at a moment.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct CurrentFaults {
    /// Ended, and not replaced yet.
    lost: Parts,
    /// Stopped by SIGSTOP.
    frozen: Parts,
    /// Airframes controlled by their failsafe, or vanished.
    failsafe: Parts,
    /// UAVs that ever collided.
    collided: Parts,
    /// The sentences of link faults and delayed answers in force.
    asked: BTreeSet<String>,
}

/// The condition of a UAV, the mildest first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Condition {
    /// Nothing is wrong.
    Sound,
    /// The agent is lost or frozen, but the failsafe has not taken over yet.
    Lost,
    /// The failsafe has taken over.
    Failsafe,
    /// It collided with a UAV or an obstacle.
    Collided,
}

impl FaultWatch {
    /// Updates the faults by an event.
    pub(crate) fn on_event(&mut self, event: &Event) {
        self.now.on_event(event);
    }

    /// Updates the failsafes by the flight modes in `frame`.
    pub(crate) fn observe(&mut self, frame: &Frame) {
        self.seen.resize(frame.uavs.len(), false);
        for (number, (seen, now)) in (1..).zip(self.seen.iter_mut().zip(&frame.uavs)) {
            let agent = Part::Agent(UavId(number));
            let is_commanded = now.state.as_ref().map(TrueState::is_commanded);
            *seen |= is_commanded.is_some();
            // A UAV that left the sky has vanished by its failsafe; one that was never there has not started yet.
            if is_commanded.unwrap_or(!*seen) {
                self.now.failsafe.remove(&agent);
            } else {
                self.now.failsafe.insert(agent);
            }
        }
    }

    /// The faults in force.
    pub(crate) fn now(&self) -> &CurrentFaults {
        &self.now
    }
}

impl CurrentFaults {
    fn on_event(&mut self, event: &Event) {
        use ProcessAction::{Freeze, Kill, Start, Stop, Thaw};
        match event {
            // The launcher reports an end that was requested as a fault, and any other as a loss.
            Event::ProcessLost { part, .. }
            | Event::ProcessFault { part, action: Kill { .. } | Stop, .. } => {
                // A killed process needs no thaw: it is no longer frozen.
                self.frozen.remove(part);
                self.lost.insert(*part);
            }
            Event::ProcessReady { part } | Event::ProcessFault { part, action: Start, .. } => {
                self.frozen.remove(part);
                self.lost.remove(part);
            }
            Event::ProcessFrozen { part } | Event::ProcessFault { part, action: Freeze, .. } => {
                self.frozen.insert(*part);
            }
            Event::ProcessThawed { part } | Event::ProcessFault { part, action: Thaw, .. } => {
                self.frozen.remove(part);
            }
            Event::LinkFault { sentence }
            | Event::SlowFault { sentence }
            | Event::AirframeFault { sentence } => {
                self.asked.insert(sentence.clone());
            }
            Event::FaultHealed { sentence } => {
                self.asked.remove(sentence);
            }
            Event::Collision { uav, with, .. } => {
                self.collided.insert(Part::Agent(*uav));
                if let Collider::Uav(other) = with {
                    self.collided.insert(Part::Agent(*other));
                }
            }
            _ => {}
        }
    }

    /// The condition of UAV number `uav`: the worst that applies.
    pub(crate) fn condition(&self, uav: u32) -> Condition {
        let agent = Part::Agent(UavId(uav));
        if self.collided.contains(&agent) {
            Condition::Collided
        } else if self.failsafe.contains(&agent) {
            Condition::Failsafe
        } else if self.lost.contains(&agent) || self.frozen.contains(&agent) {
            Condition::Lost
        } else {
            Condition::Sound
        }
    }

    /// The faults in force at `tick`, as the log has them.
    pub(crate) fn message(&self, tick: i64) -> Faults {
        Faults {
            tick,
            lost: self.lost.len() as u32,
            frozen: self.frozen.len() as u32,
            failsafe: self.failsafe.len() as u32,
            collided: self.collided.len() as u32,
            summary: self.summary(),
            lost_names: texts(&self.lost),
            frozen_names: texts(&self.frozen),
            failsafe_names: texts(&self.failsafe),
            collided_names: texts(&self.collided),
            asked: self.asked.len() as u32,
            asked_sentences: self.asked.iter().cloned().collect(),
        }
    }

    /// All faults in one line; `none` if nothing is wrong.
    fn summary(&self) -> String {
        let kinds = [
            ("lost", &self.lost),
            ("frozen", &self.frozen),
            ("in failsafe", &self.failsafe),
            ("collided", &self.collided),
        ];
        let wrong = kinds.iter().filter(|(_, names)| !names.is_empty());
        let mut parts: Vec<_> =
            wrong.map(|(kind, names)| format!("{kind}: {}", texts(names).join(", "))).collect();
        parts.extend(self.asked.iter().cloned());
        if parts.is_empty() { "none".into() } else { parts.join("; ") }
    }
}

fn texts(parts: &Parts) -> Vec<String> {
    parts.iter().map(Part::to_string).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{schema::EventWriter, testing};
    use ringwing_flight::{AfterLoss, FlightMode, ProcessEnd, Tick, TimedEvent};
    use ringwing_scenario::ObstacleSection;

    const LEADER: Part = Part::Leader;

    fn agent(number: u32) -> Part {
        Part::Agent(UavId(number))
    }

    fn fault(part: Part, action: ProcessAction) -> Event {
        Event::ProcessFault { part, action, sentence: String::new() }
    }

    fn hit(uav: u32, with: Collider) -> Event {
        Event::Collision { uav: UavId(uav), with, position_m: [1.0, -2.0] }
    }

    fn watch(events: &[Event]) -> FaultWatch {
        let mut watch = FaultWatch::default();
        for event in events {
            watch.on_event(event);
        }
        watch
    }

    #[test]
    fn a_process_is_named_until_its_fault_is_over() {
        let (end, then) = (ProcessEnd::Killed(9), AfterLoss::Replaced);
        let mut watch =
            watch(&[Event::ProcessFrozen { part: agent(2) }, Event::ProcessLost { part: LEADER, end, then }]);
        assert_eq!(watch.now().message(3).summary, "lost: leader; frozen: uav 2");
        assert_eq!(watch.now().condition(2), Condition::Lost);
        watch.on_event(&Event::ProcessThawed { part: agent(2) });
        watch.on_event(&Event::ProcessReady { part: LEADER });
        assert_eq!(watch, FaultWatch::default());
        assert_eq!(watch.now().message(0).summary, "none");
    }

    #[test]
    fn a_requested_fault_is_in_force_until_it_is_healed() {
        let sentence = || "link 2->3 hold".to_owned();
        let mut watch = watch(&[
            fault(agent(3), ProcessAction::Kill { returns: true }),
            Event::LinkFault { sentence: sentence() },
        ]);
        assert_eq!(watch.now().message(0).summary, "lost: uav 3; link 2->3 hold");
        watch.on_event(&Event::FaultHealed { sentence: sentence() });
        watch.on_event(&fault(agent(3), ProcessAction::Start));
        assert_eq!(watch, FaultWatch::default());
    }

    #[test]
    fn both_uavs_of_a_collision_stay_collided() {
        let watch = watch(&[hit(9, Collider::Uav(UavId(10))), hit(3, Collider::Obstacle(0))]);
        assert_eq!(watch.now().message(0).collided_names, ["uav 3", "uav 9", "uav 10"]);
        assert_eq!(
            (watch.now().condition(9), watch.now().condition(1)),
            (Condition::Collided, Condition::Sound)
        );
    }

    #[test]
    fn an_obstacle_named_like_a_uav_does_not_mark_that_uav_as_collided() {
        let mut scenario = testing::ring_of(3, 40.0);
        scenario.obstacles = vec![ObstacleSection { name: "uav 2".into(), ..testing::obstacle([0.0, 0.0]) }];
        let event = TimedEvent { tick: Tick(0), event: hit(1, Collider::Obstacle(0)) };
        let message = EventWriter::new(&scenario).message(&event);
        assert_eq!(message.text, "uav 1 and uav 2 at (1.0, -2.0) m");
        let watch = watch(&[message.event().unwrap().event]);
        assert_eq!(watch.now().message(0).collided_names, ["uav 1"]);
        assert_eq!(watch.now().condition(2), Condition::Sound);
    }

    #[test]
    fn a_uav_that_loiters_or_left_the_sky_is_in_its_failsafe() {
        let scenario = testing::ring_of(3, 40.0);
        let mut watch = FaultWatch::default();
        let mut frame = testing::at_rest(&scenario, 0);
        frame.uavs[2].state = None;
        watch.observe(&frame);
        assert_eq!(watch.now().message(0).failsafe, 0, "a UAV that never started is not in its failsafe");
        frame.uavs[0].state.as_mut().unwrap().mode = FlightMode::LOITER;
        frame.uavs[1].state = None;
        watch.observe(&frame);
        assert_eq!(watch.now().message(1).failsafe_names, ["uav 1", "uav 2"]);
    }
}
