//! What the repeats of a measurement say together, and whether two measurements differ.
//!
//! Must never treat repeats as certain: a figure comes with the range of its repeats, and a difference counts only if chance
//! makes it unlikely.

/// Highest probability with which chance alone may cause a difference that counts. Higher reports more differences, and more
/// of them are false.
pub(crate) const SIGNIFICANCE_LEVEL: f64 = 0.05;

/// A figure over repeats.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub(crate) struct Spread {
    /// The middle value, or the mean of the middle two.
    pub(crate) median: f64,
    /// The lowest value.
    pub(crate) least: f64,
    /// The highest value.
    pub(crate) most: f64,
    /// Number of values.
    pub(crate) repeats: usize,
}

impl Spread {
    /// The spread of all finite `values`; `None` without any finite value.
    pub(crate) fn of(values: &[f64]) -> Option<Self> {
        let mut sorted: Vec<f64> = values.iter().copied().filter(|value| value.is_finite()).collect();
        sorted.sort_by(f64::total_cmp);
        let (least, most) = (*sorted.first()?, *sorted.last()?);
        let at = |index: usize| sorted.get(index).copied().unwrap_or(most);
        // The two indices are equal for an odd number of values.
        let median = f64::midpoint(at((sorted.len() - 1) / 2), at(sorted.len() / 2));
        Some(Self { median, least, most, repeats: sorted.len() })
    }

    /// The spread of all values times `factor`, which is positive.
    pub(crate) fn times(self, factor: f64) -> Self {
        let Self { median, least, most, repeats } = self;
        Self { median: factor * median, least: factor * least, most: factor * most, repeats }
    }
}

/// `values` as multiples of the `floor` of the same round.
///
/// The cases of a round are measured one after the other, so a disturbance that lasts for a while affects both, and their
/// ratio varies less than either. The i-th values of both belong to one round; a round without a floor is left out.
pub(crate) fn ratios(values: &[f64], floor: &[f64]) -> Vec<f64> {
    let of_round = |(value, floor): (&f64, &f64)| (*floor > 0.0).then_some(value / floor);
    values.iter().zip(floor).filter_map(of_round).collect()
}

/// How the repeats of a figure in B compare with those in A.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Significance {
    /// All repeats of B are below all repeats of A.
    Lower,
    /// All repeats of B are above all repeats of A.
    Higher,
    /// The ranges overlap: the difference is within the spread.
    Within,
    /// There are too few repeats to tell, even if the ranges do not overlap. Four of each are enough.
    TooFew,
}

/// Whether B differs from A by more than the repeats of each differ among themselves.
///
/// The ranges must not overlap. If A and B measured the same thing, all orders of the m + k repeats are equally likely, and
/// disjoint ranges have the probability 2 m! k! / (m + k)!. This is the two-sided test of Mann and Whitney (Annals of
/// Mathematical Statistics 18, 1947) for its most extreme outcome, U = 0. It assumes nothing about the distribution.
pub(crate) fn significance(a: &[f64], b: &[f64]) -> Significance {
    let (Some(of_a), Some(of_b)) = (Spread::of(a), Spread::of(b)) else { return Significance::TooFew };
    if disjoint_probability(of_a.repeats, of_b.repeats) > SIGNIFICANCE_LEVEL {
        return Significance::TooFew;
    }
    if of_b.most < of_a.least {
        Significance::Lower
    } else if of_b.least > of_a.most {
        Significance::Higher
    } else {
        Significance::Within
    }
}

