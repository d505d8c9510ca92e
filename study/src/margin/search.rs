//! Where success falls below what is asked for: a bisection that survives noise.
//!
//! The middle of the bracket is flown until a sequential test decides. If the flights do not tell, success there is close to
//! what is asked for, and the search goes on at both sides of it: the bracket shrinks around values that cannot be told
//! apart from the margin. Assumes that success falls from one end of the range to the other.
//!
//! Never flies anything: [`Search::next`] says where, and [`Search::note`] takes the result.

use super::trial::{Decision, Trial};

/// The range that is searched.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Range {
    /// The end at which flights succeed.
    pub from: f64,
    /// The end at which they do not; it may be the smaller number.
    pub to: f64,
    /// How narrow the bracket shall become. Whole numbers have a resolution of 1.
    pub resolution: f64,
    /// Whether only whole numbers are allowed.
    pub is_whole: bool,
}

/// The flights at one value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tried {
    /// The value.
    pub value: f64,
    /// Its flights.
    pub trial: Trial,
    /// What they say.
    pub decision: Decision,
}

/// What a search has found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Finding {
    /// Success falls below what is asked for between `low` and `high`.
    Margin {
        /// The middle of the bracket, or of the values in it whose flights do not tell.
        value: f64,
        /// The last value with enough success.
        low: f64,
        /// The first value without.
        high: f64,
    },
    /// There is enough success at both ends.
    SucceedsEverywhere,
    /// There is too little success at both ends.
    FailsEverywhere,
    /// There is too little success at the first end, and enough at the other.
    Rises,
    /// The flights at this end of the range do not tell.
    Unclear(f64),
}

/// A search.
#[derive(Debug, Clone)]
pub struct Search {
    range: Range,
    success: f64,
    error: f64,
    /// In the order in which they were flown.
    tried: Vec<Tried>,
}

impl Search {
    /// A search in `range` for the value at which success falls below `success`, whose bracket misses it with a probability
    /// of at most `error`.
    pub fn new(range: Range, success: f64, error: f64) -> Self {
        Self { range, success, error, tried: Vec::new() }
    }

    /// The values so far, in the order in which they were flown.
    pub fn tried(&self) -> &[Tried] {
        &self.tried
    }

    /// The value to fly at next, with its trial; `None` when there is nothing more to learn.
    pub fn next(&self) -> Option<(f64, Trial)> {
        let value = match self.tried.as_slice() {
            // Fly both ends first: bisection needs a range that succeeds at one end and fails at the other.
            [] => Some(self.range.from),
            [_] => Some(self.range.to),
            [from, to, ..] if (from.decision, to.decision) == (Decision::Above, Decision::Below) => {
                self.middle()
            }
            _ => None,
        }?;
        // The errors of all trials add up: 1/2 + 1/6 + 1/12 + ... = 1.
        let number = self.tried.len() as f64 + 1.0;
        Some((value, Trial::new(self.success, self.error / (number * (number + 1.0)))))
    }

    /// Takes the flights at the value that [`Self::next`] has asked for. `is_certain` if every flight there is the same, so
    /// that the first one decides.
    pub fn note(&mut self, value: f64, trial: Trial, is_certain: bool) {
        let decision = match is_certain {
            true if trial.failed > 0 => Decision::Below,
            true => Decision::Above,
            false => trial.decision(),
        };
        self.tried.push(Tried { value, trial, decision });
    }

    /// What the values so far say.
    pub fn finding(&self) -> Finding {
        let [from, to, ..] = self.tried.as_slice() else { return Finding::Unclear(self.range.from) };
        match (from.decision, to.decision) {
            (Decision::Above, Decision::Below) => {
                let [low, first, last, high] = self.bracket();
                Finding::Margin { value: f64::midpoint(first, last), low, high }
            }
            (Decision::Above, Decision::Above) => Finding::SucceedsEverywhere,
            (Decision::Below, Decision::Below) => Finding::FailsEverywhere,
            (Decision::Below, Decision::Above) => Finding::Rises,
            (Decision::Undecided, _) => Finding::Unclear(self.range.from),
            (_, Decision::Undecided) => Finding::Unclear(self.range.to),
        }
    }

    /// The last value above, the first and the last value between that does not tell, and the first value below. Without a
    /// value that does not tell, the ends stand in for it.
    fn bracket(&self) -> [f64; 4] {
        // From the end that succeeds, so that a range may also go downwards.
        let place = |value: f64| (value - self.range.from).abs();
        let of = |decision| {
            self.tried.iter().filter(move |tried| tried.decision == decision).map(|tried| tried.value)
        };
        let by_place = |one: &f64, other: &f64| place(*one).total_cmp(&place(*other));
        let low = of(Decision::Above).max_by(by_place).unwrap_or(self.range.from);
        let high = of(Decision::Below).min_by(by_place).unwrap_or(self.range.to);
        // What did not tell outside the bracket is settled by its neighbours, because success falls.
        let between =
            || of(Decision::Undecided).filter(|value| (place(low)..place(high)).contains(&place(*value)));
        let (first, last) = (between().min_by(by_place), between().max_by(by_place));
        [low, first.unwrap_or(low), last.unwrap_or(high), high]
    }

