//! How the processes of a run meet: the domain in shared memory that one run owns, its services, and its tick gate.
//!
//! The only crate that knows iceoryx2, futexes and shared memory. [`domain`] is a run's place in shared memory, [`channel`]
//! its services, [`gate`] the page that lets all processes step through time together, [`waker`] and [`patience`] how
//! they wait for it, and [`member`] what every process does to take part. [`ballast`] carries bytes for benchmarks.
//!
//! Never decides anything about the flight: no law, no physics.

pub mod ballast;
pub mod channel;
pub mod deadlines;
pub mod domain;
pub mod gate;
pub mod member;
pub mod patience;
pub mod placement;
pub mod probe;
pub mod report;
pub mod stamp;
pub mod waker;
mod wire;

pub use ballast::Ballast;
pub use channel::{Channel, Publisher, Subscriber};
pub use deadlines::Deadlines;
pub use domain::{Domain, DomainId};
pub use gate::{Gate, Wait};
pub use member::{Member, StopFlag};
pub use patience::{Due, Patience};
pub use placement::{Placement, PlacementError};
pub use probe::{NoProbe, PacedTick, Proceed, TickProbe};
pub use stamp::{Stamps, monotonic_ns};
pub use waker::Waker;

/// What can go wrong between a process and the rest of its run.
#[derive(Debug, thiserror::Error)]
pub enum BusError {
    /// The domain is not there, or is not one of ours.
    #[error("domain {id}: {problem}; `ringwing run` creates a domain and prints its name")]
    Domain {
        /// The domain's name.
        id: String,
        /// What is wrong with it.
        problem: String,
    },
    /// A file of the domain could not be read, written, mapped or removed.
    #[error("{path}: {source}")]
    File {
        /// The file.
        path: std::path::PathBuf,
        /// The operating system's reason.
        source: std::io::Error,
    },
    /// A report that another process left is not readable.
    #[error("{path}: not a readable report: {source}")]
    Report {
        /// The file.
        path: std::path::PathBuf,
        /// What the reader says.
        source: serde_json::Error,
    },
    /// iceoryx2 refused.
    #[error("{what}: {reason}")]
    Ipc {
        /// The service, port or node concerned.
        what: String,
        /// The error as iceoryx2 names it.
        reason: String,
    },
    /// The operating system refused.
    #[error("{what}: {source}")]
    System {
        /// What was asked for.
        what: &'static str,
        /// The operating system's reason.
        source: std::io::Error,
    },
}

impl BusError {
    fn ipc(what: impl Into<String>, reason: impl std::fmt::Debug) -> Self {
        Self::Ipc { what: what.into(), reason: format!("{reason:?}") }
    }

    fn file(path: impl Into<std::path::PathBuf>) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.into();
        move |source| Self::File { path, source }
    }
}
