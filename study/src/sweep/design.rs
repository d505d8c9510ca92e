//! Which values each cell of a sweep has: grids, zips, one axis at a time, and random draws.
//!
//! Cells are numbered, and the number alone decides the values, so nobody has to hold all cells in memory, and every
//! shard of a sweep has the same cells.

use super::values::{Distribution, Values};
use ringwing_flight::draw::Draws;
use serde::{Deserialize, Serialize};

/// Separates these draws from those of flights ("design" in ASCII). Another value gives other samples.
const PURPOSE: u64 = 0x6465_7369_676e;

/// How the values of listed axes are combined.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Combination {
    /// Every value with every other.
    #[default]
    Grid,
    /// The first values of all axes, then the second ones, and so on.
    Zip,
    /// The first values of all axes, and then each axis in turn with its others at their first values.
    OneAtATime,
}

/// How random axes are drawn.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Sampling {
    /// Each draw by itself.
    #[default]
    Independent,
    /// A Latin hypercube: each axis is cut into as many slices of equal probability as there are samples, and each slice
    /// has one sample.
    LatinHypercube,
}

/// An axis of a sweep.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Axis {
    /// A key of the scenario, or a name that fault sentences use in braces.
    pub name: String,
    /// Its values.
    pub values: Values,
    /// Where it was written, for messages.
    #[serde(skip)]
    pub place: String,
}

impl Axis {
    /// The listed values; empty for a random axis.
    pub fn listed(&self) -> &[String] {
        match &self.values {
            Values::Listed(values) => values,
            Values::Drawn(_) => &[],
        }
    }

    /// Whether its values are random draws.
    pub fn is_drawn(&self) -> bool {
        matches!(self.values, Values::Drawn(_))
    }
}

/// The cells of a sweep.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Design {
    /// The axes, in the order of the columns.
    pub axes: Vec<Axis>,
    /// How listed axes are combined.
    pub combination: Combination,
    /// How random axes are drawn.
    pub sampling: Sampling,
    /// Number of samples of the random axes, at each combination of the listed ones; 1 if no axis is random.
    pub samples: u64,
    /// Seed of the samples.
    pub seed: u64,
}

impl Design {
    /// What makes the design impossible, if anything does.
    pub fn problem(&self) -> Option<String> {
        let listed: Vec<_> = self.axes.iter().filter(|axis| !axis.is_drawn()).collect();
        if self.combination == Combination::Zip
            && let Some(pair) =
                listed.windows(2).find(|pair| pair[0].listed().len() != pair[1].listed().len())
        {
            let [one, other] =
                [pair[0], pair[1]].map(|axis| format!("{} has {}", axis.name, axis.listed().len()));
            return Some(format!("a zip needs axes with the same number of values, and {one} while {other}"));
        }
        match (self.axes.iter().any(Axis::is_drawn), self.samples) {
            (_, 0) => Some("samples must be at least 1".into()),
            // With one sample there is one slice, the whole range, so the hypercube would be an ordinary draw.
            (true, 1) if self.sampling == Sampling::LatinHypercube => {
                Some("a Latin hypercube needs more than one sample: give samples = 100".into())
            }
            // Without a random axis, all samples of a combination would be the same cell.
            (false, 2..) => Some("samples need a random axis, such as \"uniform 0 .. 2\"".into()),
            _ => None,
        }
    }

    /// Number of cells; `None` if it does not fit 64 bits.
    pub fn cells(&self) -> Option<u64> {
        self.points()?.checked_mul(self.samples)
    }

    /// Number of combinations of the listed axes.
    fn points(&self) -> Option<u64> {
        let mut sizes =
            self.axes.iter().filter(|axis| !axis.is_drawn()).map(|axis| axis.listed().len() as u64);
        match self.combination {
            Combination::Grid => sizes.try_fold(1, |product: u64, size| product.checked_mul(size)),
            Combination::Zip => Some(sizes.next().unwrap_or(1)),
            // All axes share the combination of first values, so each adds one less than it has values.
            Combination::OneAtATime => Some(1 + sizes.map(|size| size - 1).sum::<u64>()),
        }
    }

    /// The values of the cell with this number, one for each axis.
    pub fn values(&self, cell: u64) -> Vec<String> {
        // A draw depends on the sample and not on the combination, so all combinations are compared at the same drawn
        // values.
        let (point, sample) = (cell / self.samples, cell % self.samples);
        let mut listed = self.indices(point).into_iter();
        let value = |(place, axis): (usize, &Axis)| match &axis.values {
            Values::Listed(values) => values[listed.next().unwrap_or_default()].clone(),
            Values::Drawn(distribution) => self.draw(place, *distribution, sample),
        };
        self.axes.iter().enumerate().map(value).collect()
    }

    /// Which value each listed axis has at this combination.
    fn indices(&self, point: u64) -> Vec<usize> {
        let sizes: Vec<u64> =
            self.axes.iter().filter(|axis| !axis.is_drawn()).map(|axis| axis.listed().len() as u64).collect();
        match self.combination {
            Combination::Grid => digits(point, &sizes),
            Combination::Zip => vec![point as usize; sizes.len()],
            Combination::OneAtATime => one_off(point, &sizes),
        }
    }

    fn draw(&self, axis: usize, distribution: Distribution, sample: u64) -> String {
        // The 1 separates these draws from the rounds of `permuted`, which count from 2: shared draws would tie each
        // sample's slice to its place in the slice.
        let u = Draws::new(self.seed, [PURPOSE, axis as u64, 1], sample).uniform();
        match self.sampling {
            Sampling::Independent => distribution.at(u),
            Sampling::LatinHypercube => {
                let slice = permuted(self.seed, axis as u64, sample, self.samples);
                distribution.at((slice as f64 + u) / self.samples as f64)
            }
        }
    }
}

