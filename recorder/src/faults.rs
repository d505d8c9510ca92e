//! What is wrong at the moment, from what was told and who flies: `/faults`, written when it changes and each second.
//!
//! Never guesses at a cause: names those that are lost, frozen, in their failsafe, or have collided.

use crate::frame::Frame;
use foxglove::messages::Log as Line;
use ringwing_flight::FlightMode;
use std::collections::BTreeSet;

/// Everything that is wrong, on change and each second: `/faults`.
#[derive(Clone, PartialEq, foxglove::Encode, prost::Message)]
pub struct Faults {
    /// The tick from which on this is so.
    #[prost(sint64, tag = "1")]
    pub tick: i64,
    /// Processes that are gone and not replaced.
    #[prost(uint32, tag = "2")]
    pub lost: u32,
    /// Processes that are stopped.
    #[prost(uint32, tag = "3")]
    pub frozen: u32,
    /// Airframes that fly, or flew out of the sky, without their agent.
    #[prost(uint32, tag = "4")]
    pub failsafe: u32,
    /// UAVs that ever ran into something.
    #[prost(uint32, tag = "5")]
    pub collided: u32,
    /// All of it in one line; `none` when nothing is wrong.
    #[prost(string, tag = "6")]
    pub summary: String,
    /// Who is lost.
    #[prost(string, repeated, tag = "7")]
    pub lost_names: Vec<String>,
    /// Who is frozen.
    #[prost(string, repeated, tag = "8")]
    pub frozen_names: Vec<String>,
    /// Who is in its failsafe.
    #[prost(string, repeated, tag = "9")]
    pub failsafe_names: Vec<String>,
    /// Who has collided.
    #[prost(string, repeated, tag = "10")]
    pub collided_names: Vec<String>,
    /// Faults in force that somebody asked for: of links, and of processes that answer late.
    #[prost(uint32, tag = "11")]
    pub asked: u32,
    /// Each as the sentence that asked for it.
    #[prost(string, repeated, tag = "12")]
    pub asked_sentences: Vec<String>,
}

/// Whether `line` tells of something that goes wrong, and may be felt by the formation.
pub(crate) fn is_fault(line: &Line) -> bool {
    let kinds = ["kill", "stop", "freeze", "thaw", "start", "link", "slow"];
    let asked = line.name.strip_prefix("fault.").is_some_and(|kind| kinds.contains(&kind));
    asked || matches!(line.name.as_str(), "process.lost" | "process.frozen")
}

/// Who is wrong in one way.
type Names = BTreeSet<Name>;

/// Who it is; UAVs come in the order of their numbers, other processes before them.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
enum Name {
    Process(String),
    Uav(u32),
}

/// Follows what goes wrong and what comes right again.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct FaultWatch {
    lost: Names,
    frozen: Names,
    failsafe: Names,
    collided: Names,
    /// What is wrong with links and slow processes because somebody asked for it.
    asked: BTreeSet<String>,
    /// Who was ever in the sky, UAV 1 first.
    seen: Vec<bool>,
}

/// How a UAV is doing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Condition {
    /// As it should.
    Sound,
    /// Its agent is gone or stopped, and its airframe has not noticed yet.
    Lost,
    /// Without its agent.
    Failsafe,
    /// Has run into something.
    Collided,
}

impl FaultWatch {
    /// Takes what was told.
    pub(crate) fn hear(&mut self, line: &Line) {
        match line.name.as_str() {
            "process.lost" | "fault.kill" | "fault.stop" => {
                let name = Name::first_in(&line.message);
                self.frozen.remove(&name);
                self.lost.insert(name);
            }
            "process.ready" | "fault.start" => {
                let name = Name::first_in(&line.message);
                self.frozen.remove(&name);
                self.lost.remove(&name);
            }
            "process.frozen" | "fault.freeze" => {
                self.frozen.insert(Name::first_in(&line.message));
            }
            "process.thawed" | "fault.thaw" => {
                self.frozen.remove(&Name::first_in(&line.message));
            }
            "fault.link" | "fault.slow" => {
                self.asked.insert(line.message.clone());
            }
            "fault.healed" => {
                self.asked.remove(&line.message);
            }
            "collision" => {
                let who = line.message.split(" at (").next().unwrap_or_default().split(" and ");
                self.collided.extend(who.map(Name::first_in).filter(|name| matches!(name, Name::Uav(_))));
            }
            _ => {}
        }
    }

