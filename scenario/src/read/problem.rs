//! The errors of a scenario: where each mistake is, which key it concerns, and what to do about it.
//!
//! Never looks for mistakes itself.

use serde::Serialize;
use std::fmt;

/// One mistake in a scenario; displays as one line.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Problem {
    /// The preset's name or the file's path, as the user gave it.
    pub scenario: String,
    /// Where the mistake is.
    pub place: Place,
    /// The key, as in `--set`: `airframe.speed_max_m_s`, `obstacles.0.radius_m`; `None` if there is no single one.
    pub key: Option<String>,
    /// What is wrong and what to do about it, in lower case and without a full stop.
    pub message: String,
}

/// Where a mistake is.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Place {
    /// In the scenario as a whole.
    Scenario,
    /// On this line of the file, from 1.
    Line(usize),
    /// In this override or flag, as the user wrote it.
    Setting(String),
}

impl Problem {
    /// A mistake of the scenario as a whole.
    pub(crate) fn of_scenario(scenario: &str, message: impl Into<String>) -> Self {
        Self { scenario: scenario.into(), place: Place::Scenario, key: None, message: message.into() }
    }
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.place {
            Place::Scenario => write!(f, "scenario \"{}\": ", self.scenario)?,
            // Editors and terminals find the place of a mistake in this form.
            Place::Line(line) => write!(f, "{}:{line}: ", self.scenario)?,
            Place::Setting(written) => write!(f, "{written}: ")?,
        }
        if let Some(key) = &self.key {
            // An unknown key may hold a line break, but a problem must stay on one line.
            write!(f, "{}: ", key.escape_debug())?;
        }
        f.write_str(&self.message)
    }
}

/// Every mistake in a scenario, one line each.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{}", lines(.problems))]
pub struct ScenarioError {
    problems: Vec<Problem>,
}

impl ScenarioError {
    /// The mistakes, first in the order of the file, then of the overrides.
    pub fn problems(&self) -> &[Problem] {
        &self.problems
    }
}

impl From<Vec<Problem>> for ScenarioError {
    fn from(problems: Vec<Problem>) -> Self {
        Self { problems }
    }
}

impl From<Problem> for ScenarioError {
    fn from(problem: Problem) -> Self {
        vec![problem].into()
    }
}

fn lines(problems: &[Problem]) -> String {
    problems.iter().map(Problem::to_string).collect::<Vec<_>>().join("\n")
}
