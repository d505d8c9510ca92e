//! Statistics of flights: shares with their intervals, quantiles, and which differences are more than chance.
//!
//! Never draws anything at random: the same flights give the same numbers to the bit.

/// The 97.5 % quantile of the standard normal distribution: intervals here have a confidence of 95 %.
const Z: f64 = 1.959_963_984_540_054;
/// Probabilities that differ by less than this share count as equal in Fisher's test: they differ by rounding only.
const EQUAL: f64 = 1e-9;

/// A share with its confidence interval of 95 %.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Share {
    /// The share itself; one half if nothing was counted.
    pub value: f64,
    /// Lower end of the interval.
    pub low: f64,
    /// Upper end of the interval.
    pub high: f64,
}

/// The share `part` of `all` with the interval of Wilson (1927), which stays within 0 and 1 and holds its confidence for
/// small counts too.
pub fn wilson(part: u64, all: u64) -> Share {
    // No flights say nothing, so the interval covers every share.
    if all == 0 {
        return Share { value: 0.5, low: 0.0, high: 1.0 };
    }
    let (n, share) = (all as f64, part as f64 / all as f64);
    let scale = 1.0 + Z * Z / n;
    let centre = (share + Z * Z / (2.0 * n)) / scale;
    let half = Z * (share * (1.0 - share) / n + Z * Z / (4.0 * n * n)).sqrt() / scale;
    // At the ends the formula gives 0 and 1 but for rounding errors.
    let low = if part == 0 { 0.0 } else { (centre - half).max(0.0) };
    let high = if part == all { 1.0 } else { (centre + half).min(1.0) };
    Share { value: share, low, high }
}

/// The quantile at `share` of `values`, which it sorts; between two values it is interpolated (type 7 of Hyndman and Fan
/// 1996, the default of R and numpy). `None` without values.
pub fn quantile(values: &mut [f64], share: f64) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let last = values.len().checked_sub(1)?;
    let place = share * last as f64;
    let (below, above) = (values[place.floor() as usize], values[place.ceil() as usize]);
    // Without this, two infinities would give a number that is not one.
    Some(if below == above { below } else { below + (place - place.floor()) * (above - below) })
}

/// Fisher's exact test: how probable it is that two samples of the same kind have shares that differ at least as much as
/// `one` of `one_all` and `other` of `other_all` (two-sided, by the probability of each table).
pub fn fisher(one: u64, one_all: u64, other: u64, other_all: u64) -> f64 {
    let (part, all) = (one + other, one_all + other_all);
    let probability = |x: u64| {
        // Logarithms, because the binomial coefficients of about a thousand flights overflow an `f64`.
        let log = choose_log(one_all, x) + choose_log(other_all, part - x) - choose_log(all, part);
        libm::exp(log)
    };
    let observed = probability(one);
    // Outside these bounds a sample would have more hits than flights, and `choose_log` would subtract below zero.
    let tables = part.saturating_sub(other_all)..=part.min(one_all);
    let extreme = tables.map(probability).filter(|probability| *probability <= observed * (1.0 + EQUAL));
    // Rounding can lift the sum over all tables just above 1.
    extreme.sum::<f64>().min(1.0)
}

/// Natural logarithm of the number of ways to choose `part` of `all`.
fn choose_log(all: u64, part: u64) -> f64 {
    let factorial = |number: u64| libm::lgamma(number as f64 + 1.0);
    factorial(all) - factorial(part) - factorial(all - part)
}

/// The probabilities adjusted for their number, after Benjamini and Hochberg (1995): if all that are at most q count as
/// differences, the expected share of false ones among them is at most q.
pub fn benjamini_hochberg(probabilities: &[f64]) -> Vec<f64> {
    let count = probabilities.len();
    let mut order: Vec<usize> = (0..count).collect();
    order.sort_by(|one, other| probabilities[*one].total_cmp(&probabilities[*other]));
    let mut adjusted = vec![1.0; count];
    let mut least = 1.0_f64;
    // From the largest down, because a smaller probability never gets a larger adjusted one.
    for (rank, place) in order.iter().enumerate().rev() {
        least = least.min(probabilities[*place] * count as f64 / (rank + 1) as f64);
        adjusted[*place] = least;
    }
    adjusted
}

