//! How well the formation is kept: the slot errors over the second half of the flight.
//!
//! In gusts a formation never comes to rest, so neither the errors at the end nor a settling time tell how well it is kept. Never
//! counts the first half: there the formation forms.

use super::errors::FormationErrors;
use ringwing_scenario::Scenario;

/// Sums up the slot errors.
#[derive(Debug, Clone)]
pub(super) struct KeepingWatch {
    /// The first tick of the second half.
    begin: i64,
    squares_m2: f64,
    count: u64,
}

impl KeepingWatch {
    pub(super) fn new(scenario: &Scenario) -> Self {
        Self { begin: scenario.last_tick() / 2, squares_m2: 0.0, count: 0 }
    }

    /// Takes the errors of the next tick.
    pub(super) fn observe(&mut self, tick: i64, errors: &FormationErrors) {
        if tick >= self.begin {
            self.squares_m2 += errors.slot_squares_m2;
            self.count += u64::from(errors.slots);
        }
    }

    /// The root mean square so far; `None` before the second half.
    pub(super) fn rms_m(&self) -> Option<f64> {
        (self.count > 0).then(|| (self.squares_m2 / self.count as f64).sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_errors_of_the_second_half_count_each_uav_in_each_tick_alike() {
        let mut scenario = Scenario::default();
        (scenario.time.duration_s, scenario.time.rate_hz) = (10.0, 1);
        let mut keeping = KeepingWatch::new(&scenario);
        let errors = |squares_m2, slots| FormationErrors {
            slot_squares_m2: squares_m2,
            slots,
            ..FormationErrors::default()
        };
        keeping.observe(4, &errors(900.0, 2));
        assert_eq!(keeping.rms_m(), None);
        keeping.observe(5, &errors(10.0, 2));
        keeping.observe(6, &errors(8.0, 1));
        keeping.observe(7, &errors(0.0, 0));
        assert!((keeping.rms_m().unwrap() - 6_f64.sqrt()).abs() < 1e-12);
    }
}
