//! Everything that can go wrong in a benchmark.

use ringwing_bus::{BusError, PlacementError};
use ringwing_drawing::DrawingError;
use ringwing_scenario::ScenarioError;
use std::{io, path::PathBuf};

/// Why a benchmark, or one of its cases, cannot be measured, written or read.
#[derive(Debug, thiserror::Error)]
pub enum BenchError {
    /// Options that contradict each other, or a folder that cannot take the results.
    #[error("{0}")]
    Usage(String),
    /// The kernel refuses `--priority`.
    #[error(transparent)]
    Placement(#[from] PlacementError),
    /// No scenario can be made for a case.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
    /// A domain, its gate, or a trace cannot be used.
    #[error(transparent)]
    Bus(#[from] BusError),
    /// A chart cannot be drawn.
    #[error(transparent)]
    Drawing(#[from] DrawingError),
    /// A file or folder cannot be read or written.
    #[error("{}: cannot be {action}: {source}", path.display())]
    File {
        /// The file or folder.
        path: PathBuf,
        /// What was tried, as a participle.
        action: &'static str,
        /// The operating system's reason.
        source: io::Error,
    },
    /// A file is not a result of a benchmark that this version reads.
    #[error("{}: {problem}", path.display())]
    Results {
        /// The file.
        path: PathBuf,
        /// What is wrong with it, and what to do.
        problem: String,
    },
    /// A process cannot be started, watched or connected.
    #[error("{what}: {source}")]
    System {
        /// What failed.
        what: &'static str,
        /// The operating system's reason.
        source: io::Error,
    },
    /// One case failed, for this reason.
    #[error("{0}")]
    Case(String),
}

impl BenchError {
    /// Whether the user has to change the command, as opposed to the machine.
    pub fn is_usage(&self) -> bool {
        matches!(self, Self::Usage(_) | Self::Placement(_) | Self::Scenario(_))
    }

    pub(crate) fn case(why: impl Into<String>) -> Self {
        Self::Case(why.into())
    }

    pub(crate) fn system(what: &'static str) -> impl FnOnce(io::Error) -> Self {
        move |source| Self::System { what, source }
    }

    pub(crate) fn file(path: impl Into<PathBuf>, action: &'static str) -> impl FnOnce(io::Error) -> Self {
        let path = path.into();
        move |source| Self::File { path, action, source }
    }
}