/// The probability that the ranges of m and k repeats of the same thing are disjoint: two of all ways to choose which m of
/// the m + k repeats come first.
fn disjoint_probability(m: usize, k: usize) -> f64 {
    // Multiply and divide in turn: factorials of some dozens of repeats would lose digits or overflow.
    let ways: f64 = (1..=m).map(|i| (k + i) as f64 / i as f64).product();
    (2.0 / ways).min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::{collection::vec, prelude::*};

    #[test]
    fn the_median_is_the_middle_value_or_the_mean_of_the_middle_two() {
        let odd = Spread::of(&[9.0, 1.0, 4.0]).unwrap();
        assert_eq!((odd.median, odd.least, odd.most, odd.repeats), (4.0, 1.0, 9.0, 3));
        let even = Spread::of(&[10.0, 4.0, 1.0, 6.0]).unwrap();
        assert_eq!((even.median, even.least, even.most), (5.0, 1.0, 10.0));
        assert_eq!(Spread::of(&[7.0]).unwrap().median, 7.0);
        assert_eq!(Spread::of(&[]), None);
        assert_eq!(Spread::of(&[f64::NAN, 2.0]).unwrap().repeats, 1);
    }

    #[test]
    fn a_slow_round_does_not_change_the_ratio() {
        // The machine was three times slower in the second round: the figures spread, their ratio does not.
        assert_eq!(ratios(&[15.0, 45.0, 16.0], &[10.0, 30.0, 10.0]), [1.5, 1.5, 1.6]);
        assert_eq!(ratios(&[15.0, 45.0], &[10.0]), [1.5]);
        assert!(ratios(&[15.0], &[0.0]).is_empty());
    }

    #[test]
    fn the_probability_of_disjoint_ranges_is_that_of_counting() {
        // 3 and 3: 20 orders, two of them disjoint. 4 and 4: 70. 5 and 5: 252. 2 and 7: 36.
        for (m, k, ways) in [(3, 3, 20.0), (4, 4, 70.0), (5, 5, 252.0), (2, 7, 36.0), (7, 2, 36.0)] {
            assert!((disjoint_probability(m, k) - 2.0 / ways).abs() < 1e-12, "{m} and {k}");
        }
        assert_eq!(disjoint_probability(1, 1), 1.0);
    }

    #[test]
    fn disjoint_ranges_differ_if_there_are_enough_repeats() {
        let a = [10.0, 11.0, 12.0, 13.0];
        assert_eq!(significance(&a, &[14.0, 15.0, 14.5, 20.0]), Significance::Higher);
        assert_eq!(significance(&a, &[9.0, 8.0, 9.9, 1.0]), Significance::Lower);
        assert_eq!(significance(&a, &[9.0, 8.0, 10.1, 1.0]), Significance::Within);
        assert_eq!(significance(&a, &a), Significance::Within);
    }

    #[test]
    fn three_repeats_each_are_too_few_however_far_apart() {
        // Disjoint by chance once in ten comparisons.
        assert_eq!(significance(&[1.0, 1.1, 1.2], &[9.0, 9.1, 9.2]), Significance::TooFew);
        assert_eq!(significance(&[], &[1.0, 1.0, 1.0, 1.0]), Significance::TooFew);
        // Three and five are disjoint by chance 2 times in 56.
        assert_eq!(significance(&[1.0, 1.1, 1.2], &[9.0, 9.1, 9.2, 9.3, 9.4]), Significance::Higher);
    }

    proptest! {
        #[test]
        fn at_most_half_of_the_values_lie_on_each_side_of_the_median(values in vec(-1e9..1e9_f64, 1..40)) {
            let spread = Spread::of(&values).unwrap();
            prop_assert!(spread.least <= spread.median && spread.median <= spread.most);
            let below = values.iter().filter(|value| **value < spread.median).count();
            let above = values.iter().filter(|value| **value > spread.median).count();
            prop_assert!(2 * below <= values.len() && 2 * above <= values.len());
        }

        #[test]
        fn swapping_a_and_b_swaps_lower_and_higher(a in vec(0.0..10.0_f64, 4..8), b in vec(5.0..20.0_f64, 4..8)) {
            let turned = match significance(&b, &a) {
                Significance::Lower => Significance::Higher,
                Significance::Higher => Significance::Lower,
                same => same,
            };
            prop_assert_eq!(significance(&a, &b), turned);
        }
    }
}
