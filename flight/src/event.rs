//! What happens once and a person wants to read about: losses, faults, collisions.
//!
//! An event says who, with whom, where and which fault as data. Never as a sentence: whoever shows an event makes the
//! text, and whoever acts on one reads its fields.

use crate::{FlightMode, Part, Tick, UavId};
use serde::{Deserialize, Serialize};
use std::fmt;

/// How much an event matters; the names are those of the log's viewers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Level {
    /// As planned.
    Info,
    /// The run survives it.
    Warning,
    /// Something that should not happen did: a collision, a lost process.
    Error,
}

/// What a UAV ran into.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Collider {
    /// Another UAV.
    Uav(UavId),
    /// The scenario's obstacle with this index, from 0.
    Obstacle(u32),
}

/// How a process ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ProcessEnd {
    /// It exited with this status.
    Exited(i32),
    /// This signal killed it.
    Killed(i32),
    /// It was not a child of the launcher: its end was seen, but not how it came.
    Unknown,
}

impl ProcessEnd {
    /// Whether it gave up with an error, which a successor would run into as well.
    pub fn is_failure(self) -> bool {
        matches!(self, Self::Exited(status) if status != 0)
    }
}

impl fmt::Display for ProcessEnd {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Exited(0) => f.write_str("has left"),
            Self::Exited(status) => write!(f, "gave up (exit status {status})"),
            Self::Killed(signal) => write!(f, "was killed by signal {signal}"),
            Self::Unknown => f.write_str("has ended"),
        }
    }
}

/// What the launcher does about a lost process.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum AfterLoss {
    /// A new process takes over.
    Replaced,
    /// The UAV's airframe goes into its failsafe.
    Failsafe {
        /// The agent was lost before it was ready to fly.
        before_flight: bool,
    },
}

/// What a process fault does to its target.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ProcessAction {
    /// SIGKILL.
    Kill {
        /// A new process is started later.
        returns: bool,
    },
    /// SIGTERM.
    Stop,
    /// SIGSTOP.
    Freeze,
    /// SIGCONT.
    Thaw,
    /// A new process.
    Start,
}

/// What happened.
///
/// Faults are named by the sentence that asked for them, as the scenario or `ringwing fault` has it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Event {
    /// A UAV ran into something.
    Collision {
        /// The UAV; the one with the lower number if two met.
        uav: UavId,
        /// What it met.
        with: Collider,
        /// Where the UAV was, in the local frame.
        position_m: [f64; 2],
    },
    /// An agent was silent for too long, and its airframe's failsafe took over.
    Failsafe {
        /// The UAV.
        uav: UavId,
        /// What the failsafe does.
        mode: FlightMode,
    },
    /// A process ended, and nobody had asked for that.
    ProcessLost {
        /// Which.
        part: Part,
        /// How it ended.
        end: ProcessEnd,
        /// What the launcher does about it.
        then: AfterLoss,
    },
    /// A process that was not there before is ready.
    ProcessReady {
        /// Which.
        part: Part,
    },
    /// A process was stopped (SIGSTOP), and nobody had asked for that.
    ProcessFrozen {
        /// Which.
        part: Part,
    },
    /// A stopped process goes on (SIGCONT), and nobody had asked for that.
    ProcessThawed {
        /// Which.
        part: Part,
    },
    /// A process was killed because it did not become ready in time.
    StartOverdue {
        /// Which.
        part: Part,
    },
    /// A process was killed because it stayed frozen and the flight cannot do without it.
    ThawOverdue {
        /// Which.
        part: Part,
    },
    /// A process did not answer its tick in time; the flight goes on without it.
    ProcessSilent {
        /// Which.
        part: Part,
        /// How long the world waited.
        waited_s: f64,
    },
    /// The replacement of a lost process was not ready in time; the flight goes on without it.
    ReplacementOverdue,
    /// The recorder stopped reading; the flight goes on.
    RecorderSilent,
    /// Ticks are missing from the log.
    RecorderGap {
        /// The first of them.
        first_tick: Tick,
        /// The last.
        last_tick: Tick,
        /// Why.
        cause: GapCause,
    },
    /// Connections between processes failed, most often for lack of file descriptors.
    ConnectionsFailed {
        /// How many of the world's so far.
        count: u64,
    },
    /// The user asked the run to end.
    RunInterrupted,
    /// A process fault was applied.
    ProcessFault {
        /// To which process.
        part: Part,
        /// What was done.
        action: ProcessAction,
        /// The sentence that asked for it.
        sentence: String,
    },
    /// A fault could not be applied.
    FaultRefused {
        /// Which process it was meant for, if it names one.
        part: Option<Part>,
        /// Why.
        why: String,
        /// The sentence that asked for it.
        sentence: String,
    },
    /// Somebody asked a live run for a fault.
    FaultRequested {
        /// The sentence, with its time.
        sentence: String,
    },
    /// The launcher did not report a fault as applied in time; the flight goes on.
    FaultOverdue,
    /// A link fault begins.
    LinkFault {
        /// The sentence that asked for it.
        sentence: String,
    },
    /// A process begins to answer late.
    SlowFault {
        /// The sentence that asked for it.
        sentence: String,
    },
    /// A link fault or a delay of answers ends.
    FaultHealed {
        /// The sentence that asked for the fault.
        sentence: String,
    },
}

/// Why ticks are missing from the log.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum GapCause {
    /// The recorder started late.
    StartedLate,
    /// They were lost with a recorder that died.
    LostWithPredecessor,
    /// The recorder fell behind.
    FellBehind,
}

