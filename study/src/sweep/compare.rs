//! Which cells of two sweeps differ by more than chance: law against law, build against build.
//!
//! Many cells are compared at once, and some differ by chance alone, so the probabilities are adjusted: among the cells
//! that are reported, the expected share of false ones is at most the asked one. Never reads a file.

use super::cells::Cell;
use crate::statistics::{benjamini_hochberg, fisher};

/// Two cells with the same values of the common axes.
#[derive(Debug, Clone)]
pub struct Difference {
    /// The values of the common axes.
    pub values: Vec<String>,
    /// Flights that passed, and all, on the first side.
    pub one: (u64, u64),
    /// The same on the second side.
    pub other: (u64, u64),
    /// How probable such a difference is by chance, by Fisher's exact test.
    pub probability: f64,
    /// The same, adjusted for the number of cells after Benjamini and Hochberg.
    pub adjusted: f64,
}

impl Difference {
    /// By how much the second side passes more often.
    pub fn gain(&self) -> f64 {
        let share = |(passed, all): (u64, u64)| if all > 0 { passed as f64 / all as f64 } else { 0.0 };
        share(self.other) - share(self.one)
    }
}

/// One side of a comparison.
#[derive(Debug, Clone, Copy)]
pub struct Side<'a> {
    /// Its cells.
    pub cells: &'a [Cell],
    /// Which of its axes are compared, in the order of the other side.
    pub axes: &'a [usize],
}

/// Compares the cells that both sides have, in the order of the first side. Cells of one side with the same values are
/// counted together.
pub fn compare(one: Side, other: Side) -> Vec<Difference> {
    let (one, other) = (counted(one), counted(other));
    let mut differences: Vec<Difference> = one
        .into_iter()
        .filter_map(|(values, passed, all)| {
            let (_, other_passed, other_all) = other.iter().find(|(key, ..)| *key == values)?;
            let probability = fisher(passed, all, *other_passed, *other_all);
            let (one, other) = ((passed, all), (*other_passed, *other_all));
            // The adjustment depends on the probabilities of all cells, so the last field is only filled in below.
            Some(Difference { values, one, other, probability, adjusted: 1.0 })
        })
        .collect();
    let probabilities: Vec<f64> = differences.iter().map(|difference| difference.probability).collect();
    for (difference, adjusted) in differences.iter_mut().zip(benjamini_hochberg(&probabilities)) {
        difference.adjusted = adjusted;
    }
    differences
}

/// The values of the compared axes, with flights that passed and all flights.
fn counted(side: Side) -> Vec<(Vec<String>, u64, u64)> {
    // The map only finds the places: its own order is random, and the list keeps the order of the cells.
    let mut counted: Vec<(Vec<String>, u64, u64)> = Vec::new();
    let mut places = std::collections::HashMap::new();
    for cell in side.cells {
        let values: Vec<String> = side.axes.iter().map(|axis| cell.values[*axis].clone()).collect();
        let place = *places.entry(values.clone()).or_insert_with(|| {
            counted.push((values, 0, 0));
            counted.len() - 1
        });
        counted[place].1 += cell.passed;
        counted[place].2 += cell.flights;
    }
    counted
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cell(law: &str, delay: &str, passed: u64) -> Cell {
        let values = vec![law.to_owned(), delay.to_owned()];
        Cell { cell: 0, values, flights: 20, passed, figures: Vec::new(), kept: Vec::new() }
    }

    #[test]
    fn only_cells_that_differ_by_more_than_chance_stand_out() {
        let paper: Vec<_> =
            [("0", 20), ("0.5", 1), ("1", 0), ("2", 10)].map(|(d, p)| cell("paper", d, p)).into();
        let resilient: Vec<_> =
            [("0", 20), ("0.5", 19), ("1", 1), ("9", 0)].map(|(d, p)| cell("resilient", d, p)).into();
        let side = |cells| Side { cells, axes: &[1] };
        let differences = compare(side(&paper), side(&resilient));
        assert_eq!(differences.len(), 3, "only cells of both sides");
        let found: Vec<_> = differences
            .iter()
            .filter(|difference| difference.adjusted <= 0.05)
            .map(|one| one.values[0].as_str())
            .collect();
        assert_eq!(found, ["0.5"]);
        assert!((differences[1].gain() - 0.9).abs() < 1e-12);
        assert!(differences[1].adjusted >= differences[1].probability);
    }

    #[test]
    fn cells_with_the_same_values_of_the_compared_axes_count_together() {
        let cells = [cell("a", "1", 3), cell("b", "1", 4)];
        let side = Side { cells: &cells, axes: &[1] };
        assert_eq!(compare(side, side)[0].one, (7, 40));
    }
}