#[cfg(test)]
mod tests {
    use super::*;

    fn assert_near(value: f64, expected: f64) {
        assert!((value - expected).abs() < 5e-5, "{value} instead of {expected}");
    }

    #[test]
    fn wilson_intervals_are_those_of_newcombe_1998() {
        // Table I of Newcombe, Statistics in Medicine 17 (1998), method 3.
        for (part, all, low, high) in [
            (81, 263, 0.2553, 0.3662),
            (15, 148, 0.0624, 0.1605),
            (0, 20, 0.0, 0.1611),
            (1, 29, 0.0061, 0.1718),
        ] {
            let share = wilson(part, all);
            assert_near(share.low, low);
            assert_near(share.high, high);
        }
        assert_eq!((wilson(7, 7).high, wilson(0, 0).low, wilson(0, 0).high), (1.0, 0.0, 1.0));
    }

    #[test]
    fn a_wilson_interval_worked_out_by_hand() {
        // 5 of 10: centre 1/2, half width z sqrt(1/40 + z^2/400) / (1 + z^2/10), with z^2 = 3.841459.
        let share = wilson(5, 10);
        assert_near(share.low, 0.236_59);
        assert_near(share.high, 0.763_41);
        // All of n: the lower end is n / (n + z^2).
        assert!((wilson(73, 73).low - 73.0 / (73.0 + Z * Z)).abs() < 1e-12);
        assert!((wilson(0, 73).high - wilson(73, 73).low - (1.0 - 2.0 * wilson(73, 73).low)).abs() < 1e-12);
    }

    #[test]
    fn quantiles_are_those_of_numpy() {
        let mut values = [4.0, 1.0, 3.0, 2.0];
        assert_eq!(quantile(&mut values, 0.5), Some(2.5));
        assert!((quantile(&mut values, 0.9).unwrap() - 3.7).abs() < 1e-12);
        assert_eq!((quantile(&mut values, 0.0), quantile(&mut values, 1.0)), (Some(1.0), Some(4.0)));
        assert_eq!(quantile(&mut [1.0, f64::INFINITY, f64::INFINITY], 0.9), Some(f64::INFINITY));
        assert_eq!(quantile(&mut [], 0.5), None);
    }

    #[test]
    fn fishers_test_is_that_of_the_lady_tasting_tea() {
        // Fisher (1935): 3 of 4 and 1 of 4 give 34/70; all right would give 2/70.
        assert!((fisher(3, 4, 1, 4) - 34.0 / 70.0).abs() < 1e-12);
        assert!((fisher(4, 4, 0, 4) - 2.0 / 70.0).abs() < 1e-12);
        assert!((fisher(5, 10, 5, 10) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn adjusted_probabilities_are_those_of_benjamini_and_hochberg_1995() {
        // Their example: 15 comparisons, of which four are found at 0.05.
        let probabilities = [
            0.0001, 0.0004, 0.0019, 0.0095, 0.0201, 0.0278, 0.0298, 0.0344, 0.0459, 0.3240, 0.4262, 0.5719,
            0.6528, 0.7590, 1.0,
        ];
        let adjusted = benjamini_hochberg(&probabilities);
        assert_eq!(adjusted.iter().filter(|adjusted| **adjusted <= 0.05).count(), 4);
        assert!((adjusted[0] - 0.0015).abs() < 1e-12 && (adjusted[3] - 0.035_625).abs() < 1e-12);
        assert_eq!(adjusted[14], 1.0);
        // Worked out by hand: 4 x 0.005, 4/2 x 0.01, 4/3 x 0.03 and 4/4 x 0.04.
        for (value, expected) in
            benjamini_hochberg(&[0.01, 0.04, 0.03, 0.005]).into_iter().zip([0.02, 0.04, 0.04, 0.02])
        {
            assert!((value - expected).abs() < 1e-12, "{value} {expected}");
        }
        let mut reversed = probabilities;
        reversed.reverse();
        assert_eq!(benjamini_hochberg(&reversed).into_iter().rev().collect::<Vec<_>>(), adjusted);
        assert_eq!(benjamini_hochberg(&[]), Vec::<f64>::new());
    }
}
