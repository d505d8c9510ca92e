//! One row of results: a flight with its axes, its seed, every figure, and the verdict.
//!
//! Never opens a file. A row is text in CSV and typed columns in Parquet; both have the same columns in the same order.

use super::{definition::Definition, ledger::FlightId};
use crate::{
    figure::{FIGURES, Figure},
    flight::Outcome,
};
use ringwing_recorder::metrics::Verdict;
use std::sync::Arc;

/// Columns before the axes.
const BEFORE: [&str; 2] = ["cell", "seed"];
/// Columns between the axes and the figures.
const VERDICT: [&str; 2] = ["verdict", "violated"];
/// Columns after the figures.
const AFTER: [&str; 2] = ["payload_hash", "failure"];
/// Separates the violated requirements. It is in no key, and no program takes it for the end of a field.
const SEPARATOR: char = ' ';

/// The columns of a sweep's results.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Columns {
    /// Names of the axes.
    pub axes: Arc<[String]>,
}

impl Columns {
    /// The columns of this sweep.
    pub fn of(definition: &Definition) -> Self {
        Self { axes: definition.design.axes.iter().map(|axis| axis.name.clone()).collect() }
    }

    /// The names of all columns, in order.
    pub fn names(&self) -> Vec<&str> {
        let figures = FIGURES.iter().map(|figure| figure.name);
        let axes = self.axes.iter().map(String::as_str);
        BEFORE.into_iter().chain(axes).chain(VERDICT).chain(figures).chain(AFTER).collect()
    }

    /// The name of an axis that is also the name of another column, if there is one.
    pub fn ambiguous(&self) -> Option<&str> {
        let is_other = |name: &&String| {
            BEFORE.iter().chain(&VERDICT).chain(&AFTER).any(|column| column == *name)
                || Figure::named(name).is_some()
        };
        self.axes.iter().find(is_other).map(String::as_str)
    }
}

/// A flight of a sweep.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Number of its cell.
    pub cell: u64,
    /// Its seed.
    pub seed: u64,
    /// The values of the axes.
    pub values: Vec<String>,
    /// The verdict.
    pub verdict: Verdict,
    /// The keys of the violated requirements.
    pub violated: Vec<String>,
    /// The figures, in the order of [`FIGURES`].
    pub figures: Vec<Option<f64>>,
    /// Hash of all payloads.
    pub payload_hash: Option<String>,
    /// Why the flight could not be flown, if it could not.
    pub failure: Option<String>,
}

impl Row {
    /// The row of a flight with this outcome, or of one that could not be flown.
    pub fn new(definition: &Definition, flight: FlightId, outcome: &Result<Outcome, String>) -> Self {
        let flown = outcome.as_ref().ok();
        Self {
            cell: flight.cell,
            seed: definition.seeds.first + flight.index,
            values: definition.design.values(flight.cell),
            verdict: flown.map_or(Verdict::Failed, |outcome| outcome.verdict),
            violated: flown
                .map_or_else(Vec::new, |outcome| outcome.violated().map(ToOwned::to_owned).collect()),
            figures: FIGURES.iter().map(|figure| flown.and_then(|outcome| figure.of(outcome))).collect(),
            payload_hash: flown.and_then(|outcome| outcome.payload_hash().map(ToOwned::to_owned)),
            // A line break would split the row: whoever reads the file takes every line for a row.
            failure: outcome.as_ref().err().map(|why| why.replace(['\n', '\r'], " ")),
        }
    }

    /// Whether the flight passed.
    pub fn passed(&self) -> bool {
        self.verdict == Verdict::Passed
    }

    /// The value of a figure.
    pub fn figure(&self, name: &str) -> Option<f64> {
        let place = FIGURES.iter().position(|figure| figure.name == name)?;
        self.figures.get(place).copied().flatten()
    }

