//! The rows of a sweep, put together cell by cell.
//!
//! Never keeps more rows in memory than those of one cell, apart from a few of each cell that people will look at, and
//! apart from sweeps with random axes.

use super::{definition::Definition, design::Axis, row::Row, values::Values};
use crate::{
    figure::{Better, FIGURES, Figure},
    statistics::{Share, quantile, wilson},
};
use std::{collections::HashMap, mem};

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

/// Takes rows one by one and puts them together. The values of random axes are put into bins, and cells of the same bins
/// together.
pub struct CellFold<'a> {
    axes: &'a [Axis],
    figures: &'a [&'a Figure],
    is_binned: bool,
    cells: Vec<Cell>,
    /// The rows of the current cell; with bins, those of each.
    open: Vec<Vec<Row>>,
    /// Where the rows of each bin are.
    bins: HashMap<Vec<String>, usize>,
}

impl<'a> CellFold<'a> {
    /// The cells of this sweep, with the spread of these figures.
    pub fn new(definition: &'a Definition, figures: &'a [&'a Figure]) -> Self {
        let axes = &definition.design.axes;
        Self {
            axes,
            figures,
            is_binned: axes.iter().any(Axis::is_drawn),
            cells: Vec::new(),
            open: Vec::new(),
            bins: HashMap::new(),
        }
    }

    /// Takes the next row. Rows come sorted by cell.
    pub fn take(&mut self, row: &Row) {
        if self.is_binned {
            return self.take_into_bin(row.clone());
        }
        // Rows come sorted, so a new cell number means that the previous cell is complete and frees its rows.
        if self.open.first().and_then(|rows| rows.last()).is_some_and(|last| last.cell != row.cell) {
            self.close();
        }
        if self.open.is_empty() {
            self.open.push(Vec::new());
        }
        self.open[0].push(row.clone());
    }

    /// Rows of one bin are anywhere among the others, so all stay open.
    fn take_into_bin(&mut self, mut row: Row) {
        for (value, axis) in row.values.iter_mut().zip(self.axes) {
            if let Values::Drawn(distribution) = &axis.values {
                // Drawn values hardly ever repeat: without bins nearly every flight would be a cell of its own.
                *value = distribution.bin(value);
            }
        }
        let open = &mut self.open;
        // `open` keeps the bins in the order of their first rows; the order of the map would differ between runs.
        let place = *self.bins.entry(row.values.clone()).or_insert_with(|| {
            open.push(Vec::new());
            open.len() - 1
        });
        self.open[place].push(row);
    }

    fn close(&mut self) {
        for rows in mem::take(&mut self.open) {
            let kept = kept(self.cells.len());
            self.cells.push(summarize(rows, self.figures, kept));
        }
    }

    /// The cells.
    pub fn finish(mut self) -> Vec<Cell> {
        self.close();
        self.cells
    }
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
    // `truncate` keeps the capacity, which would hold the memory of all rows of the cell.
    rows.shrink_to_fit();
    Cell { cell, values, flights, passed, figures, kept: rows }
}

fn spread(rows: &[Row], figure: &Figure) -> Spread {
    // A row stores its figures in the order of `FIGURES`, not in that of the sweep.
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
    use crate::sweep::{Draft, row::tests::row};
    use ringwing_recorder::metrics::Verdict;

    /// The cells of a sweep over one axis with these values.
    fn cells(values: &str, rows: &[Row], figures: &[&Figure]) -> Vec<Cell> {
        let text = format!("scenario = \"paper-4.1\"\n[axes]\nleader.speed_m_s = {values}");
        let sweep = Draft::parse("x", &text).unwrap();
        let sweep = Draft { samples: values.contains("uniform").then_some(9), ..sweep }.finish().unwrap();
        let mut fold = CellFold::new(&sweep, figures);
        for row in rows {
            fold.take(row);
        }
        fold.finish()
    }

    #[test]
    fn random_values_are_put_into_bins() {
        let rows = [
            row(0, 1, "1.05", Verdict::Passed),
            row(1, 1, "2.9", Verdict::Passed),
            row(2, 1, "1.2", Verdict::Failed),
        ];
        let cells = cells("\"uniform 1 .. 3\"", &rows, &[]);
        let flights: Vec<_> =
            cells.iter().map(|cell| (cell.values[0].as_str(), cell.flights, cell.passed)).collect();
        assert_eq!(flights, [("1.12", 2, 1), ("2.88", 1, 1)]);
    }

    #[test]
    fn rows_become_cells_with_shares_and_spreads() {
        let verdict = |seed| if seed == 3 { Verdict::Violated } else { Verdict::Passed };
        let mut rows: Vec<Row> = (1..=4).map(|seed| row(0, seed, "0.1", verdict(seed))).collect();
        let mut last = row(2, 1, "0.3", Verdict::Failed);
        last.figures[0] = None;
        rows.push(last);
        let settling = Figure::named("settling_s").unwrap();
        let recovery = Figure::named("recovery_max_s").unwrap();
        let cells = cells("[0.1, 0.2, 0.3]", &rows, &[settling, recovery]);
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
