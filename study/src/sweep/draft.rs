//! A sweep while it is put together: from a file, from the command line, or from both.
//!
//! Never stops at the first mistake of a file, unless the text is not TOML. Never flies anything.

use super::{
    definition::{Definition, Seeds, SweepProblem},
    design::{Axis, Combination, Design, Sampling},
    template::Template,
    values::{self, Values},
};
use ringwing_scenario::{AgentSection, Source};

/// Flights of each cell if nothing else is asked for. Fewer say little about a share; more take longer.
const SEEDS: u64 = 1;
/// Most flights of a cell with a precision and without a limit of its own. A cell whose success is near one half needs
/// 1,050 flights for an interval of 0.06.
const SEEDS_MAX: u64 = 2000;
/// Flights of each batch of a cell with a precision. Smaller batches stop closer to the precision; larger ones keep more
/// cores busy when few cells are left.
const BATCH: u64 = 20;
/// The parts of a sweep, as far as they are given.
#[derive(Debug, Clone, Default)]
pub struct Draft {
    /// Name of the sweep.
    pub name: Option<String>,
    /// What it shows.
    pub description: Option<String>,
    /// The scenario: a preset or a file.
    pub scenario: Option<String>,
    /// Keys with their values.
    pub set: Vec<Given>,
    /// Fault sentences, in which braces hold axes.
    pub faults: Vec<Given>,
    /// Programs of the user's that fly UAVs, each with the absolute path of its folder.
    pub agents: Vec<AgentSection>,
    /// Axes with their values.
    pub axes: Vec<Given>,
    /// How listed axes are combined.
    pub combination: Option<Combination>,
    /// How random axes are drawn.
    pub sampling: Option<Sampling>,
    /// Number of samples of random axes.
    pub samples: Option<u64>,
    /// Seed of the samples.
    pub sampling_seed: Option<u64>,
    /// Number of flights of each cell.
    pub seeds: Option<u64>,
    /// The first seed.
    pub first_seed: Option<u64>,
    /// Wanted width of the interval of each cell's success.
    pub precision: Option<f64>,
    /// Most flights of a cell.
    pub seeds_max: Option<u64>,
    /// What the sweep was read from, for messages.
    pub place: String,
}

/// A part with its place.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Given {
    /// The key or the axis; empty for a fault.
    pub name: String,
    /// The value, the values or the sentence.
    pub text: Text,
    /// Where it was written.
    pub place: String,
}

/// What was written: one text, or a list in which each item is a value as it stands.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Text {
    /// A text that may hold ranges.
    One(String),
    /// A list of values.
    List(Vec<String>),
}

impl Given {
    /// A part with the place that it was written at.
    pub fn new(name: &str, text: &str, place: &str) -> Self {
        Self { name: name.to_owned(), text: Text::One(text.to_owned()), place: place.to_owned() }
    }

    /// Its text; the items of a list in brackets.
    fn as_text(&self) -> String {
        match &self.text {
            Text::One(text) => text.clone(),
            Text::List(items) => format!("[{}]", items.join(", ")),
        }
    }

    fn values(&self) -> Result<Values, SweepProblem> {
        let problem =
            |message: String| SweepProblem::new(&self.place, format!("axis {}: {message}", self.name));
        match &self.text {
            Text::One(text) => values::parse(text).map_err(problem),
            Text::List(items) if items.is_empty() => {
                Err(problem("empty range: give at least one value".into()))
            }
            Text::List(items) => Ok(Values::Listed(items.clone())),
        }
    }
}

impl Draft {
    /// Sets a key of the scenario in every cell, in place of what was given for it before.
    pub fn set(&mut self, given: Given) {
        self.set.retain(|other| other.name != given.name);
        self.set.push(given);
    }

    /// Adds an axis, in place of one of the same name.
    pub fn add_axis(&mut self, given: Given) {
        // An axis that is given again keeps its place: the order of the axes decides the number of each cell.
        match self.axes.iter_mut().find(|axis| axis.name == given.name) {
            Some(axis) => *axis = given,
            None => self.axes.push(given),
        }
    }

