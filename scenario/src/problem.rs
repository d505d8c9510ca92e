//! What is wrong with a scenario, said so that its author can put it right.

use serde::Serialize;
use std::fmt;

/// One thing that is wrong with a scenario; shown on one line.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Problem {
    /// The scenario's name, as the user gave it.
    pub scenario: String,
    /// Where the mistake was made.
    pub place: Place,
    /// The key concerned, in the notation of `--set`: `airframe.speed_max_m_s`, `obstacles.0.radius_m`.
    pub key: Option<String>,
    /// What is wrong, and what to do about it.
    pub message: String,
}

/// Where a mistake was made.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Place {
    /// In the scenario as a whole.
    Scenario,
    /// On this line of its file, from 1.
    Line(usize),
    /// In this override, as the user wrote it.
    Setting(String),
}

impl Problem {
    /// A mistake that concerns the scenario as a whole.
    pub(crate) fn of_scenario(scenario: &str, message: impl Into<String>) -> Self {
        Self { scenario: scenario.into(), place: Place::Scenario, key: None, message: message.into() }
    }
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.place {
            Place::Scenario => write!(f, "scenario \"{}\": ", self.scenario)?,
            Place::Line(line) => write!(f, "scenario \"{}\", line {line}: ", self.scenario)?,
            Place::Setting(written) => write!(f, "{written}: ")?,
        }
        if let Some(key) = &self.key {
            write!(f, "{}: ", key.escape_debug())?;
        }
        f.write_str(&self.message)
    }
}

/// All that is wrong with a scenario, one line each.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{}", lines(.problems))]
pub struct ScenarioError {
    problems: Vec<Problem>,
}

impl ScenarioError {
    /// What is wrong, in the order of the file, then of the overrides.
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
