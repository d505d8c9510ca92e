//! The sentence that people read about an event, on the terminal and in the log.
//!
//! No program may parse these sentences: whatever it needs is in the event's fields.

use super::{AfterLoss, Collider, Event, GapCause, ProcessAction, ProcessEnd};
use crate::{Part, Tick, counted};
use std::fmt;

impl Event {
    /// What happened, without a full stop: `uav 3 and uav 5 at (1.0, -2.0) m`.
    ///
    /// `obstacle_name` names the scenario's obstacle with an index counted from 0.
    pub fn text(&self, obstacle_name: impl Fn(u32) -> String) -> String {
        match self {
            Self::Collision { uav, with, position_m: [x, y] } => {
                format!("{uav} and {} at ({x:.1}, {y:.1}) m", with.name(obstacle_name))
            }
            Self::NearMiss { uav, with, distance_m, position_m: [x, y], .. } => {
                let with = with.name(obstacle_name);
                format!("{uav} and {with} passed at {distance_m:.1} m, at ({x:.1}, {y:.1}) m")
            }
            Self::Failsafe { uav, mode } => format!("{uav} flies without its agent: {}", mode.name()),
            Self::WishNotFinite { uav } => {
                format!(
                    "{uav} has a controller whose wish is not a finite number; such a command is withheld"
                )
            }
            Self::NoteRefused { uav, name, why } => {
                format!("the note {name:?} of {uav} is not recorded: {why}")
            }
            Self::ProcessLost { part, end, then } => loss_text(*part, *end, *then),
            Self::ProcessReady { part } => format!("{part} is ready"),
            Self::ProcessFrozen { part } => format!("{part} is frozen (SIGSTOP)"),
            Self::ProcessThawed { part } => format!("{part} is thawed (SIGCONT)"),
            Self::StartOverdue { part } => {
                format!("{part} was not ready in time; killed: raise supervision.start_timeout_s")
            }
            Self::ThawOverdue { part } => {
                format!("{part} stayed frozen for too long; killed: raise supervision.answer_timeout_s")
            }
            Self::ProcessSilent { part, waited_s } => silence_text(*part, *waited_s),
            Self::ReplacementOverdue => {
                "no replacement was ready in time; flying on: raise supervision.start_timeout_s".into()
            }
            Self::RecorderSilent => "the recorder has stopped reading; flying on".into(),
            Self::RecorderGap { first_tick, last_tick, cause } => gap_text(*first_tick, *last_tick, *cause),
            Self::ConnectionsFailed { count } => {
                format!("{} of the world failed; is `ulimit -n` large enough?", counted(*count, "connection"))
            }
            Self::RunInterrupted => "interrupted; ending the flight (interrupt again to kill it)".into(),
            Self::RunPaused { seconds } => format!("the run stood still for {seconds:.1} s"),
            Self::ProcessFault { part, action, sentence } => format!("{part} {}: {sentence}", action.done()),
            Self::FaultRefused { part: Some(part), why, sentence } => format!("{part} {why}: {sentence}"),
            // Not every refused sentence names a process.
            Self::FaultRefused { part: None, why, sentence } => format!("{why}: {sentence}"),
            Self::FaultLate { part, late_s, sentence } => {
                format!("{late_s:.2} s late, with its duration kept: {sentence} ({part})")
            }
            Self::FaultOverdue => {
                "a fault was not applied in time; flying on: raise supervision.start_timeout_s".into()
            }
            Self::FaultRequested { sentence }
            | Self::LinkFault { sentence }
            | Self::SlowFault { sentence }
            | Self::AirframeFault { sentence }
            | Self::FaultHealed { sentence } => sentence.clone(),
        }
    }
}

impl Collider {
    /// What people call it: `uav 5`, `intruder 1`, or what `obstacle_name` makes of an obstacle's index.
    pub fn name(self, obstacle_name: impl Fn(u32) -> String) -> String {
        match self {
            Self::Uav(other) => other.to_string(),
            Self::Obstacle(index) => obstacle_name(index),
            Self::Intruder(intruder) => intruder.to_string(),
        }
    }
}

fn silence_text(part: Part, waited_s: f64) -> String {
    format!(
        "{part} has not answered for {waited_s:.1} s; flying on: raise supervision.answer_timeout_s if it is only slow"
    )
}

fn loss_text(part: Part, end: ProcessEnd, then: AfterLoss) -> String {
    match then {
        // Both happen only to the world, the leader and the recorder, so the article fits: a UAV's name would take none.
        AfterLoss::Replaced => format!("the {part} {end}; a new one takes over"),
        AfterLoss::RunEnds => format!("the {part} {end}; the run ends"),
        AfterLoss::Failsafe { before_flight } => {
            let when = if before_flight { " before the flight" } else { "" };
            format!("{part} {end}{when}; its airframe goes into its failsafe")
        }
    }
}

fn gap_text(first: Tick, last: Tick, cause: GapCause) -> String {
    let ticks = if first == last {
        format!("{first} was lost")
    } else {
        format!("ticks {} to {} were lost", first.0, last.0)
    };
    match cause {
        GapCause::StartedLate => format!("{ticks} before the recorder joined"),
        GapCause::LostWithPredecessor => format!("{ticks} with the recorder's predecessor"),
        GapCause::FellBehind => format!("{ticks}: the recorder fell behind"),
    }
}

/// The predicate of a sentence about the process: `was killed by signal 9`.
impl fmt::Display for ProcessEnd {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            // Status 0 is no failure, so it must not read as if the process gave up.
            Self::Exited(0) => f.write_str("has exited"),
            Self::Exited(status) => write!(f, "gave up (exit status {status})"),
            Self::Killed(signal) => write!(f, "was killed by signal {signal}"),
            Self::Unknown => f.write_str("has ended"),
        }
    }
}

impl ProcessEnd {
    /// How the process ended, with the name of the signal: `killed by signal 9 (SIGKILL)`.
    pub fn cause(self) -> String {
        match self {
            Self::Exited(status) => format!("exited with status {status}"),
            Self::Killed(signal) => {
                let name = signal_name(signal).map_or_else(String::new, |name| format!(" ({name})"));
                format!("killed by signal {signal}{name}")
            }
            Self::Unknown => "ended; started by hand, so its exit status is unknown".into(),
        }
    }
}

/// The name of a signal that ends processes, by its number on Linux.
fn signal_name(signal: i32) -> Option<&'static str> {
    let name = match signal {
        1 => "SIGHUP",
        2 => "SIGINT",
        3 => "SIGQUIT",
        4 => "SIGILL",
        5 => "SIGTRAP",
        6 => "SIGABRT",
        7 => "SIGBUS",
        8 => "SIGFPE",
        9 => "SIGKILL",
        10 => "SIGUSR1",
        11 => "SIGSEGV",
        12 => "SIGUSR2",
        13 => "SIGPIPE",
        14 => "SIGALRM",
        15 => "SIGTERM",
        24 => "SIGXCPU",
        25 => "SIGXFSZ",
        31 => "SIGSYS",
        _ => return None,
    };
    Some(name)
}

impl ProcessAction {
    /// The predicate of a sentence about the process: `is killed`.
    pub fn done(self) -> &'static str {
        match self {
            Self::Kill { .. } => "is killed",
            Self::Stop => "is stopped",
            Self::Freeze => "is frozen",
            Self::Thaw => "is thawed",
            Self::Start => "is started",
        }
    }
}
