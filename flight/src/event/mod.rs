//! Events: what happens in a run and is worth reading about, such as losses, faults and collisions.
//!
//! An event is data: who, who else, where, and which fault. It must never carry a sentence that another process has to
//! parse. Code that acts on an event reads its fields; code that shows one calls [`Event::text`].

mod reporter;
mod text;

pub use reporter::Reporter;

use crate::{FlightMode, IntruderId, NoteRefusal, Part, Tick, UavId};
use serde::{Deserialize, Serialize};

/// How much an event matters, in the terms of log viewers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Level {
    /// The run goes as planned.
    Info,
    /// Something is wrong; the flight goes on.
    Warning,
    /// Something happened that must not happen in a good run: a collision, a lost process.
    Error,
}

/// What a UAV collided with.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Collider {
    /// Another UAV.
    Uav(UavId),
    /// The scenario's obstacle with this index, counted from 0.
    Obstacle(u32),
    /// An aircraft that nobody controls.
    Intruder(IntruderId),
}

/// How a process ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ProcessEnd {
    /// It exited with this status.
    Exited(i32),
    /// This signal killed it.
    Killed(i32),
    /// Somebody started it by hand, so the launcher is not its parent and cannot learn its exit status.
    Unknown,
}

impl ProcessEnd {
    /// Whether the process gave up with an error. A successor would run into the same error.
    pub fn is_failure(self) -> bool {
        matches!(self, Self::Exited(status) if status != 0)
    }
}

/// What the launcher does about a lost process.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum AfterLoss {
    /// It starts a new process in the same place.
    Replaced,
    /// It starts nothing; the UAV's airframe goes into its failsafe.
    Failsafe {
        /// Whether the agent was lost before it was ready to fly.
        before_flight: bool,
    },
    /// It ends the run, which cannot go on without this process.
    RunEnds,
}

/// What a process fault does to its target.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ProcessAction {
    /// Sends SIGKILL.
    Kill {
        /// Whether the same fault starts a new process later.
        returns: bool,
    },
    /// Sends SIGTERM.
    Stop,
    /// Sends SIGSTOP.
    Freeze,
    /// Sends SIGCONT.
    Thaw,
    /// Starts a new process.
    Start,
}

/// Why ticks are missing from the log.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum GapCause {
    /// The flight began before the recorder listened.
    StartedLate,
    /// An earlier recorder died before it wrote them.
    LostWithPredecessor,
    /// The recorder read more slowly than the swarm flew.
    FellBehind,
}

/// Something that happened in a run.
///
/// A fault's `sentence` is the one that asked for it, in the grammar of the scenario file and of `ringwing fault`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Event {
    /// A UAV collided with something.
    Collision {
        /// The UAV; if two UAVs collided, the one with the lower number.
        uav: UavId,
        /// What it collided with.
        with: Collider,
        /// Where the UAV was, in the local frame.
        position_m: [f64; 2],
    },
    /// A UAV has passed another aircraft at a small distance, and both are farther apart again, or the flight is over.
    NearMiss {
        /// The UAV; of two UAVs, the one with the lower number.
        uav: UavId,
        /// The other aircraft.
        with: Collider,
        /// Their smallest distance.
        distance_m: f64,
        /// Where the UAV was then, in the local frame.
        position_m: [f64; 2],
        /// When that was.
        closest: Tick,
    },
    /// An agent was silent for too long, so its airframe's failsafe took over.
    Failsafe {
        /// The UAV.
        uav: UavId,
        /// What the failsafe does.
        mode: FlightMode,
    },
    /// The controller of a UAV wished for a speed or turn rate that is not a finite number, for the first time in the flight.
    /// Its agent withholds such a command.
    WishNotFinite {
        /// The UAV.
        uav: UavId,
    },
    /// The controller of a UAV made a note that cannot be recorded, for the first time in the flight for this reason.
    NoteRefused {
        /// The UAV.
        uav: UavId,
        /// The beginning of the note's name.
        name: String,
        /// Why the note cannot be recorded.
        why: NoteRefusal,
    },
    /// A process ended, and no fault of the run had asked for that.
    ProcessLost {
        /// The process.
        part: Part,
        /// How it ended.
        end: ProcessEnd,
        /// What the launcher does about it.
        then: AfterLoss,
    },
    /// A process joined during the flight, and no fault of the run had asked for that.
    ProcessReady {
        /// The process.
        part: Part,
    },
    /// A process was frozen (SIGSTOP), and no fault of the run had asked for that.
    ProcessFrozen {
        /// The process.
        part: Part,
    },
    /// A frozen process was thawed (SIGCONT), and no fault of the run had asked for that.
    ProcessThawed {
        /// The process.
        part: Part,
    },
    /// The launcher killed a process because it did not become ready in time.
    StartOverdue {
        /// The process.
        part: Part,
    },
    /// The launcher killed a process because it stayed frozen and the flight cannot go on without it.
    ThawOverdue {
        /// The process.
        part: Part,
    },
    /// A process did not answer its tick in time; the flight goes on without it.
    ProcessSilent {
        /// The process.
        part: Part,
        /// How long the world waited for it, by the wall clock.
        waited_s: f64,
    },
    /// The replacement of a lost process was not ready in time; the flight goes on without it.
    ReplacementOverdue,
    /// The recorder stopped reading; the flight goes on, and the log will have a gap.
    RecorderSilent,
    /// Ticks are missing from the log.
    RecorderGap {
        /// The first missing tick.
        first_tick: Tick,
        /// The last missing tick.
        last_tick: Tick,
        /// Why they are missing.
        cause: GapCause,
    },
    /// The world could not connect to another process, most often because it ran out of file descriptors.
    ConnectionsFailed {
        /// How many of the world's connections have failed in this run.
        count: u64,
    },
    /// The user interrupted the run.
    RunInterrupted,
    /// The run stood still in real time, all its processes stopped.
    RunPaused {
        /// For how long, by the wall clock.
        seconds: f64,
    },
    /// The launcher applied a process fault.
    ProcessFault {
        /// The process.
        part: Part,
        /// What the launcher did to it.
        action: ProcessAction,
        /// The sentence that asked for it.
        sentence: String,
    },
    /// The launcher could not apply a fault.
    FaultRefused {
        /// The process that the fault was meant for; `None` if the refusal concerns the sentence as a whole.
        part: Option<Part>,
        /// Why not; a predicate of `part` where there is one, such as "is not frozen".
        why: String,
        /// The sentence that asked for it.
        sentence: String,
    },
    /// Somebody asked the live run for a fault.
    FaultRequested {
        /// The sentence, with its time.
        sentence: String,
    },
    /// The launcher did not report a fault as applied in time; the flight goes on.
    FaultOverdue,
    /// The launcher applied a fault later than asked, in real time. What the fault does later is as much later, so its
    /// duration is the one that was asked for.
    FaultLate {
        /// The process.
        part: Part,
        /// How much later, in seconds of simulated time.
        late_s: f64,
        /// The sentence that asked for the fault.
        sentence: String,
    },
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
    /// An airframe breaks.
    AirframeFault {
        /// The sentence that asked for it.
        sentence: String,
    },
    /// A link fault, a delay of answers or a failure of an airframe ends.
    FaultHealed {
        /// The sentence that asked for the fault.
        sentence: String,
    },
}

