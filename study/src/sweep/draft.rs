//! A sweep while it is put together: from a file, from the command line, or from both.
//!
//! Never stops at the first mistake of a file, unless the text is not TOML. Never flies anything.

use super::{
    definition::{Definition, Seeds, SweepProblem},
    design::{Axis, Combination, Design, Sampling},
    template::Template,
    values::{self, Values},
};
use ringwing_scenario::Source;
use std::ops::Range;
use toml::{
    Spanned,
    de::{DeTable, DeValue},
};

/// Flights of each cell if nothing else is asked for. Fewer say little about a share; more take longer.
const SEEDS: u64 = 1;
/// Most flights of a cell with a precision and without a limit of its own. A cell whose success is near one half needs
/// 1,050 flights for an interval of 0.06.
const SEEDS_MAX: u64 = 2000;
/// Flights of each batch of a cell with a precision. Smaller batches stop closer to the precision; larger ones keep more
/// cores busy when few cells are left.
const BATCH: u64 = 20;
/// The keys of a sweep file, for messages.
const KEYS: &str = "name, description, scenario, set, faults, axes, combination, sampling, samples, sampling_seed, seeds, \
                    first_seed, precision, seeds_max";

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

/// Whether `text` is a sweep and not a scenario, by the keys that only a sweep has.
pub fn is_sweep(text: &str) -> bool {
    let (table, _) = DeTable::parse_recoverable(text);
    ["scenario", "axes"].iter().any(|key| table.get_ref().contains_key(*key))
}

