//! What can go wrong between a process and the rest of its run.

use crate::Shortage;
use ringwing_scenario::ScenarioError;
use std::{fmt::Debug, io, path::PathBuf};

/// Why a process cannot take part in a run.
#[derive(Debug, thiserror::Error)]
pub enum BusError {
    /// The domain does not exist, or does not let this process in.
    #[error("domain {id}: {problem}; `ringwing run` creates a domain and prints its name")]
    Domain {
        /// The domain's name.
        id: String,
        /// What is wrong with it.
        problem: String,
    },
    /// The run's launcher gives no answer.
    #[error("domain {id}: {problem}")]
    NoAnswer {
        /// The domain's name.
        id: String,
        /// Why no answer came.
        problem: String,
    },
    /// The run belongs to somebody else.
    #[error("domain {id}: permission denied: the run belongs to user {owner}")]
    Permission {
        /// The domain's name.
        id: String,
        /// The number of the user who started the run.
        owner: u32,
    },
    /// The scenario in the domain is not valid. It was written by another build of ringwing.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
    /// A file of the domain cannot be read, written, mapped or removed.
    #[error("{path}: {source}")]
    File {
        /// The file.
        path: PathBuf,
        /// The operating system's reason.
        source: io::Error,
    },
    /// A report that another process left cannot be parsed.
    #[error("{path}: not a readable report: {source}")]
    Report {
        /// The file.
        path: PathBuf,
        /// The parser's reason.
        source: serde_json::Error,
    },
    /// The machine lacks something.
    #[error(transparent)]
    Shortage(#[from] Shortage),
    /// iceoryx2 refused.
    #[error("{what}: {reason}")]
    Ipc {
        /// The service, port or node concerned, and what was tried.
        what: String,
        /// The error as iceoryx2 names it.
        reason: String,
    },
    /// The operating system refused.
    #[error("{what}: {source}")]
    System {
        /// What was tried.
        what: &'static str,
        /// The operating system's reason.
        source: io::Error,
    },
}

impl BusError {
    pub(crate) fn ipc(what: impl Into<String>, reason: impl Debug) -> Self {
        Self::Ipc { what: what.into(), reason: format!("{reason:?}") }
    }

    /// For `map_err` of an operation on the file `path`.
    pub(crate) fn file(path: impl Into<PathBuf>) -> impl FnOnce(io::Error) -> Self {
        let path = path.into();
        move |source| Self::File { path, source }
    }

    /// For `map_err` of a system call.
    pub(crate) fn system<E: Into<io::Error>>(what: &'static str) -> impl FnOnce(E) -> Self {
        move |error| Self::System { what, source: error.into() }
    }
}