    /// The whole sweep.
    ///
    /// # Errors
    /// Every mistake in the parts and in how they fit together.
    pub fn finish(self) -> Result<Definition, Vec<SweepProblem>> {
        let scenario = self
            .scenario
            .clone()
            .ok_or_else(|| vec![self.problem("no scenario: give scenario = \"paper-4.1\"")])?;
        let source = Source::find(&scenario).map_err(|error| vec![error.into()])?;
        let (axes, faults) = self.axes()?;
        let definition = Definition {
            name: self.name.clone().unwrap_or_else(|| scenario_name(&scenario)),
            description: self.description.clone().unwrap_or_default(),
            scenario,
            scenario_text: source.text,
            set: self.set.iter().map(|given| (given.name.clone(), given.as_text())).collect(),
            faults,
            agents: self.agents.clone(),
            design: Design {
                axes,
                combination: self.combination.unwrap_or_default(),
                sampling: self.sampling.unwrap_or_default(),
                samples: self.samples.unwrap_or(1),
                seed: self.sampling_seed.unwrap_or(1),
            },
            seeds: self.seeds()?,
        };
        match self.problem_of(&definition) {
            Some(problem) => Err(vec![problem]),
            None => Ok(definition),
        }
    }

    fn problem(&self, message: impl Into<String>) -> SweepProblem {
        SweepProblem::new(&self.place, message)
    }

    /// What is wrong with the parts together.
    fn problem_of(&self, definition: &Definition) -> Option<SweepProblem> {
        // The flights of a cell count their seeds, so this one would be ignored.
        if let Some(given) = self.set.iter().find(|given| given.name == "seed") {
            let message = "seed: the seeds of a sweep begin with first_seed: give that instead";
            return Some(SweepProblem::new(&given.place, message));
        }
        if let Some(message) = definition.design.problem() {
            return Some(self.problem(message));
        }
        // The name becomes a folder of results: a slash would put it elsewhere, and a leading dot would hide it.
        let is_safe = |letter: char| letter.is_alphanumeric() || "-_.".contains(letter);
        if definition.name.is_empty()
            || definition.name.starts_with('.')
            || !definition.name.chars().all(is_safe)
        {
            let message = format!(
                "name {:?}: the name is also that of a folder, so give letters, digits, - and _",
                definition.name
            );
            return Some(self.problem(message));
        }
        None
    }

    /// The axes, in the order in which they were given, and the fault sentences that use them.
    fn axes(&self) -> Result<(Vec<Axis>, Vec<Template>), Vec<SweepProblem>> {
        let (mut axes, mut templates, mut problems) = (Vec::<Axis>::new(), Vec::new(), Vec::new());
        for given in &self.axes {
            if axes.iter().any(|axis| axis.name == given.name) {
                problems.push(SweepProblem::new(&given.place, format!("axis {} is given twice", given.name)));
            }
            match given.values() {
                Ok(values) => {
                    axes.push(Axis { name: given.name.clone(), values, place: given.place.clone() });
                }
                Err(problem) => problems.push(problem),
            }
        }
        for given in &self.faults {
            // An axis with wrong values is missing in `axes`, but a sentence that names it must not define
            // another one.
            let is_axis = |name: &str| {
                axes.iter().any(|axis| axis.name == name) || self.axes.iter().any(|axis| axis.name == name)
            };
            match Template::parse(&given.as_text(), &given.place, is_axis) {
                Ok((template, inline)) => {
                    templates.push(template);
                    for (name, values) in inline {
                        match Given::new(&name, &values, &given.place).values() {
                            Ok(values) => axes.push(Axis { name, values, place: given.place.clone() }),
                            Err(problem) => problems.push(problem),
                        }
                    }
                }
                Err(message) => problems.push(SweepProblem::new(&given.place, message)),
            }
        }
        if problems.is_empty() { Ok((axes, templates)) } else { Err(problems) }
    }

    fn seeds(&self) -> Result<Seeds, Vec<SweepProblem>> {
        let count = self.seeds.unwrap_or(if self.precision.is_some() { BATCH } else { SEEDS });
        // A first batch above the default limit raises it: the user has asked for these flights.
        let max =
            if self.precision.is_some() { self.seeds_max.unwrap_or(SEEDS_MAX.max(count)) } else { count };
        let first = self.first_seed.unwrap_or(1);
        let problem = if count == 0 {
            Some("seeds must be at least 1".to_owned())
        } else if max < count {
            Some(format!("seeds_max = {max} is below seeds = {count}"))
        } else if first.checked_add(max).is_none_or(|end| end > i64::MAX.cast_unsigned()) {
            // TOML and Parquet have signed 64-bit integers, so a larger seed could be flown but not written down.
            Some("the last seed would be above 2^63 - 1: give fewer seeds or a smaller first_seed".to_owned())
        } else if self.precision.is_some_and(|width| !(width > 0.0 && width < 1.0)) {
            Some("precision is the width of an interval of a share: give a number between 0 and 1, such as 0.1".to_owned())
        } else if self.seeds_max.is_some() && self.precision.is_none() {
            Some("seeds_max needs a precision: it ends a cell whose interval stays too wide".to_owned())
        } else {
            None
        };
        match problem {
            Some(message) => Err(vec![self.problem(message)]),
            None => Ok(Seeds { first, count, precision: self.precision, max }),
        }
    }
}