    /// Takes who flies and how; a torn frame does not know.
    pub(crate) fn observe(&mut self, frame: &Frame) {
        if frame.torn {
            return;
        }
        self.seen.resize(frame.uavs.len(), false);
        for (uav, (seen, now)) in (1..).zip(self.seen.iter_mut().zip(&frame.uavs)) {
            let is_commanded = now.state.as_ref().map(|state| state.mode == FlightMode::COMMANDED.name());
            *seen |= is_commanded.is_some();
            if is_commanded.unwrap_or(!*seen) {
                self.failsafe.remove(&Name::Uav(uav));
            } else {
                self.failsafe.insert(Name::Uav(uav));
            }
        }
    }

    /// How UAV number `uav` is doing; the worst counts.
    pub(crate) fn condition(&self, uav: u32) -> Condition {
        let name = Name::Uav(uav);
        if self.collided.contains(&name) {
            Condition::Collided
        } else if self.failsafe.contains(&name) {
            Condition::Failsafe
        } else if self.lost.contains(&name) || self.frozen.contains(&name) {
            Condition::Lost
        } else {
            Condition::Sound
        }
    }

    /// All of it, as of `tick`.
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

fn texts(names: &Names) -> Vec<String> {
    names.iter().map(Name::text).collect()
}

impl Name {
    /// Who a line begins with: `uav 3 was killed ...`, `the leader exited ...`.
    fn first_in(text: &str) -> Self {
        let text = text.strip_prefix("the ").unwrap_or(text);
        let mut words = text.split_whitespace();
        let first = words.next().unwrap_or_default();
        match words.next().and_then(|number| number.parse().ok()) {
            Some(number) if first == "uav" => Self::Uav(number),
            _ => Self::Process(first.into()),
        }
    }

    fn text(&self) -> String {
        match self {
            Self::Process(name) => name.clone(),
            Self::Uav(number) => format!("uav {number}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing;

    fn hear(watch: &mut FaultWatch, name: &str, message: &str) {
        watch.hear(&Line { name: name.into(), message: message.into(), ..Line::default() });
    }

    #[test]
    fn what_goes_wrong_is_named_until_it_is_right_again() {
        let mut watch = FaultWatch::default();
        assert_eq!(watch.message(0).summary, "none");
        hear(&mut watch, "process.frozen", "uav 2 is frozen (SIGSTOP)");
        hear(&mut watch, "process.lost", "the leader was killed (SIGKILL); a new one takes over");
        assert_eq!(watch.message(3).summary, "lost: leader; frozen: uav 2");
        assert_eq!(watch.condition(2), Condition::Lost);
        hear(&mut watch, "process.thawed", "uav 2 goes on (SIGCONT)");
        hear(&mut watch, "process.ready", "leader is ready");
        assert_eq!(watch, FaultWatch::default());
    }

    #[test]
    fn what_somebody_asked_for_is_in_force_until_it_is_healed() {
        let mut watch = FaultWatch::default();
        hear(&mut watch, "fault.kill", "uav 3 is killed: kill uav 3");
        hear(&mut watch, "fault.link", "link 2->3 hold");
        assert_eq!(watch.message(0).summary, "lost: uav 3; link 2->3 hold");
        hear(&mut watch, "fault.healed", "link 2->3 hold");
        hear(&mut watch, "fault.start", "uav 3 is started: restart uav 3 after 5 s");
        assert_eq!(watch, FaultWatch::default());
    }

    #[test]
    fn a_collision_stays_and_an_obstacle_is_no_uav() {
        let mut watch = FaultWatch::default();
        hear(&mut watch, "collision", "uav 10 and uav 9 at (1.0, -2.0) m");
        hear(&mut watch, "collision", "uav 3 and Obstacle 1 at (1.0, -2.0) m");
        assert_eq!(watch.message(0).collided_names, ["uav 3", "uav 9", "uav 10"]);
        assert_eq!((watch.condition(9), watch.condition(1)), (Condition::Collided, Condition::Sound));
    }

    #[test]
    fn who_loiters_or_has_left_the_sky_is_in_its_failsafe() {
        let scenario = testing::ring_of(3, 40.0);
        let mut watch = FaultWatch::default();
        let mut frame = testing::at_rest(&scenario, 0);
        frame.uavs[2].state = None;
        watch.observe(&frame);
        assert_eq!(watch.message(0).failsafe, 0, "one that never came is not in its failsafe");
        frame.uavs[0].state.as_mut().unwrap().mode = "loiter".into();
        frame.uavs[1].state = None;
        watch.observe(&Frame { torn: true, ..frame.clone() });
        assert_eq!(watch.message(1).failsafe, 0);
        watch.observe(&frame);
        assert_eq!(watch.message(1).failsafe_names, ["uav 1", "uav 2"]);
    }
}
