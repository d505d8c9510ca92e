//! Whether the success at one value is above or below what is asked for, decided after as few flights as are needed.
//!
//! A sequential test by likelihood ratios (Robbins, *Statistical Methods Related to the Law of the Iterated Logarithm*,
//! 1970). Flights may be looked at one by one: the probability that the test ever decides wrongly is at most `error`,
//! whenever it stops. Repeated looks at a Wilson interval would not have that property.
//!
//! Never draws or flies anything.

use crate::statistics::{Share, wilson};
use serde::Serialize;

/// What the flights at one value say.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Decision {
    /// Success is above what is asked for.
    Above,
    /// Success is below what is asked for.
    Below,
    /// The flights do not tell: success is close to what is asked for.
    Undecided,
}

/// The flights at one value so far.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Trial {
    /// The share of flights that is asked for, between 0 and 1.
    pub success: f64,
    /// Probability of a wrong decision, at most.
    pub error: f64,
    /// Flights that passed.
    pub passed: u64,
    /// Flights that did not.
    pub failed: u64,
}

impl Trial {
    /// Before the first flight.
    pub fn new(success: f64, error: f64) -> Self {
        Self { success, error, passed: 0, failed: 0 }
    }

    /// Notes a flight.
    pub fn note(&mut self, passed: bool) {
        if passed { self.passed += 1 } else { self.failed += 1 }
    }

    /// Number of flights.
    pub fn flights(&self) -> u64 {
        self.passed + self.failed
    }

    /// The share that passed, with its interval. The interval is for people: decisions do not use it.
    pub fn share(&self) -> Share {
        wilson(self.passed, self.flights())
    }

    /// What the flights say.
    pub fn decision(&self) -> Decision {
        if evidence(self.passed, self.failed, self.success) * self.error >= 1.0 {
            Decision::Above
        } else if evidence(self.failed, self.passed, 1.0 - self.success) * self.error >= 1.0 {
            Decision::Below
        } else {
            Decision::Undecided
        }
    }
}

/// How much more probable `hits` and `misses` are at a rate above `rate`, drawn uniformly, than at `rate`:
/// `integral from rate to 1 of p^hits (1 - p)^misses dp / (1 - rate)` over the same at `rate`.
///
/// At every true rate up to `rate`, this is a supermartingale that begins at 1. So by Ville's inequality it ever reaches
/// 1 / e with a probability of at most e.
fn evidence(hits: u64, misses: u64, rate: f64) -> f64 {
    // The integral is a tail of a binomial distribution of one flight more; its terms follow from one another.
    let flights = hits + misses;
    let mut term = 1.0 / (misses + 1) as f64;
    let mut sum = term;
    for k in (1..=hits).rev() {
        term *= k as f64 * (1.0 - rate) / ((flights + 2 - k) as f64 * rate);
        sum += term;
        // The terms that are left are smaller than the last digit.
        if term < sum * f64::EPSILON && k as f64 * (1.0 - rate) < (flights + 2 - k) as f64 * rate {
            break;
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use ringwing_flight::draw::Draws;

    #[test]
    fn evidence_is_the_integral_worked_out_by_hand() {
        let near =
            |value: f64, expected: f64| assert!((value / expected - 1.0).abs() < 1e-12, "{value} {expected}");
        near(evidence(0, 0, 0.95), 1.0);
        // One success: (1 - q^2) / 2 / (1 - q) / q. One failure: the same with 1 - q.
        near(evidence(1, 0, 0.95), 1.95 / 1.9);
        near(evidence(1, 0, 0.05), 1.05 / 0.1);
        // Three failures in a row: (1 - 0.05^4) / 4 / 0.95 / 0.05^3.
        near(evidence(3, 0, 0.05), (1.0 - 6.25e-6) / 4.0 / 0.95 / 1.25e-4);
        // One of each at one half: integral of p - p^2 from 1/2 to 1 is 1/12, over 1/2, over 1/4.
        near(evidence(1, 1, 0.5), 2.0 / 3.0);
    }

    #[test]
    fn two_failures_or_some_ninety_successes_in_a_row_decide_against_95_percent() {
        let decided_after = |passed: bool| {
            let mut trial = Trial::new(0.95, 0.05);
            while trial.decision() == Decision::Undecided {
                trial.note(passed);
            }
            (trial.flights(), trial.decision())
        };
        assert_eq!(decided_after(false), (2, Decision::Below));
        let (flights, decision) = decided_after(true);
        assert_eq!(decision, Decision::Above);
        // (1 - q^(n+1)) / ((n + 1)(1 - q) q^n) is 19.5 at n = 87 and 20.3 at n = 88.
        assert_eq!(flights, 88);
    }

    #[test]
    fn wrong_decisions_are_rarer_than_the_error_however_often_the_flights_are_looked_at() {
        // Exactly at the limit, each decision is wrong. 2,000 trials of 400 flights each.
        let wrong = (0..2000).filter(|seed| {
            let mut trial = Trial::new(0.9, 0.1);
            (0..400).any(|flight| {
                trial.note(Draws::new(*seed, [1, 2, 3], flight).uniform() < 0.9);
                trial.decision() == Decision::Above
            })
        });
        let share = wrong.count() as f64 / 2000.0;
        assert!(share < 0.1 && share > 0.01, "{share}");
    }
}
