//! What a sweep is: a scenario, axes, and seeds for each cell.
//!
//! A flight depends only on the definition, its cell and its seed. Must never fly one, or read a clock.

use super::{
    design::{Axis, Combination, Design, Sampling},
    template::Template,
};
use ringwing_scenario::{AgentSection, Fault, Reading, Scenario, ScenarioError, Setting, Source, start};
use serde::{Deserialize, Serialize};

/// A sweep.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Definition {
    /// Its name, also that of its folder.
    pub name: String,
    /// What it shows, in a line.
    pub description: String,
    /// The scenario as the user named it: a preset or a file.
    pub scenario: String,
    /// The scenario's text.
    pub scenario_text: String,
    /// Keys that every cell sets, each with its value.
    pub set: Vec<(String, String)>,
    /// Faults that are added to those of the scenario.
    pub faults: Vec<Template>,
    /// Programs of the user's that fly UAVs, added to those of the scenario.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub agents: Vec<AgentSection>,
    /// The cells.
    pub design: Design,
    /// The seeds of each cell.
    pub seeds: Seeds,
}

/// What the folder of a sweep says about it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Manifest {
    /// What was flown.
    pub sweep: Definition,
    /// Version of ringwing.
    pub version: String,
    /// Identifies the program to the bit: rows of another build may differ.
    pub build: String,
    /// Whether real processes flew.
    pub by_processes: bool,
    /// Whether each flight was compared with the same one without its faults.
    pub has_baseline: bool,
}

/// The seeds of a cell.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Seeds {
    /// The first seed; the others follow.
    pub first: u64,
    /// Number of flights of each cell; with a precision, the number after which it is asked again whether they suffice.
    pub count: u64,
    /// The wanted width of the Wilson interval of each cell's success.
    pub precision: Option<f64>,
    /// Most flights of a cell, however wide its interval is.
    pub max: u64,
}

/// A mistake in a sweep, with its place.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum SweepProblem {
    /// A value that the scenario refuses.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
    /// Anything else.
    #[error("{place}: {message}")]
    Sweep {
        /// File and line, or the flag.
        place: String,
        /// What is wrong and what to do about it.
        message: String,
    },
}

impl SweepProblem {
    pub(crate) fn new(place: impl Into<String>, message: impl Into<String>) -> Self {
        Self::Sweep { place: place.into(), message: message.into() }
    }
}

impl Definition {
    /// Number of cells; `None` if it does not fit 64 bits.
    pub fn cells(&self) -> Option<u64> {
        self.design.cells()
    }

    /// Most flights of the sweep; `None` if the number does not fit 64 bits.
    pub fn flights(&self) -> Option<u64> {
        self.cells()?.checked_mul(self.seeds.max)
    }

    /// The scenario that a cell flies with its first seed, validated.
    ///
    /// # Errors
    /// A value or a fault of the cell does not fit the scenario.
    pub fn cell(&self, cell: u64) -> Result<Scenario, SweepProblem> {
        let values = self.design.values(cell);
        let source = Source { name: self.scenario.clone(), text: self.scenario_text.clone() };
        let reading = Reading::read(&source, &self.settings(&values))?;
        let mut scenario = reading.with_agents(&self.agents)?.scenario;
        // One fault at a time, so that an error names the sentence that causes it.
        for template in &self.faults {
            let sentence = self.fill(template, &values);
            let problem = |message: String| {
                SweepProblem::new(&template.place, format!("fault {sentence:?}: {message}"))
            };
            let fault: Fault = sentence
                .parse()
                .map_err(|error: ringwing_scenario::fault::FaultSyntaxError| problem(error.to_string()))?;
            scenario = scenario.with_faults(&[fault]).map_err(|error| problem(error.to_string()))?;
        }
        // Last, because the flights of a cell count their seeds from here, whatever the scenario or `set` says.
        scenario.seed = self.seeds.first;
        Ok(scenario)
    }

    /// As [`Self::cell`], and the UAVs also find room to start.
    ///
    /// # Errors
    /// As [`Self::cell`], or there is no room.
    pub fn checked_cell(&self, cell: u64) -> Result<Scenario, SweepProblem> {
        let scenario = self.cell(cell)?;
        start::states(&scenario)?;
        Ok(scenario)
    }

    fn settings(&self, values: &[String]) -> Vec<Setting> {
        let fixed = self.set.iter().map(|(key, value)| setting("set", key, value));
        let of_axis = |(axis, value): (&Axis, &String)| setting(&axis.place, &axis.name, value);
        // The axes come last: a later setting replaces an earlier one, so an axis wins over a key that every cell
        // sets.
        fixed.chain(self.key_axes(values).map(of_axis)).collect()
    }

    /// The axes that are keys of the scenario, with their values.
    fn key_axes<'a>(&'a self, values: &'a [String]) -> impl Iterator<Item = (&'a Axis, &'a String)> {
        // An axis that a fault sentence uses is no key of the scenario, which would refuse it.
        let axes = self.design.axes.iter().zip(values);
        axes.filter(|(axis, _)| !self.faults.iter().any(|template| template.uses(&axis.name)))
    }

    fn fill(&self, template: &Template, values: &[String]) -> String {
        template.fill(|name| {
            let place = self.design.axes.iter().position(|axis| axis.name == name)?;
            values.get(place).map(String::as_str)
        })
    }

    /// The arguments of `ringwing run` that fly one flight of `cell` again, without the seed.
    pub fn arguments(&self, cell: u64) -> Vec<String> {
        let values = self.design.values(cell);
        let mut arguments = vec![self.scenario.clone()];
        let key_axes = self.key_axes(&values).map(|(axis, value)| (&axis.name, value));
        for (key, value) in self.set.iter().map(|(key, value)| (key, value)).chain(key_axes) {
            arguments.extend(["--set".to_owned(), format!("{key}={value}")]);
        }
        for template in &self.faults {
            arguments.extend(["--fault".to_owned(), self.fill(template, &values)]);
        }
        for agent in &self.agents {
            arguments.extend(["--agent".to_owned(), agent.flag()]);
        }
        arguments
    }

    /// Whether the flights of `other`, an earlier definition, also belong to this one: it may only have fewer flights of
    /// each cell.
    pub fn continues(&self, other: &Self) -> bool {
        // Compared as JSON, which leaves out the places of axes and faults: a sweep whose file gets an empty line
        // still goes on.
        let with_my_seeds = Self { seeds: self.seeds.clone(), ..other.clone() };
        let without_places = |definition: &Self| serde_json::to_value(definition).ok();
        other.seeds.first == self.seeds.first
            && other.seeds.max <= self.seeds.max
            && without_places(&with_my_seeds) == without_places(self)
    }
}

/// The setting of an axis; messages name the axis's place and the value.
fn setting(place: &str, key: &str, value: &str) -> Setting {
    Setting { written: format!("{place}: {key} = {value}"), key: key.to_owned(), value: value.to_owned() }
}

impl Default for Design {
    fn default() -> Self {
        Self {
            axes: Vec::new(),
            combination: Combination::default(),
            sampling: Sampling::default(),
            samples: 1,
            seed: 1,
        }
    }
}
