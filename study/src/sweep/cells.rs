//! The rows of a sweep, put together cell by cell.
//!
//! Never keeps more rows in memory than those of one cell, apart from a few of each cell that people will look at, and
//! apart from sweeps with random axes.

use super::{
    definition::Definition,
    design::Axis,
    results::{ResultsError, read_rows},
    row::{Columns, Row},
    values::Values,
};
use crate::{
    figure::{Better, FIGURES, Figure},
    statistics::{Share, quantile, wilson},
};
use std::{collections::HashMap, mem, path::Path};

/// Flights of a cell that are kept, those that did not pass first. More make the page of a large sweep slow to open.
const KEPT: usize = 12;
/// Cells of which flights are kept. With more, the page opens slowly and the flights fill the memory; the file of rows has
/// them all.
const KEPT_CELLS: usize = 4000;

/// A cell with what its flights have in common.
#[derive(Debug, Clone, PartialEq)]
pub struct Cell {
    /// Its number.
    pub cell: u64,
    /// The values of the axes.
    pub values: Vec<String>,
    /// Number of flights.
    pub flights: u64,
    /// Number of flights that passed.
    pub passed: u64,
    /// Median and 90th percentile of each figure that the sweep looks at; for a figure of which higher is better, the
    /// 10th percentile.
    pub figures: Vec<Spread>,
    /// Some of the flights.
    pub kept: Vec<Row>,
}

/// The spread of a figure over the flights of a cell. A flight without the figure counts as worse than all others, because
/// it never settled or never recovered; `None` if that decides the value, or if there is no flight.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spread {
    /// The median.
    pub median: Option<f64>,
    /// The value that only one flight in ten is worse than.
    pub bad: Option<f64>,
}

impl Cell {
    /// The share of flights that passed.
    pub fn success(&self) -> Share {
        wilson(self.passed, self.flights)
    }
}

/// Reads the sorted rows of `path`, cell by cell, with the spread of these figures. The values of random axes are put
/// into bins, and cells of the same bins together.
///
/// # Errors
/// The file cannot be read.
pub fn read_cells(
    path: &Path,
    definition: &Definition,
    figures: &[&Figure],
) -> Result<Vec<Cell>, ResultsError> {
    let columns = Columns::of(definition);
    if definition.design.axes.iter().any(Axis::is_drawn) {
        read_binned(path, definition, &columns, figures)
    } else {
        read_in_order(path, &columns, figures)
    }
}

/// Rows of the same bins are anywhere in the file, so all are kept at once.
fn read_binned(
    path: &Path,
    definition: &Definition,
    columns: &Columns,
    figures: &[&Figure],
) -> Result<Vec<Cell>, ResultsError> {
    let mut order: Vec<Vec<Row>> = Vec::new();
    let mut places = HashMap::new();
    read_rows(path, columns, |row| {
        let mut row = row.clone();
        for (value, axis) in row.values.iter_mut().zip(&definition.design.axes) {
            if let Values::Drawn(distribution) = &axis.values {
                *value = distribution.bin(value);
            }
        }
        let place = *places.entry(row.values.clone()).or_insert_with(|| {
            order.push(Vec::new());
            order.len() - 1
        });
        order[place].push(row);
    })?;
    let numbered = order.into_iter().enumerate();
    Ok(numbered.map(|(number, rows)| summarize(rows, figures, kept(number))).collect())
}

fn read_in_order(path: &Path, columns: &Columns, figures: &[&Figure]) -> Result<Vec<Cell>, ResultsError> {
    let mut cells = Vec::new();
    let mut rows: Vec<Row> = Vec::new();
    read_rows(path, columns, |row| {
        if rows.last().is_some_and(|last| last.cell != row.cell) {
            let kept = kept(cells.len());
            cells.push(summarize(mem::take(&mut rows), figures, kept));
        }
        rows.push(row.clone());
    })?;
    if !rows.is_empty() {
        let kept = kept(cells.len());
        cells.push(summarize(rows, figures, kept));
    }
    Ok(cells)
}

/// The number of flights that are kept of the cell at this place.
fn kept(place: usize) -> usize {
    if place < KEPT_CELLS { KEPT } else { 0 }
}

/// Puts the rows of one cell together, of which there is at least one, and keeps some of them.
fn summarize(mut rows: Vec<Row>, figures: &[&Figure], kept: usize) -> Cell {
    let figures = figures.iter().map(|figure| spread(&rows, figure)).collect();
    let passed = rows.iter().filter(|row| row.passed()).count() as u64;
    let flights = rows.len() as u64;
    let (cell, values) = (rows[0].cell, rows[0].values.clone());
    // The flights that people look at first are those that went wrong.
    rows.sort_by_key(|row| (row.passed(), row.seed));
    rows.truncate(kept);
    rows.shrink_to_fit();
    Cell { cell, values, flights, passed, figures, kept: rows }
}

fn spread(rows: &[Row], figure: &Figure) -> Spread {
    let place = FIGURES.iter().position(|other| other.name == figure.name);
    let value = |row: &Row| place.and_then(|place| row.figures[place]);
    // Without a single value the figure does not apply, such as the recovery in flights without faults.
    if rows.iter().all(|row| value(row).is_none()) {
        return Spread { median: None, bad: None };
    }
    let (worst, bad) = match figure.better {
        Better::Lower => (f64::INFINITY, 0.9),
        Better::Higher => (f64::NEG_INFINITY, 0.1),
    };
    let mut values: Vec<f64> = rows.iter().map(|row| value(row).unwrap_or(worst)).collect();
    let mut at = |share| quantile(&mut values, share).filter(|value| value.is_finite());
    Spread { median: at(0.5), bad: at(bad) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sweep::{
        results::RowFile,
        row::tests::{columns, row},
    };
    use ringwing_recorder::metrics::Verdict;

    #[test]
    fn rows_become_cells_with_shares_and_spreads() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("flights.csv");
        let mut file = RowFile::open(&path, columns(), |_| {}).unwrap();
        for seed in 1..=4 {
            let verdict = if seed == 3 { Verdict::Violated } else { Verdict::Passed };
            file.append(&row(0, seed, "0.1", verdict)).unwrap();
        }
        let mut last = row(2, 1, "0.3", Verdict::Failed);
        last.figures[0] = None;
        file.append(&last).unwrap();
        drop(file);
        let settling = Figure::named("settling_s").unwrap();
        let recovery = Figure::named("recovery_max_s").unwrap();
        let cells = read_in_order(&path, &columns(), &[settling, recovery]).unwrap();
        let [first, second] = cells.as_slice() else { panic!("{cells:?}") };
        assert_eq!((first.flights, first.passed, first.values[0].as_str()), (4, 3, "0.1"));
        assert_eq!(first.figures[0].median, Some(15.0));
        assert!((first.figures[0].bad.unwrap() - 16.2).abs() < 1e-9);
        assert_eq!(first.kept[0].seed, 3, "the flight that went wrong comes first");
        assert_eq!((second.cell, second.figures[0]), (2, Spread { median: None, bad: None }));
        assert_eq!(second.figures[1], Spread { median: None, bad: None });
    }

    #[test]
    fn a_flight_that_never_settled_is_worse_than_all_that_did() {
        let mut rows: Vec<Row> = (1..=3).map(|seed| row(0, seed, "x", Verdict::Passed)).collect();
        rows[0].figures[0] = None;
        let spread = spread(&rows, Figure::named("settling_s").unwrap());
        assert_eq!(spread, Spread { median: Some(15.5), bad: None });
    }
}