impl Event {
    /// The kind of event, as the log names it: `collision`, `process.lost`, `fault.kill`.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Collision { .. } => "collision",
            Self::Failsafe { .. } => "failsafe",
            Self::ProcessLost { .. } => "process.lost",
            Self::ProcessReady { .. } => "process.ready",
            Self::ProcessFrozen { .. } => "process.frozen",
            Self::ProcessThawed { .. } => "process.thawed",
            Self::StartOverdue { .. } | Self::ThawOverdue { .. } => "process.overdue",
            Self::ProcessSilent { .. } | Self::ReplacementOverdue => "process.silent",
            Self::RecorderSilent => "recorder.silent",
            Self::RecorderGap { .. } => "recorder.gap",
            Self::ConnectionsFailed { .. } => "ipc.connection",
            Self::RunInterrupted => "run.interrupted",
            Self::ProcessFault { action, .. } => action.event_name(),
            Self::FaultRefused { .. } => "fault.refused",
            Self::FaultRequested { .. } => "fault.requested",
            Self::FaultOverdue => "fault.overdue",
            Self::LinkFault { .. } => "fault.link",
            Self::SlowFault { .. } => "fault.slow",
            Self::FaultHealed { .. } => "fault.healed",
        }
    }

    /// How much it matters.
    pub fn level(&self) -> Level {
        match self {
            Self::Collision { .. }
            | Self::ProcessLost { .. }
            | Self::StartOverdue { .. }
            | Self::ThawOverdue { .. }
            | Self::ConnectionsFailed { .. } => Level::Error,
            Self::ProcessReady { .. }
            | Self::ProcessThawed { .. }
            | Self::ProcessFault { action: ProcessAction::Thaw | ProcessAction::Start, .. }
            | Self::FaultRequested { .. }
            | Self::LinkFault { .. }
            | Self::SlowFault { .. }
            | Self::FaultHealed { .. } => Level::Info,
            Self::Failsafe { .. }
            | Self::ProcessFrozen { .. }
            | Self::ProcessSilent { .. }
            | Self::ReplacementOverdue
            | Self::RecorderSilent
            | Self::RecorderGap { .. }
            | Self::RunInterrupted
            | Self::ProcessFault { .. }
            | Self::FaultRefused { .. }
            | Self::FaultOverdue => Level::Warning,
        }
    }

    /// Whether scheduling or somebody outside the run decided that, or when, it happened: such a flight cannot be
    /// repeated to the bit.
    ///
    /// The recorder's own troubles do not count: it never changes the flight.
    pub fn is_by_chance(&self) -> bool {
        match self {
            Self::ProcessLost { part, .. }
            | Self::ProcessFrozen { part }
            | Self::ProcessThawed { part }
            | Self::StartOverdue { part }
            | Self::ThawOverdue { part }
            | Self::ProcessSilent { part, .. } => *part != Part::Recorder,
            Self::ReplacementOverdue
            | Self::FaultOverdue
            | Self::ConnectionsFailed { .. }
            | Self::RunInterrupted
            | Self::FaultRequested { .. } => true,
            Self::Collision { .. }
            | Self::Failsafe { .. }
            | Self::ProcessReady { .. }
            | Self::RecorderSilent
            | Self::RecorderGap { .. }
            | Self::ProcessFault { .. }
            | Self::FaultRefused { .. }
            | Self::LinkFault { .. }
            | Self::SlowFault { .. }
            | Self::FaultHealed { .. } => false,
        }
    }

    /// Whether it is a fault that the formation may feel: what recovery is measured from.
    pub fn is_disturbance(&self) -> bool {
        matches!(
            self,
            Self::ProcessFault { .. }
                | Self::LinkFault { .. }
                | Self::SlowFault { .. }
                | Self::ProcessLost { .. }
                | Self::ProcessFrozen { .. }
        )
    }
}

impl Event {
    /// The text of unbounded length that it carries, if any.
    pub(crate) fn sentence_mut(&mut self) -> Option<&mut String> {
        match self {
            Self::ProcessFault { sentence, .. }
            | Self::FaultRefused { sentence, .. }
            | Self::FaultRequested { sentence }
            | Self::LinkFault { sentence }
            | Self::SlowFault { sentence }
            | Self::FaultHealed { sentence } => Some(sentence),
            _ => None,
        }
    }
}

impl ProcessAction {
    fn event_name(self) -> &'static str {
        match self {
            Self::Kill { .. } => "fault.kill",
            Self::Stop => "fault.stop",
            Self::Freeze => "fault.freeze",
            Self::Thaw => "fault.thaw",
            Self::Start => "fault.start",
        }
    }
}

/// An event and its moment in simulated time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TimedEvent {
    /// When.
    pub tick: Tick,
    /// What.
    #[serde(flatten)]
    pub event: Event,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lost_recorder_does_not_spoil_a_flight_and_a_lost_agent_does() {
        let lost = |part| Event::ProcessLost { part, end: ProcessEnd::Killed(9), then: AfterLoss::Replaced };
        assert!(!lost(Part::Recorder).is_by_chance());
        assert!(lost(Part::Agent(UavId(3))).is_by_chance() && lost(Part::Leader).is_by_chance());
    }

    #[test]
    fn an_asked_kill_is_a_disturbance_and_not_by_chance() {
        let kill = Event::ProcessFault {
            part: Part::Agent(UavId(3)),
            action: ProcessAction::Kill { returns: false },
            sentence: "kill uav 3".into(),
        };
        assert!(kill.is_disturbance() && !kill.is_by_chance());
        assert_eq!((kill.name(), kill.level()), ("fault.kill", Level::Warning));
    }
}
