//! The exceptions of the package, and which error becomes which.
//!
//! Never shortens a message: it names the file, the line or the argument, and says what to do.

use pyo3::{PyErr, create_exception, exceptions::PyException};
use ringwing_recorder::log::reader::ReadError;
use ringwing_scenario::ScenarioError as BadScenario;
use ringwing_study::{files::ResultsError, recorded::RecordedFlightError, sweep::SweepProblem};
use std::{io, path::Path};

create_exception!(ringwing, RingwingError, PyException, "Whatever ringwing refuses or fails at.");
create_exception!(ringwing, AgentError, RingwingError, "A controller's program cannot take part in a run.");
create_exception!(ringwing, LogError, RingwingError, "A file cannot be read as a log of ringwing.");
create_exception!(
    ringwing,
    ScenarioError,
    RingwingError,
    "A scenario, a key, a fault or an axis is wrong. The message has a line for each mistake."
);
create_exception!(
    ringwing,
    FlightError,
    RingwingError,
    "A flight cannot begin, or its files cannot be written."
);

/// An error of this crate, before it becomes an exception.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Failure {
    #[error(transparent)]
    Log(#[from] ReadError),
    #[error(transparent)]
    Scenario(#[from] BadScenario),
    #[error("{0}")]
    Wrong(String),
    #[error(transparent)]
    Flight(#[from] RecordedFlightError),
    #[error(transparent)]
    Results(#[from] ResultsError),
    #[error("{path}: cannot be written: {source}; choose another folder with out=")]
    Unwritable { path: String, source: io::Error },
    /// An exception that Python code has raised meanwhile.
    #[error(transparent)]
    Python(#[from] PyErr),
}

impl Failure {
    /// The file or folder `path` cannot be written.
    pub(crate) fn unwritable(path: &Path, source: io::Error) -> Self {
        Self::Unwritable { path: path.display().to_string(), source }
    }
}

impl From<Vec<SweepProblem>> for Failure {
    fn from(problems: Vec<SweepProblem>) -> Self {
        Self::Wrong(problems.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))
    }
}

impl From<Failure> for PyErr {
    fn from(failure: Failure) -> Self {
        let text = failure.to_string();
        match failure {
            Failure::Python(error) => error,
            Failure::Log(_) => LogError::new_err(text),
            Failure::Scenario(_) | Failure::Wrong(_) => ScenarioError::new_err(text),
            Failure::Flight(_) | Failure::Results(_) | Failure::Unwritable { .. } => {
                FlightError::new_err(text)
            }
        }
    }
}
