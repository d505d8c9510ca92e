//! Reads a sweep file into a draft.
//!
//! Never stops at the first mistake, unless the text is not TOML.

use super::{
    definition::SweepProblem,
    draft::{Draft, Given, Text},
    preset,
};
use ringwing_scenario::Source;
use std::{borrow::Cow, ops::Range};
use toml::{
    Spanned,
    de::{DeTable, DeValue},
};

/// The keys of a sweep file, for messages.
const KEYS: &str = "name, description, scenario, set, faults, axes, combination, sampling, samples, sampling_seed, seeds, \
                    first_seed, precision, seeds_max";

/// Whether `text` is a sweep and not a scenario, by the keys that only a sweep has.
fn is_sweep(text: &str) -> bool {
    let (table, _) = DeTable::parse_recoverable(text);
    ["scenario", "axes"].iter().any(|key| table.get_ref().contains_key(*key))
}

impl Draft {
    /// What `name` begins: a built-in sweep, a sweep file, or a scenario to which axes are added.
    ///
    /// # Errors
    /// There is nothing of this name, or every mistake in the file.
    pub fn named(name: &str) -> Result<Self, Vec<SweepProblem>> {
        if let Some(preset) = preset::named(name) {
            return Self::parse(name, preset.text);
        }
        let source = Source::find(name).map_err(|error| vec![error.into()])?;
        // A sweep and a scenario are both files of TOML, and only a sweep names a scenario or axes.
        if is_sweep(&source.text) {
            return Self::parse(name, &source.text);
        }
        Ok(Self { scenario: Some(name.to_owned()), place: name.to_owned(), ..Self::default() })
    }

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

    fn take(&mut self, key: &Spanned<Cow<'_, str>>, value: &Value<'_>) {
        match key.get_ref().as_ref() {
            "name" => self.draft.name = self.text(key.get_ref(), value),
            "description" => self.draft.description = self.text(key.get_ref(), value),
            "scenario" => self.draft.scenario = self.text(key.get_ref(), value),
            "combination" => {
                self.draft.combination = self.choice(key.get_ref(), value, "grid, zip or one-at-a-time");
            }
            "sampling" => {
                self.draft.sampling = self.choice(key.get_ref(), value, "independent or latin-hypercube");
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
        // The names are those that `sweep.json` has, so there is no second list of them that could differ.
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
        // By its text, so that a whole number will do as well.
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
            let member = |(key, value): (&Spanned<Cow<'_, str>>, &Value<'_>)| {
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
