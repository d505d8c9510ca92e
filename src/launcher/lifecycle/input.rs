//! What happens to a process, as the supervisor tells its lifecycle.
//!
//! Must never say what follows from it: the lifecycle decides that.

use ringwing_flight::{ProcessAction, ProcessEnd};

/// An event in the life of a process.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::launcher) enum Input {
    /// The launcher has spawned it.
    Spawned {
        /// Its process id.
        pid: u32,
    },
    /// The process has announced at the gate that it is ready. It is the spawned one or,
    /// if none was spawned, one that the user started by hand.
    Ready {
        /// Its process id.
        pid: u32,
    },
    /// A signal has stopped it.
    Stopped,
    /// A signal lets it run on.
    Continued,
    /// It has ended.
    Ended(ProcessEnd),
    /// A fault asks for this action, for which [`Lifecycle::refusal`](super::Lifecycle::refusal) has returned `None`.
    Asked(ProcessAction),
    /// The launcher kills the process, because the run is over.
    Killed,
    /// Time has passed.
    ClockTicked,
}
