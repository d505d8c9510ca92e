//! How an airframe gets to the speed and turn rate that it is told: with a lag of first order, and no faster than a limit.
//!
//! Both parts are exact in a step from tick to tick, whatever the tick rate. Without a lag and a limit, the airframe does at once what it
//! is told, to the bit. Never knows what the airframe can reach: the command has been cut to that.

use ringwing_scenario::AirframeSection;

/// Speed through the air and turn rate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Rates {
    pub(crate) speed_m_s: f64,
    pub(crate) turn_rate_rad_s: f64,
}

/// The response of an airframe.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Response {
    speed: Lag,
    turn_rate: Lag,
}

/// The response of one quantity.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Lag {
    /// The time constant; 0 for none.
    time_s: f64,
    /// The largest change per second; infinite for no limit.
    rate_max_per_s: f64,
}

impl Response {
    pub(crate) fn new(airframe: &AirframeSection) -> Self {
        Self {
            speed: Lag::new(airframe.speed_lag_s, airframe.acceleration_max_m_s2),
            turn_rate: Lag::new(airframe.turn_lag_s, airframe.turn_acceleration_max_rad_s2),
        }
    }

    /// Whether the airframe does at once what it is told.
    pub(crate) fn is_instant(&self) -> bool {
        self.speed.is_none() && self.turn_rate.is_none()
    }

    /// What is flown at the end of a step of `period_s` that begins with `flown`, towards `wanted`.
    pub(crate) fn after(&self, flown: Rates, wanted: Rates, period_s: f64) -> Rates {
        Rates {
            speed_m_s: self.speed.after(flown.speed_m_s, wanted.speed_m_s, period_s),
            turn_rate_rad_s: self.turn_rate.after(flown.turn_rate_rad_s, wanted.turn_rate_rad_s, period_s),
        }
    }
}

impl Lag {
    /// A lag with this time constant and limit; 0 means none of either.
    fn new(time_s: f64, rate_max_per_s: f64) -> Self {
        Self { time_s, rate_max_per_s: if rate_max_per_s > 0.0 { rate_max_per_s } else { f64::INFINITY } }
    }

    fn is_none(&self) -> bool {
        self.time_s == 0.0 && self.rate_max_per_s == f64::INFINITY
    }

    /// The value after `period_s` of x' = (wanted - x) / time, where |x'| is at most the limit.
    fn after(&self, value: f64, wanted: f64, period_s: f64) -> f64 {
        if self.is_none() {
            return wanted;
        }
        let gap = wanted - value;
        // A lag alone changes by gap / time. While that is above the limit, the change is linear.
        let linear_s = if self.rate_max_per_s == f64::INFINITY {
            0.0
        } else {
            (gap.abs() / self.rate_max_per_s - self.time_s).clamp(0.0, period_s)
        };
        let left = if linear_s > 0.0 { gap - (self.rate_max_per_s * linear_s).copysign(gap) } else { gap };
        let rest_s = period_s - linear_s;
        // What is left after that decays. Without a lag it is nothing, because the linear change goes on to the end.
        let is_reached = self.time_s == 0.0 && rest_s > 0.0;
        let decay = if self.time_s > 0.0 { libm::exp(-rest_s / self.time_s) } else { 1.0 };
        if is_reached { wanted } else { wanted - left * decay }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The values after each of `ticks` steps of 0.01 s from 12 towards 20.
    fn step_response(time_s: f64, rate_max_per_s: f64, ticks: u32) -> Vec<f64> {
        let lag = Lag::new(time_s, rate_max_per_s);
        let mut value = 12.0;
        let mut step = |_| {
            value = lag.after(value, 20.0, 0.01);
            value
        };
        (0..ticks).map(&mut step).collect()
    }

    #[test]
    fn a_lag_has_the_step_response_of_first_order() {
        for (tick, value) in (1..).zip(step_response(0.5, 0.0, 300)) {
            let expected = 20.0 - 8.0 * (-f64::from(tick) * 0.01 / 0.5_f64).exp();
            assert!((value - expected).abs() < 1e-9, "tick {tick}: {value} instead of {expected}");
        }
    }

    #[test]
    fn a_limit_alone_makes_a_ramp_that_ends_at_what_is_wanted() {
        let values = step_response(0.0, 3.0, 400);
        assert!((values[99] - 15.0).abs() < 1e-9, "3 m/s after a second");
        assert_eq!(values[399], 20.0);
        assert!(values.is_sorted() && values.iter().all(|value| *value <= 20.0));
    }

    #[test]
    fn with_both_the_ramp_goes_over_into_the_lag_without_a_kink() {
        // The ramp ends where the lag alone would be as fast: 2 m/s^2 times 0.5 s before the end, after 3.5 s.
        let values = step_response(0.5, 2.0, 600);
        assert!((values[349] - 19.0).abs() < 1e-9, "{}", values[349]);
        let expected = 20.0 - (-1.0_f64).exp();
        assert!((values[399] - expected).abs() < 1e-9, "{} half a second later", values[399]);
    }

    #[test]
    fn a_limit_alone_ends_at_what_is_wanted_to_the_bit() {
        // A gap after which rounding leaves a rest: 9e-5 / 0.7 * 0.7 is not 9e-5.
        let lag = Lag::new(0.0, 0.7);
        assert_eq!(lag.after(9e-5, 0.0, 0.01), 0.0);
    }

    #[test]
    fn an_airframe_is_instant_only_if_speed_and_turn_rate_both_are() {
        let lagging = |speed_lag_s, turn_lag_s| {
            let section = AirframeSection { speed_lag_s, turn_lag_s, ..AirframeSection::default() };
            Response::new(&section).is_instant()
        };
        assert!(!lagging(0.5, 0.0) && !lagging(0.0, 0.5));
    }

    #[test]
    fn without_lag_and_limit_what_is_wanted_is_flown_to_the_bit() {
        assert!(Response::new(&AirframeSection::default()).is_instant());
        assert_eq!(step_response(0.0, 0.0, 1), [20.0]);
    }

    proptest! {
        #[test]
        fn the_step_is_exact_whatever_its_length(
            value in -5.0..5.0, wanted in -5.0..5.0, time_s in 0.01..2.0, rate in 0.1..10.0, period_s in 0.001..1.0,
        ) {
            let lag = Lag::new(time_s, rate);
            let once = lag.after(value, wanted, period_s);
            let halved = lag.after(lag.after(value, wanted, period_s / 2.0), wanted, period_s / 2.0);
            prop_assert!((once - halved).abs() < 1e-9, "{once} {halved}");
            prop_assert!((once - value).abs() <= rate * period_s + 1e-9);
            prop_assert!((wanted - once).abs() <= (wanted - value).abs() + 1e-12, "it never goes farther away");
        }
    }
}