/// The name of a sweep of this scenario: that of its file.
fn scenario_name(scenario: &str) -> String {
    let name = scenario.rsplit('/').next().unwrap_or(scenario);
    let name = name.strip_suffix(".toml").unwrap_or(name);
    format!("{name}-sweep")
}

#[cfg(test)]
mod tests {
    use super::*;

    const FILE: &str = r#"
name = "delays"
scenario = "paper-4.1"
faults = ["at 30 s link all->all delay {delay} s", "at 40 s link all->all loss {10, 20 .. 30} %"]
seeds = 3
[set]
time.duration_s = 5
[axes]
delay = "0, 0.1 .. 0.3"
"control.law" = ["paper", "resilient"]
"#;

    fn problems(text: &str) -> Vec<String> {
        let problems = match Draft::parse("my.toml", text) {
            Ok(draft) => draft.finish().err().unwrap_or_default(),
            Err(problems) => problems,
        };
        problems.iter().map(ToString::to_string).collect()
    }

    #[test]
    fn a_file_is_a_sweep_with_axes_in_the_order_of_the_file() {
        let sweep = Draft::parse("my.toml", FILE).unwrap().finish().unwrap();
        let names: Vec<_> = sweep.design.axes.iter().map(|axis| axis.name.as_str()).collect();
        assert_eq!(names, ["delay", "control.law", "loss"]);
        assert_eq!((sweep.cells(), sweep.flights()), (Some(4 * 2 * 3), Some(72)));
        let scenario = sweep.checked_cell(23).unwrap();
        assert_eq!((scenario.time.duration_s, scenario.seed), (5.0, 1));
        assert_eq!(scenario.faults.last().unwrap().to_string(), "at 40 s link all->all loss 30 %");
        assert_eq!(sweep.arguments(0)[..3], ["paper-4.1", "--set", "time.duration_s=5"]);
        assert!(sweep.arguments(0).contains(&"at 30 s link all->all delay 0 s".to_owned()));
    }

    #[test]
    fn mistakes_are_named_with_file_and_line() {
        let with = |from: &str, to: &str| problems(&FILE.replace(from, to));
        assert!(with("seeds = 3", "sedes = 3")[0].starts_with("my.toml:5: sedes: no such key"));
        assert!(with("seeds = 3", "seeds = -3")[0].starts_with("my.toml:5: seeds: give a whole number"));
        assert!(with("0, 0.1 .. 0.3", "1 .. 0")[0].starts_with("my.toml:9: axis delay: empty range"));
        assert!(
            with("[\"paper\", \"resilient\"]", "[]")[0]
                .starts_with("my.toml:10: axis control.law: empty range")
        );
        assert!(with("[axes]", "[axes")[0].starts_with("my.toml:8: "));
        assert!(
            with("time.duration_s = 5", "seed = 5")[0].starts_with("my.toml:7: seed: the seeds of a sweep")
        );
        assert!(with("{delay}", "{delay")[0].starts_with("my.toml:4: the brace"));
        assert!(with("\"delays\"", "\"a/b\"")[0].contains("also that of a folder"));
    }

    #[test]
    fn a_cell_that_the_scenario_refuses_is_refused_by_the_scenarios_own_error() {
        let cell = |from: &str, to: &str| {
            let sweep = Draft::parse("my.toml", &FILE.replace(from, to)).unwrap().finish().unwrap();
            sweep.cell(0).unwrap_err().to_string()
        };
        let error = cell("\"control.law\"", "\"control.lwa\"");
        assert!(
            error.contains("my.toml:10: control.lwa = paper") && error.contains("no such key"),
            "{error}"
        );
        let error = cell("delay {delay} s", "dleay {delay} s");
        assert!(error.starts_with("my.toml:4: fault \"at 30 s link all->all dleay 0 s\": "), "{error}");
    }

    #[test]
    fn a_sweep_may_go_on_with_more_seeds_and_with_nothing_else_changed() {
        let sweep = |from: &str, to: &str| {
            Draft::parse("my.toml", &FILE.replace(from, to)).unwrap().finish().unwrap()
        };
        let (first, more) = (sweep("seeds = 3", "seeds = 3"), sweep("seeds = 3", "seeds = 5"));
        assert!(more.continues(&first) && first.continues(&first));
        assert!(!first.continues(&more));
        assert!(!sweep("0.1 .. 0.3", "0.1 .. 0.4").continues(&first));
    }
}