    /// The fields of its line of CSV, in the order of the columns. A value that does not exist is an empty field.
    pub fn fields(&self) -> Vec<String> {
        // `to_string` writes the shortest text that reads back as the same number.
        let figures =
            self.figures.iter().map(|value| value.map_or_else(String::new, |value| value.to_string()));
        let mut fields = vec![self.cell.to_string(), self.seed.to_string()];
        fields.extend(self.values.iter().cloned());
        fields.extend([self.verdict.name().to_owned(), self.violated.join(&SEPARATOR.to_string())]);
        fields.extend(figures);
        fields.extend([
            self.payload_hash.clone().unwrap_or_default(),
            self.failure.clone().unwrap_or_default(),
        ]);
        fields
    }

    /// The row of these fields, or `None` if they are not a whole row of a sweep with `columns`.
    pub fn parse<'a>(columns: &Columns, fields: impl Iterator<Item = &'a str>) -> Option<Self> {
        let fields: Vec<&str> = fields.collect();
        if fields.len() != BEFORE.len() + columns.axes.len() + VERDICT.len() + FIGURES.len() + AFTER.len() {
            return None;
        }
        // The number of fields is checked above, because `split_at` panics if there are too few.
        let (before, rest) = fields.split_at(BEFORE.len());
        let (values, rest) = rest.split_at(columns.axes.len());
        let (verdict, rest) = rest.split_at(VERDICT.len());
        let (figures, after) = rest.split_at(FIGURES.len());
        let present = |text: &str| (!text.is_empty()).then(|| text.to_owned());
        Some(Self {
            cell: before[0].parse().ok()?,
            seed: before[1].parse().ok()?,
            values: values.iter().map(ToString::to_string).collect(),
            verdict: verdict_named(verdict[0])?,
            violated: verdict[1].split_whitespace().map(ToOwned::to_owned).collect(),
            figures: figures.iter().map(|text| number(text)).collect::<Option<_>>()?,
            payload_hash: present(after[0]),
            failure: present(after[1]),
        })
    }
}

/// An empty field is an absent number; `None` if the text is not a number.
#[expect(clippy::option_option, reason = "a wrong field and an absent number are different things")]
fn number(text: &str) -> Option<Option<f64>> {
    if text.is_empty() { Some(None) } else { text.parse().ok().map(Some) }
}

fn verdict_named(name: &str) -> Option<Verdict> {
    [Verdict::Passed, Verdict::Violated, Verdict::Failed].into_iter().find(|verdict| verdict.name() == name)
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A row of a sweep over one axis.
    pub(crate) fn row(cell: u64, seed: u64, value: &str, verdict: Verdict) -> Row {
        let mut figures = vec![None; FIGURES.len()];
        (figures[0], figures[2]) = (Some(12.5 + seed as f64), Some(0.1));
        Row {
            cell,
            seed,
            values: vec![value.to_owned()],
            verdict,
            violated: if verdict == Verdict::Violated { vec!["separation_min_m".into()] } else { Vec::new() },
            figures,
            payload_hash: Some(format!("{cell:016x}{seed:016x}")),
            failure: None,
        }
    }

    pub(crate) fn columns() -> Columns {
        Columns { axes: ["delay".to_owned()].into() }
    }

    #[test]
    fn a_row_reads_back_as_it_was_written() {
        let mut row = row(7, 3, "a, \"b\"", Verdict::Violated);
        row.violated.push("collisions_max".into());
        row.figures[1] = Some(0.1 + 0.2);
        row.failure = Some("no room".into());
        let fields = row.fields();
        assert_eq!(fields.len(), columns().names().len());
        assert_eq!(Row::parse(&columns(), fields.iter().map(String::as_str)), Some(row));
    }

    #[test]
    fn a_torn_row_is_not_a_row() {
        let fields = row(7, 3, "1", Verdict::Passed).fields();
        let parse = |fields: &[String]| Row::parse(&columns(), fields.iter().map(String::as_str));
        assert_eq!(parse(&fields[..fields.len() - 1]), None);
        let mut wrong = fields;
        wrong[3] = "pas".into();
        assert_eq!(parse(&wrong), None);
    }

    #[test]
    fn an_axis_with_the_name_of_another_column_is_found() {
        assert_eq!(columns().ambiguous(), None);
        for name in ["seed", "verdict", "settling_s"] {
            assert_eq!(Columns { axes: [name.to_owned()].into() }.ambiguous(), Some(name));
        }
    }
}