    /// The middle of the widest part of the bracket that is not settled; `None` if all are narrow.
    fn middle(&self) -> Option<f64> {
        let [low, first, last, high] = self.bracket();
        let is_undecided = first != low || last != high;
        let [one, other] = if is_undecided { [(low, first), (last, high)] } else { [(low, high); 2] };
        let width = |(a, b): (f64, f64)| (b - a).abs();
        let widest = if width(other) > width(one) { other } else { one };
        // With values that do not tell, both sides count.
        let limit = if is_undecided { self.range.resolution / 2.0 } else { self.range.resolution };
        // Between neighbouring whole numbers there is nothing left to fly.
        let limit = if self.range.is_whole { 1.0 } else { limit };
        let middle = f64::midpoint(widest.0, widest.1);
        // Without the tolerance, a rounding error in the width costs one more value with all its flights.
        (width(widest) > limit * (1.0 + 1e-9))
            .then(|| if self.range.is_whole { middle.round() } else { middle })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ringwing_flight::draw::Draws;

    const RANGE: Range = Range { from: 0.0, to: 2.0, resolution: 0.02, is_whole: false };
    /// Flights at one value, at most.
    const MOST: u64 = 400;

    /// Searches on a known curve of success over the value.
    fn searched(range: Range, seed: u64, success: impl Fn(f64) -> f64) -> Search {
        let mut search = Search::new(range, 0.95, 0.05);
        let mut number = 0;
        while let Some((value, mut trial)) = search.next() {
            while trial.decision() == Decision::Undecided && trial.flights() < MOST {
                number += 1;
                trial.note(Draws::new(seed, [7, 8, 9], number).uniform() < success(value));
            }
            search.note(value, trial, false);
        }
        search
    }

    fn logistic(value: f64, middle: f64, width: f64) -> f64 {
        1.0 / (1.0 + libm::exp((value - middle) / width))
    }

    #[test]
    fn a_sharp_edge_is_found_to_the_resolution() {
        let search = searched(RANGE, 1, |value| if value < 1.2345 { 1.0 } else { 0.0 });
        let Finding::Margin { value, low, high } = search.finding() else { panic!("{search:?}") };
        assert!((value - 1.2345).abs() <= 0.01, "{value}");
        assert!(low < 1.2345 && high > 1.2345 && high - low <= 0.02);
    }

    #[test]
    fn under_noise_the_bracket_holds_the_value_in_at_least_95_percent_of_searches() {
        // Success is 95 % where the logistic curve is: middle - width ln 19.
        let truth = 1.0 - 0.1 * libm::log(19.0);
        let mut errors = Vec::new();
        let missed = (0..200).filter(|seed| {
            let search = searched(RANGE, *seed, |value| logistic(value, 1.0, 0.1));
            let Finding::Margin { value, low, high } = search.finding() else { panic!("{search:?}") };
            errors.push((value - truth).abs());
            !(low..=high).contains(&truth)
        });
        let missed = missed.count();
        assert!(missed <= 10, "{missed} of 200");
        let mean = errors.iter().sum::<f64>() / 200.0;
        assert!(mean < 0.06, "{mean} m off on average");
    }

    #[test]
    fn a_range_may_go_downwards() {
        let range = Range { from: 5.0, to: 1.0, resolution: 0.01, is_whole: false };
        let search = searched(range, 1, |value| if value > 3.3 { 1.0 } else { 0.1 });
        let Finding::Margin { low, high, .. } = search.finding() else { panic!("{search:?}") };
        assert!(low > 3.3 && high < 3.3 && low - high <= 0.01);
    }

    #[test]
    fn whole_numbers_end_at_two_that_follow_one_another() {
        let range = Range { from: 3.0, to: 20.0, resolution: 1.0, is_whole: true };
        let search = searched(range, 1, |value| if value < 11.5 { 1.0 } else { 0.0 });
        assert!(search.tried().iter().all(|tried| tried.value.fract() == 0.0));
        let Finding::Margin { low, high, .. } = search.finding() else { panic!("{search:?}") };
        assert_eq!((low, high), (11.0, 12.0));
    }

    #[test]
    fn ends_that_do_not_differ_as_expected_are_said() {
        let finding = |success: fn(f64) -> f64| searched(RANGE, 1, success).finding();
        assert_eq!(finding(|_| 1.0), Finding::SucceedsEverywhere);
        assert_eq!(finding(|_| 0.5), Finding::FailsEverywhere);
        assert_eq!(finding(|value| value / 2.0), Finding::Rises);
        assert_eq!(finding(|value| if value < 1.0 { 0.95 } else { 0.0 }), Finding::Unclear(0.0));
    }

    #[test]
    fn where_every_flight_is_the_same_one_decides() {
        let mut search = Search::new(RANGE, 0.95, 0.05);
        while let Some((value, mut trial)) = search.next() {
            trial.note(value < 0.5);
            search.note(value, trial, true);
        }
        let flights: u64 = search.tried().iter().map(|tried| tried.trial.flights()).sum();
        let Finding::Margin { low, high, .. } = search.finding() else { panic!("{search:?}") };
        assert!(low < 0.5 && high >= 0.5 && high - low <= 0.02);
        assert_eq!(flights, 2 + 7, "the ends, and seven halvings from 2 to 1/64");
    }
}