/// `number` in the mixed base of `sizes`; the last digit changes fastest.
fn digits(mut number: u64, sizes: &[u64]) -> Vec<usize> {
    let mut digits: Vec<usize> = Vec::with_capacity(sizes.len());
    for size in sizes.iter().rev() {
        digits.push((number % size) as usize);
        number /= size;
    }
    digits.reverse();
    digits
}

/// The combination `point` of one axis at a time: 0 is the first value of every axis.
fn one_off(point: u64, sizes: &[u64]) -> Vec<usize> {
    let mut indices = vec![0; sizes.len()];
    let mut left = point;
    for (index, size) in indices.iter_mut().zip(sizes) {
        // The first value of an axis belongs to combination 0, so each axis takes up one number less than it has
        // values.
        if left < *size {
            *index = left as usize;
            break;
        }
        left -= size - 1;
    }
    indices
}

/// Where `place` goes in a random permutation of `count` places.
///
/// A Feistel network on the bits of the place: unlike a shuffled list it needs no memory, and any place of a sweep of
/// millions can be computed alone. Places that fall outside go round again until they fall inside.
fn permuted(seed: u64, axis: u64, place: u64, count: u64) -> u64 {
    // Three rounds suffice for wide blocks (Luby and Rackoff 1988), but a small sweep has only a few bits to mix. More
    // only cost time. Another number gives other samples.
    const ROUNDS: u64 = 6;
    // Half the bits of the largest place, rounded up, so that both halves together cover it.
    let half = (64 - count.saturating_sub(1).leading_zeros()).div_ceil(2).max(1);
    let mask = (1_u64 << half) - 1;
    let mix = |round: u64, right: u64| {
        (Draws::new(seed, [PURPOSE, axis, 2 + round], right).uniform() * (mask + 1) as f64) as u64
    };
    let mut at = place;
    loop {
        for round in 0..ROUNDS {
            let (left, right) = (at >> half, at & mask);
            at = (right << half) | (left ^ mix(round, right));
        }
        if at < count {
            return at;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sweep::values;
    use std::collections::BTreeSet;

    fn design(combination: Combination, axes: &[(&str, &str)]) -> Design {
        let axis = |(name, text): &(&str, &str)| Axis {
            name: (*name).to_owned(),
            values: values::parse(text).unwrap(),
            place: String::new(),
        };
        Design {
            axes: axes.iter().map(axis).collect(),
            combination,
            sampling: Sampling::Independent,
            samples: 1,
            seed: 1,
        }
    }

    fn all(design: &Design) -> Vec<String> {
        (0..design.cells().unwrap()).map(|cell| design.values(cell).join(" ")).collect()
    }

    #[test]
    fn a_grid_has_every_combination_and_the_last_axis_changes_fastest() {
        let grid = design(Combination::Grid, &[("a", "1, 2"), ("b", "x, y, z")]);
        assert_eq!(all(&grid), ["1 x", "1 y", "1 z", "2 x", "2 y", "2 z"]);
        assert_eq!(all(&design(Combination::Grid, &[])), [""]);
    }

    #[test]
    fn a_zip_goes_along_all_axes_at_once() {
        let zip = design(Combination::Zip, &[("a", "1, 2"), ("b", "x, y")]);
        assert_eq!(all(&zip), ["1 x", "2 y"]);
        assert!(
            design(Combination::Zip, &[("a", "1"), ("b", "x, y")]).problem().unwrap().contains("same number")
        );
    }

    #[test]
    fn one_at_a_time_leaves_all_other_axes_at_their_first_values() {
        let design = design(Combination::OneAtATime, &[("a", "1, 2, 3"), ("b", "x, y"), ("c", "t")]);
        assert_eq!(all(&design), ["1 x t", "2 x t", "3 x t", "1 y t"]);
    }

    #[test]
    fn a_latin_hypercube_has_one_sample_in_each_slice_of_each_axis() {
        let mut design = design(Combination::Grid, &[("a", "uniform 0 .. 1"), ("b", "uniform 10 .. 20")]);
        (design.sampling, design.samples) = (Sampling::LatinHypercube, 37);
        for (axis, (low, size)) in [(0.0, 1.0), (10.0, 10.0)].into_iter().enumerate() {
            let slice = |cell| {
                let value: f64 = design.values(cell)[axis].parse().unwrap();
                ((value - low) / size * 37.0) as u32
            };
            let slices: BTreeSet<u32> = (0..37).map(slice).collect();
            assert_eq!(slices.len(), 37);
        }
        let both: Vec<_> = (0..37).map(|cell| permuted(1, 0, cell, 37) == permuted(1, 1, cell, 37)).collect();
        assert!(both.iter().filter(|same| **same).count() < 10, "the axes are shuffled alike");
    }

    #[test]
    fn random_axes_are_drawn_anew_for_each_sample_and_alike_at_each_combination() {
        let mut design = design(Combination::Grid, &[("law", "paper, resilient"), ("d", "uniform 0 .. 1")]);
        design.samples = 5;
        let cells = all(&design);
        assert_eq!(cells.iter().collect::<BTreeSet<_>>().len(), 10);
        assert_eq!(cells[0].replace("paper", "resilient"), cells[5]);
    }

    #[test]
    fn a_sweep_of_too_many_cells_has_no_number_of_cells() {
        let axes: Vec<(&str, &str)> = (0..4).map(|_| ("a", "1 .. 100000")).collect();
        assert_eq!(design(Combination::Grid, &axes).cells(), None);
    }
}
