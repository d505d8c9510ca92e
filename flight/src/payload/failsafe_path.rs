//! How an airframe that loiters in its failsafe leaves the formation first.

use crate::Pose;
use bytemuck::{Pod, Zeroable};
use std::f64::consts::PI;

/// One step of the turn. Smaller steps find a wider gap and give more paths to compare.
const TURN_STEP_RAD: f64 = PI / 12.0;

/// What an airframe flies in its failsafe `loiter`: it turns away and flies straight on, both at its highest speed, and then
/// circles to the same side at its lowest speed. Without a straight leg, it circles at once.
///
/// An agent chooses the path beforehand, because nobody can tell the airframe afterwards. Any bytes in shared memory are a
/// valid path.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Pod, Zeroable)]
#[repr(C)]
pub struct FailsafePath {
    /// How far it turns away, in steps of 15 degrees; positive to the left. Without a straight leg, only the side counts.
    turn_steps: i8,
    /// How long it then flies straight on, in s.
    straight_s: u8,
}

/// How fast an airframe flies in its failsafe `loiter`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoiterRates {
    /// On the way out of the formation.
    pub leaving_m_s: f64,
    /// On the circle.
    pub circling_m_s: f64,
    /// In every turn, to either side.
    pub turn_rate_rad_s: f64,
}

impl FailsafePath {
    /// Circles to the left at once, as an airframe does that no agent has told otherwise.
    pub const CIRCLE_LEFT: Self = Self { turn_steps: 0, straight_s: 0 };
    /// Circles to the right at once.
    pub const CIRCLE_RIGHT: Self = Self { turn_steps: -1, straight_s: 0 };
    /// The steps of a quarter turn. A wider turn leads back into the formation.
    pub const QUARTER_TURN_STEPS: i8 = 6;

    /// Turns by this many steps of 15 degrees, positive to the left, and flies straight on for `straight_s`.
    pub const fn new(turn_steps: i8, straight_s: u8) -> Self {
        Self { turn_steps, straight_s }
    }

    /// Speed in m/s and turn rate in rad/s, `time_s` after the failsafe took over.
    pub fn rates(self, rates: &LoiterRates, time_s: f64) -> (f64, f64) {
        let [turning_s, straight_s] = self.durations_s(rates);
        let is_leaving = time_s < turning_s + straight_s;
        let is_straight = is_leaving && time_s >= turning_s;
        let speed_m_s = if is_leaving { rates.leaving_m_s } else { rates.circling_m_s };
        (speed_m_s, if is_straight { 0.0 } else { self.side() * rates.turn_rate_rad_s })
    }

    /// Where an airframe is `time_s` after its failsafe took over at `start`.
    pub fn pose(self, start: &Pose, rates: &LoiterRates, time_s: f64) -> Pose {
        let [turning_s, straight_s] = self.durations_s(rates);
        let rate_rad_s = self.side() * rates.turn_rate_rad_s;
        let turned = start.after(rates.leaving_m_s, rate_rad_s, time_s.min(turning_s));
        let straight = turned.after(rates.leaving_m_s, 0.0, (time_s - turning_s).clamp(0.0, straight_s));
        straight.after(rates.circling_m_s, rate_rad_s, (time_s - turning_s - straight_s).max(0.0))
    }

    /// How long it turns away, and how long it flies straight on.
    fn durations_s(self, rates: &LoiterRates) -> [f64; 2] {
        if self.straight_s == 0 {
            return [0.0; 2];
        }
        let turn_rad = f64::from(self.turn_steps).abs() * TURN_STEP_RAD;
        [turn_rad / rates.turn_rate_rad_s, f64::from(self.straight_s)]
    }

    /// 1 for a turn to the left, counterclockwise as headings count, and -1 for one to the right.
    fn side(self) -> f64 {
        if self.turn_steps < 0 { -1.0 } else { 1.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point2;
    use proptest::prelude::*;

    const RATES: LoiterRates = LoiterRates { leaving_m_s: 25.0, circling_m_s: 12.0, turn_rate_rad_s: 0.25 };

    #[test]
    fn an_airframe_turns_away_flies_straight_on_and_circles_to_the_same_side() {
        let path = FailsafePath::new(-6, 10);
        // A quarter turn at 0.25 rad/s takes 6.28 s.
        let rates = [0.0, 6.2, 6.3, 16.2, 16.3, 500.0].map(|time_s| path.rates(&RATES, time_s));
        let (turning, straight, circling) = ((25.0, -0.25), (25.0, 0.0), (12.0, -0.25));
        assert_eq!(rates, [turning, turning, straight, straight, circling, circling]);
    }

    #[test]
    fn without_a_straight_leg_it_circles_at_once() {
        for (path, rate_rad_s) in [(FailsafePath::CIRCLE_LEFT, 0.25), (FailsafePath::CIRCLE_RIGHT, -0.25)] {
            for time_s in [0.0, 0.5, 30.0] {
                assert_eq!(path.rates(&RATES, time_s), (12.0, rate_rad_s));
            }
        }
    }

    #[test]
    fn the_place_on_the_path_is_what_its_rates_add_up_to() {
        let start = Pose { position: Point2::new(3.0, -4.0), heading_rad: 1.0 };
        for path in [FailsafePath::CIRCLE_LEFT, FailsafePath::new(5, 4), FailsafePath::new(-6, 20)] {
            let mut flown = start;
            for step in 0..30_000 {
                let (speed_m_s, turn_rate_rad_s) = path.rates(&RATES, f64::from(step) * 0.001);
                flown = flown.after(speed_m_s, turn_rate_rad_s, 0.001);
            }
            // The phases do not end in whole steps.
            let apart_m = (flown.position - path.pose(&start, &RATES, 30.0).position).norm();
            assert!(apart_m < 0.2, "{path:?}: {apart_m} m");
        }
    }

    proptest! {
        #[test]
        fn whatever_the_bytes_a_path_is_flown_within_its_rates(
            turn_steps in any::<i8>(), straight_s in any::<u8>(), time_s in 0.0..600.0,
        ) {
            let path = FailsafePath::new(turn_steps, straight_s);
            let start = Pose { position: Point2::origin(), heading_rad: 0.5 };
            let [now, later] = [time_s, time_s + 0.01].map(|time_s| path.pose(&start, &RATES, time_s));
            prop_assert!((later.position - now.position).norm() < 0.25 + 1e-6);
            prop_assert!(crate::wrap(later.heading_rad - now.heading_rad).abs() < 0.0025 + 1e-9);
            let (speed_m_s, turn_rate_rad_s) = path.rates(&RATES, time_s);
            prop_assert!((12.0..=25.0).contains(&speed_m_s) && turn_rate_rad_s.abs() <= 0.25);
        }
    }
}