impl Draft {
    /// Reads the sweep file `text`; `place` is its path, for messages.
    ///
    /// # Errors
    /// Every mistake, each with file and line.
    pub fn parse(place: &str, text: &str) -> Result<Self, Vec<SweepProblem>> {
        let table = DeTable::parse(text).map_err(|error| {
            let line = line_of(text, error.span().unwrap_or(0..0));
            vec![SweepProblem::new(format!("{place}:{line}"), error.message())]
        })?;
        let mut file = File {
            place,
            text,
            draft: Self { place: place.to_owned(), ..Self::default() },
            problems: Vec::new(),
        };
        for (key, value) in table.get_ref() {
            file.take(key, value);
        }
        if file.problems.is_empty() { Ok(file.draft) } else { Err(file.problems) }
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
        if let Some(message) = definition.design.problem() {
            return Some(self.problem(message));
        }
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
                    axes.push(Axis { name: given.name.clone(), values, place: given.place.clone() })
                }
                Err(problem) => problems.push(problem),
            }
        }
        for given in &self.faults {
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
        let max =
            if self.precision.is_some() { self.seeds_max.unwrap_or(SEEDS_MAX.max(count)) } else { count };
        let first = self.first_seed.unwrap_or(1);
        let problem = if count == 0 {
            Some("seeds must be at least 1".to_owned())
        } else if max < count {
            Some(format!("seeds_max = {max} is below seeds = {count}"))
        } else if first.checked_add(max).is_none_or(|end| end > i64::MAX.cast_unsigned()) {
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

/// A sweep file that is being read.
struct File<'a> {
    place: &'a str,
    text: &'a str,
    draft: Draft,
    problems: Vec<SweepProblem>,
}

type Value<'a> = Spanned<DeValue<'a>>;

impl File<'_> {
    fn place(&self, span: Range<usize>) -> String {
        format!("{}:{}", self.place, line_of(self.text, span))
    }

    fn refuse(&mut self, span: Range<usize>, message: String) {
        let place = self.place(span);
        self.problems.push(SweepProblem::new(place, message));
    }

    fn take(&mut self, key: &Spanned<std::borrow::Cow<'_, str>>, value: &Value<'_>) {
        match key.get_ref().as_ref() {
            "name" => self.draft.name = self.text(key.get_ref(), value),
            "description" => self.draft.description = self.text(key.get_ref(), value),
            "scenario" => self.draft.scenario = self.text(key.get_ref(), value),
            "combination" => {
                self.draft.combination = self.choice(key.get_ref(), value, "grid, zip or one-at-a-time")
            }
            "sampling" => {
                self.draft.sampling = self.choice(key.get_ref(), value, "independent or latin-hypercube")
            }
            "samples" => self.draft.samples = self.whole(key.get_ref(), value),
            "sampling_seed" => self.draft.sampling_seed = self.whole(key.get_ref(), value),
            "seeds" => self.draft.seeds = self.whole(key.get_ref(), value),
            "first_seed" => self.draft.first_seed = self.whole(key.get_ref(), value),
            "seeds_max" => self.draft.seeds_max = self.whole(key.get_ref(), value),
            "precision" => self.draft.precision = self.number(key.get_ref(), value),
            "set" => self.draft.set = self.table(key.get_ref(), value),
            "axes" => self.draft.axes = self.table(key.get_ref(), value),
            "faults" => self.draft.faults = self.sentences(value),
            unknown => {
                let message = format!("{unknown}: no such key; the keys of a sweep are {KEYS}");
                self.refuse(key.span(), message);
            }
        }
    }

    fn text(&mut self, key: &str, value: &Value<'_>) -> Option<String> {
        let text = value.get_ref().as_str().map(ToOwned::to_owned);
        if text.is_none() {
            self.refuse(value.span(), format!("{key}: give a text in quotes"));
        }
        text
    }

    fn choice<T: serde::de::DeserializeOwned>(
        &mut self,
        key: &str,
        value: &Value<'_>,
        choices: &str,
    ) -> Option<T> {
        let chosen = value.get_ref().as_str().and_then(|text| serde_json::from_value(text.into()).ok());
        if chosen.is_none() {
            self.refuse(value.span(), format!("{key}: give {choices}"));
        }
        chosen
    }

    fn whole(&mut self, key: &str, value: &Value<'_>) -> Option<u64> {
        let number = value
            .get_ref()
            .as_integer()
            .and_then(|number| u64::from_str_radix(number.as_str(), number.radix()).ok());
        if number.is_none() {
            self.refuse(value.span(), format!("{key}: give a whole number from 0"));
        }
        number
    }

    fn number(&mut self, key: &str, value: &Value<'_>) -> Option<f64> {
        let number = value_text(value.get_ref()).parse().ok();
        if number.is_none() {
            self.refuse(value.span(), format!("{key}: give a number"));
        }
        number
    }

    /// The keys of a table with their values. `control.law` without quotes is a table in a table, and means the same.
    fn table(&mut self, key: &str, value: &Value<'_>) -> Vec<Given> {
        let DeValue::Table(table) = value.get_ref() else {
            self.refuse(value.span(), format!("{key}: give a section, such as [{key}]"));
            return Vec::new();
        };
        let mut given = Vec::new();
        self.flatten("", table, &mut given);
        // A table of TOML has no order, so restore that of the file.
        given.sort_by_key(|(position, _)| *position);
        given.into_iter().map(|(_, given)| given).collect()
    }

    fn flatten(&self, before: &str, table: &DeTable<'_>, given: &mut Vec<(usize, Given)>) {
        for (key, value) in table {
            let name = if before.is_empty() {
                key.get_ref().to_string()
            } else {
                format!("{before}.{}", key.get_ref())
            };
            let text = match value.get_ref() {
                DeValue::Table(inner) => {
                    self.flatten(&name, inner, given);
                    continue;
                }
                DeValue::Array(items) => {
                    Text::List(items.iter().map(|item| value_text(item.get_ref())).collect())
                }
                other => Text::One(value_text(other)),
            };
            given.push((key.span().start, Given { name, text, place: self.place(key.span()) }));
        }
    }

    fn sentences(&mut self, value: &Value<'_>) -> Vec<Given> {
        let DeValue::Array(items) = value.get_ref() else {
            self.refuse(
                value.span(),
                "faults: give a list of sentences, such as [\"at 30 s kill uav 3\"]".into(),
            );
            return Vec::new();
        };
        let mut sentences = Vec::new();
        for item in items {
            match item.get_ref().as_str() {
                Some(text) => sentences.push(Given::new("", text, &self.place(item.span()))),
                None => self.refuse(item.span(), "faults: give each as a sentence in quotes".into()),
            }
        }
        sentences
    }
}

/// A value as `--set` takes it.
fn value_text(value: &DeValue<'_>) -> String {
    match value {
        DeValue::String(text) => text.to_string(),
        DeValue::Integer(number) => number.to_string(),
        DeValue::Float(number) => number.as_str().to_owned(),
        DeValue::Boolean(truth) => truth.to_string(),
        DeValue::Datetime(date) => date.to_string(),
        DeValue::Array(items) => {
            format!(
                "[{}]",
                items.iter().map(|item| value_text(item.get_ref())).collect::<Vec<_>>().join(", ")
            )
        }
        DeValue::Table(table) => {
            let member = |(key, value): (&Spanned<std::borrow::Cow<'_, str>>, &Value<'_>)| {
                format!("{} = {}", key.get_ref(), value_text(value.get_ref()))
            };
            format!("{{ {} }}", table.iter().map(member).collect::<Vec<_>>().join(", "))
        }
    }
}

/// The line of a position, from 1.
fn line_of(text: &str, span: Range<usize>) -> usize {
    text.bytes().take(span.start).filter(|byte| *byte == b'\n').count() + 1
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
