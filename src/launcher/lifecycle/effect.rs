//! What the supervisor has to do after a process has changed.
//!
//! Must never do any of it: an effect is data, so that tests can compare it.

use ringwing_flight::Event;

/// What the supervisor has to do, in the given order.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::launcher) enum Effect {
    /// Log this event.
    Log(Event),
    /// Send a signal.
    Signal {
        /// The process id.
        pid: u32,
        /// The signal.
        signal: ProcessSignal,
    },
    /// Spawn a process and report it as [`Input::Spawned`](super::Input::Spawned).
    Spawn,
    /// Watch this process for its end: it is not the launcher's child.
    Watch {
        /// The process.
        pid: u32,
    },
    /// Remove what the process left in shared memory.
    CleanUp {
        /// Whether a fault asked for the end. Then the readers of what the process sent need it for a few more ticks.
        is_planned: bool,
    },
    /// Tell the world which processes run.
    PublishRoster,
    /// End the run, which has failed for this reason.
    EndRun(String),
    /// Let the flight go on, but count the run as failed for this reason.
    FailAtEnd(String),
}

/// The signals that the launcher sends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::launcher) enum ProcessSignal {
    /// SIGKILL.
    Kill,
    /// SIGTERM.
    Terminate,
    /// SIGSTOP.
    Stop,
    /// SIGCONT.
    Continue,
}