impl Event {
    /// The kind of event, as the log names it: `collision`, `process.lost`, `fault.kill`.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Collision { .. } => "collision",
            Self::NearMiss { .. } => "near miss",
            Self::Failsafe { .. } => "failsafe",
            Self::WishNotFinite { .. } => "controller.not_finite",
            Self::NoteRefused { .. } => "controller.note",
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
            Self::RunPaused { .. } => "run.paused",
            Self::ProcessFault { action, .. } => action.event_name(),
            Self::FaultRefused { .. } => "fault.refused",
            Self::FaultRequested { .. } => "fault.requested",
            Self::FaultOverdue => "fault.overdue",
            Self::FaultLate { .. } => "fault.late",
            Self::LinkFault { .. } => "fault.link",
            Self::SlowFault { .. } => "fault.slow",
            Self::AirframeFault { .. } => "fault.airframe",
            Self::FaultHealed { .. } => "fault.healed",
        }
    }

    /// How much it matters.
    pub fn level(&self) -> Level {
        match self {
            Self::Collision { .. }
            | Self::WishNotFinite { .. }
            | Self::ProcessLost { .. }
            | Self::StartOverdue { .. }
            | Self::ThawOverdue { .. }
            | Self::ConnectionsFailed { .. } => Level::Error,
            // A thaw or a start brings a process back. The other process faults take one away, so they are warnings.
            Self::ProcessReady { .. }
            | Self::ProcessThawed { .. }
            | Self::ProcessFault { action: ProcessAction::Thaw | ProcessAction::Start, .. }
            | Self::FaultRequested { .. }
            | Self::LinkFault { .. }
            | Self::SlowFault { .. }
            | Self::AirframeFault { .. }
            | Self::FaultHealed { .. } => Level::Info,
            Self::NearMiss { .. }
            | Self::Failsafe { .. }
            | Self::NoteRefused { .. }
            | Self::ProcessFrozen { .. }
            | Self::ProcessSilent { .. }
            | Self::ReplacementOverdue
            | Self::RecorderSilent
            | Self::RecorderGap { .. }
            | Self::RunInterrupted
            | Self::RunPaused { .. }
            | Self::ProcessFault { .. }
            | Self::FaultRefused { .. }
            | Self::FaultLate { .. }
            | Self::FaultOverdue => Level::Warning,
        }
    }

    /// Who reports it.
    pub fn reporter(&self) -> Reporter {
        match self {
            Self::LinkFault { .. }
            | Self::SlowFault { .. }
            | Self::AirframeFault { .. }
            | Self::FaultHealed { .. } => Reporter::Schedule,
            Self::Collision { .. }
            | Self::NearMiss { .. }
            | Self::Failsafe { .. }
            | Self::WishNotFinite { .. }
            | Self::ProcessSilent { .. }
            | Self::ReplacementOverdue
            | Self::RecorderSilent
            | Self::ConnectionsFailed { .. }
            | Self::FaultOverdue => Reporter::World,
            Self::ProcessLost { .. }
            | Self::ProcessReady { .. }
            | Self::ProcessFrozen { .. }
            | Self::ProcessThawed { .. }
            | Self::StartOverdue { .. }
            | Self::ThawOverdue { .. }
            | Self::RunInterrupted
            | Self::RunPaused { .. }
            | Self::ProcessFault { .. }
            | Self::FaultRefused { .. }
            | Self::FaultLate { .. }
            | Self::FaultRequested { .. } => Reporter::Launcher,
            Self::NoteRefused { .. } | Self::RecorderGap { .. } => Reporter::Recorder,
        }
    }

    /// Whether scheduling or somebody outside the run decided that it happened, or when: then flying the same scenario
    /// again does not give the same payloads.
    ///
    /// False for whatever happens to the recorder alone: it never changes the flight.
    pub fn is_by_chance(&self) -> bool {
        match self {
            Self::ProcessLost { part, .. }
            | Self::ProcessReady { part }
            | Self::ProcessFrozen { part }
            | Self::ProcessThawed { part }
            | Self::StartOverdue { part }
            | Self::ThawOverdue { part }
            | Self::FaultLate { part, .. }
            | Self::ProcessSilent { part, .. } => *part != Part::Recorder,
            // A connection that failed may have cost some receiver its samples.
            Self::ReplacementOverdue
            | Self::FaultOverdue
            | Self::ConnectionsFailed { .. }
            | Self::RunInterrupted
            | Self::RunPaused { .. } => true,
            // The scenario and its seed decide these, or they leave the flight as it is. Somebody chose the moment of a requested
            // fault, but the log and the printed command hold it, so the flight can be repeated.
            Self::Collision { .. }
            | Self::NearMiss { .. }
            | Self::Failsafe { .. }
            | Self::WishNotFinite { .. }
            | Self::NoteRefused { .. }
            | Self::RecorderSilent
            | Self::RecorderGap { .. }
            | Self::ProcessFault { .. }
            | Self::FaultRefused { .. }
            | Self::FaultRequested { .. }
            | Self::LinkFault { .. }
            | Self::SlowFault { .. }
            | Self::AirframeFault { .. }
            | Self::FaultHealed { .. } => false,
        }
    }

    /// Whether chance decided that the log has it: the event [is by chance](Self::is_by_chance), or tells of the recorder.
    ///
    /// What happens to the recorder never changes the flight. But which ticks a dying or slow recorder misses depends on
    /// scheduling, so the log of another flight differs.
    pub fn makes_log_unrepeatable(&self) -> bool {
        let is_about_recorder = match self {
            Self::ProcessLost { part, .. }
            | Self::ProcessReady { part }
            | Self::ProcessFrozen { part }
            | Self::ProcessThawed { part }
            | Self::StartOverdue { part }
            | Self::ThawOverdue { part } => *part == Part::Recorder,
            Self::RecorderSilent | Self::RecorderGap { .. } => true,
            _ => false,
        };
        is_about_recorder || self.is_by_chance()
    }

    /// Whether a lockstep flight went on without something that it should have waited for. Such a flight promises to
    /// be the same every time and is not.
    pub fn breaks_lockstep(&self) -> bool {
        match self {
            Self::ProcessSilent { part, .. } => *part != Part::Recorder,
            Self::ReplacementOverdue | Self::FaultOverdue | Self::ConnectionsFailed { .. } => true,
            _ => false,
        }
    }

    /// Whether it may disturb the formation: the time to recover is measured from here. What happens to the recorder never
    /// does.
    pub fn is_disturbance(&self) -> bool {
        match self {
            Self::ProcessFault { part, .. }
            | Self::ProcessLost { part, .. }
            | Self::ProcessFrozen { part } => *part != Part::Recorder,
            Self::LinkFault { .. } | Self::SlowFault { .. } | Self::AirframeFault { .. } => true,
            _ => false,
        }
    }

    /// The longest text in it, for events that have one. Only texts can be too long for a message.
    pub(crate) fn longest_text_mut(&mut self) -> Option<&mut String> {
        match self {
            Self::FaultRefused { why, sentence, .. } => {
                // A caller cuts until all fits, so the shorter one gets its turn if it becomes the longer.
                Some(if why.len() > sentence.len() { why } else { sentence })
            }
            Self::ProcessFault { sentence, .. }
            | Self::FaultLate { sentence, .. }
            | Self::FaultRequested { sentence }
            | Self::LinkFault { sentence }
            | Self::SlowFault { sentence }
            | Self::AirframeFault { sentence }
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

/// An event with its moment in simulated time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TimedEvent {
    /// The tick at which it happened.
    pub tick: Tick,
    /// What happened.
    #[serde(flatten)]
    pub event: Event,
}

#[cfg(test)]
mod tests;
