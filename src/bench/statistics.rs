//! What repeats of a measurement say together, and whether two measurements differ.
//!
//! Never takes repeats for certain: a figure comes with the range of its repeats, a difference with the chance of it.

/// A difference counts that chance alone makes no more often than this.
pub(crate) const CHANCE: f64 = 0.05;

/// A figure over repeats.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub(crate) struct Spread {
    /// The middle one, or the mean of the middle two.
    pub(crate) median: f64,
    /// The least of all.
    pub(crate) least: f64,
    /// The most of all.
    pub(crate) most: f64,
    /// How many repeats there were.
    pub(crate) repeats: usize,
}

impl Spread {
    /// Of the values of the repeats; none of none, and of none that is not a number.
    pub(crate) fn of(values: &[f64]) -> Option<Self> {
        let mut sorted: Vec<f64> = values.iter().copied().filter(|value| value.is_finite()).collect();
        sorted.sort_by(f64::total_cmp);
        let (least, most) = (*sorted.first()?, *sorted.last()?);
        let middle = |place: usize| sorted.get(place).copied().unwrap_or(most);
        let median = f64::midpoint(middle((sorted.len() - 1) / 2), middle(sorted.len() / 2));
        Some(Self { median, least, most, repeats: sorted.len() })
    }

    /// All its values times `factor`, which is positive.
    pub(crate) fn times(self, factor: f64) -> Self {
        let Self { median, least, most, repeats } = self;
        Self { median: factor * median, least: factor * least, most: factor * most, repeats }
    }
}

/// `values` as multiples of `floor`, each of that in its own round.
///
/// The cases of a round are measured one after the other, so that what disturbs the machine for a while strikes both,
/// and their ratio varies less than either. The i-th repeats of both are one round; a round that lacks one is left out.
pub(crate) fn ratios(values: &[f64], floor: &[f64]) -> Vec<f64> {
    let of_round = |(value, floor): (&f64, &f64)| (*floor > 0.0).then_some(value / floor);
    values.iter().zip(floor).filter_map(of_round).collect()
}

/// What comparing the repeats of a figure, measured in A and in B, comes to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Verdict {
    /// Every repeat of B is below every one of A.
    Lower,
    /// Every repeat of B is above every one of A.
    Higher,
    /// The ranges overlap: the difference is within the spread.
    Within,
    /// So few repeats that even ranges apart mean nothing; four of each are the least that do.
    TooFew,
}

/// Whether B differs from A by more than their repeats do among themselves.
///
/// The ranges must not overlap. Where both are measurements of the same, all orders of the m + k repeats are equally
/// likely, and ranges apart have the chance 2 m! k! / (m + k)!: the two-sided test of Mann and Whitney (Annals of
/// Mathematical Statistics 18, 1947) for its most extreme outcome, U = 0. It assumes nothing of the distribution.
pub(crate) fn verdict(a: &[f64], b: &[f64]) -> Verdict {
    let (Some(of_a), Some(of_b)) = (Spread::of(a), Spread::of(b)) else { return Verdict::TooFew };
    if chance_apart(of_a.repeats, of_b.repeats) > CHANCE {
        return Verdict::TooFew;
    }
    if of_b.most < of_a.least {
        Verdict::Lower
    } else if of_b.least > of_a.most {
        Verdict::Higher
    } else {
        Verdict::Within
    }
}

/// The chance that m and k repeats of the same do not overlap: two of all ways to choose which m of m + k come first.
fn chance_apart(m: usize, k: usize) -> f64 {
    let ways: f64 = (1..=m).map(|i| (k + i) as f64 / i as f64).product();
    (2.0 / ways).min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::{collection::vec, prelude::*};

    #[test]
    fn the_median_is_the_middle_one_or_between_the_middle_two() {
        let odd = Spread::of(&[9.0, 1.0, 4.0]).unwrap();
        assert_eq!((odd.median, odd.least, odd.most, odd.repeats), (4.0, 1.0, 9.0, 3));
        let even = Spread::of(&[10.0, 4.0, 1.0, 6.0]).unwrap();
        assert_eq!((even.median, even.least, even.most), (5.0, 1.0, 10.0));
        assert_eq!(Spread::of(&[7.0]).unwrap().median, 7.0);
        assert_eq!(Spread::of(&[]), None);
        assert_eq!(Spread::of(&[f64::NAN, 2.0]).unwrap().repeats, 1);
    }

    #[test]
    fn a_slow_round_leaves_the_ratio_as_it_is() {
        // The machine was three times slower in the second round: the figures spread, their ratio does not.
        assert_eq!(ratios(&[15.0, 45.0, 16.0], &[10.0, 30.0, 10.0]), [1.5, 1.5, 1.6]);
        assert_eq!(ratios(&[15.0, 45.0], &[10.0]), [1.5]);
        assert!(ratios(&[15.0], &[0.0]).is_empty());
    }

    #[test]
    fn the_chance_of_ranges_apart_is_that_of_counting() {
        // 3 and 3: 20 orders, two of them apart. 4 and 4: 70. 5 and 5: 252. 2 and 7: 36.
        for (m, k, ways) in [(3, 3, 20.0), (4, 4, 70.0), (5, 5, 252.0), (2, 7, 36.0), (7, 2, 36.0)] {
            assert!((chance_apart(m, k) - 2.0 / ways).abs() < 1e-12, "{m} and {k}");
        }
        assert_eq!(chance_apart(1, 1), 1.0);
    }

    #[test]
    fn ranges_apart_differ_if_repeats_are_enough() {
        let a = [10.0, 11.0, 12.0, 13.0];
        assert_eq!(verdict(&a, &[14.0, 15.0, 14.5, 20.0]), Verdict::Higher);
        assert_eq!(verdict(&a, &[9.0, 8.0, 9.9, 1.0]), Verdict::Lower);
        assert_eq!(verdict(&a, &[9.0, 8.0, 10.1, 1.0]), Verdict::Within);
        assert_eq!(verdict(&a, &a), Verdict::Within);
    }

    #[test]
    fn three_repeats_each_say_nothing_however_far_apart() {
        // One chance in ten.
        assert_eq!(verdict(&[1.0, 1.1, 1.2], &[9.0, 9.1, 9.2]), Verdict::TooFew);
        assert_eq!(verdict(&[], &[1.0, 1.0, 1.0, 1.0]), Verdict::TooFew);
        // Three and five: 2 / 56.
        assert_eq!(verdict(&[1.0, 1.1, 1.2], &[9.0, 9.1, 9.2, 9.3, 9.4]), Verdict::Higher);
    }

    proptest! {
        #[test]
        fn a_median_lies_within_its_range_and_half_on_each_side(values in vec(-1e9..1e9_f64, 1..40)) {
            let spread = Spread::of(&values).unwrap();
            prop_assert!(spread.least <= spread.median && spread.median <= spread.most);
            let below = values.iter().filter(|value| **value < spread.median).count();
            let above = values.iter().filter(|value| **value > spread.median).count();
            prop_assert!(2 * below <= values.len() && 2 * above <= values.len());
        }

        #[test]
        fn the_verdict_turns_round_with_its_sides(a in vec(0.0..10.0_f64, 4..8), b in vec(5.0..20.0_f64, 4..8)) {
            let turned = match verdict(&b, &a) {
                Verdict::Lower => Verdict::Higher,
                Verdict::Higher => Verdict::Lower,
                same => same,
            };
            prop_assert_eq!(verdict(&a, &b), turned);
        }
    }
}
