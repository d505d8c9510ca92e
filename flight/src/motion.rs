//! The motion of a fixed-wing UAV in the plane: the exact solution of Eq. (1).
//!
//! World, leader and agents must all use this solution: then an agent predicts, to the bit, what the world flies.

use nalgebra::{Point2, Vector2};
use std::f64::consts::{PI, TAU};

/// A place and a heading.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// Position in the local frame (x east, y north), metres.
    pub position: Point2<f64>,
    /// Heading from the x axis, counterclockwise, in (-pi, pi].
    pub heading_rad: f64,
}

impl Pose {
    /// The pose after `duration_s` at constant speed and turn rate, by Eq. (1) in closed form. A negative duration
    /// leads back.
    ///
    /// The path is an arc. Its chord is `speed * duration * sinc(turn / 2)` long, and points half the turn away from
    /// the heading at the start. Straight flight is the limit of this for no turn, and needs no case of its own.
    #[must_use]
    pub fn after(&self, speed_m_s: f64, turn_rate_rad_s: f64, duration_s: f64) -> Self {
        let half_turn = turn_rate_rad_s * duration_s / 2.0;
        let chord_m = speed_m_s * duration_s * sinc(half_turn);
        Self {
            position: self.position + direction(self.heading_rad + half_turn) * chord_m,
            heading_rad: wrap(self.heading_rad + 2.0 * half_turn),
        }
    }

    /// The pose after moving air has carried it for `duration_s`.
    #[must_use]
    pub fn carried(&self, wind_m_s: Vector2<f64>, duration_s: f64) -> Self {
        // In still air, return the same bits: adding a zero could change the sign of a zero.
        if wind_m_s == Vector2::zeros() {
            return *self;
        }
        Self { position: self.position + wind_m_s * duration_s, ..*self }
    }
}

/// The unit vector in the direction `heading_rad`: h of the paper.
pub fn direction(heading_rad: f64) -> Vector2<f64> {
    // The standard library may round differently on another machine, and the flight would differ with it.
    Vector2::new(libm::cos(heading_rad), libm::sin(heading_rad))
}

/// `vector` turned counterclockwise by `angle_rad`. No angle leaves it as it is, to the bit.
pub fn turned(vector: Vector2<f64>, angle_rad: f64) -> Vector2<f64> {
    let along = direction(angle_rad);
    Vector2::new(along.x * vector.x - along.y * vector.y, along.y * vector.x + along.x * vector.y)
}

/// How far something gets in `duration_s` that begins with `velocity_m_s` and turns at `turn_rate_rad_s`: the chord of its
/// arc, in m.
pub fn chord(velocity_m_s: Vector2<f64>, turn_rate_rad_s: f64, duration_s: f64) -> Vector2<f64> {
    let half_turn = turn_rate_rad_s * duration_s / 2.0;
    turned(velocity_m_s * duration_s, half_turn) * sinc(half_turn)
}

/// `angle_rad` brought into (-pi, pi] by whole turns.
pub fn wrap(angle_rad: f64) -> f64 {
    if angle_rad > -PI && angle_rad <= PI {
        return angle_rad;
    }
    // The remainder is in [-pi, pi]; -pi itself belongs to the other end.
    let turned = libm::remainder(angle_rad, TAU);
    if turned <= -PI { turned + TAU } else { turned }
}

/// Below this, the first two terms of the series of sin(x) / x are exact to the last bit. A larger limit would lose
/// bits; zero would divide by zero.
const SERIES_BELOW: f64 = 1e-4;

/// sin(x) / x, continued to 1 at x = 0.
fn sinc(x: f64) -> f64 {
    if x.abs() < SERIES_BELOW { 1.0 - x * x / 6.0 } else { libm::sin(x) / x }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Eq. (1) integrated numerically, in many small steps.
    fn integrated(mut pose: Pose, speed: f64, turn_rate: f64, duration: f64) -> Pose {
        const STEPS: u32 = 20_000;
        let step = duration / f64::from(STEPS);
        for _ in 0..STEPS {
            // The heading in the middle of the step makes the error fall with the square of its length.
            pose.position += direction(pose.heading_rad + turn_rate * step / 2.0) * speed * step;
            pose.heading_rad += turn_rate * step;
        }
        pose
    }

    proptest! {
        #[test]
        fn the_closed_form_solves_the_differential_equation(
            heading in -3.0..3.0, speed in 12.0..25.0, turn_rate in -0.5..0.5, duration in 0.001..2.0,
        ) {
            let start = Pose { position: Point2::new(3.0, -4.0), heading_rad: heading };
            let exact = start.after(speed, turn_rate, duration);
            let numeric = integrated(start, speed, turn_rate, duration);
            prop_assert!((exact.position - numeric.position).norm() < 1e-7);
            prop_assert!(wrap(exact.heading_rad - numeric.heading_rad).abs() < 1e-9);
        }

        #[test]
        fn a_negative_duration_leads_back_to_the_start(
            heading in -3.0..3.0, speed in 12.0..25.0, turn_rate in -0.5..0.5,
        ) {
            let start = Pose { position: Point2::origin(), heading_rad: heading };
            let back = start.after(speed, turn_rate, 0.01).after(speed, turn_rate, -0.01);
            prop_assert!((back.position - start.position).norm() < 1e-12);
            prop_assert!(wrap(back.heading_rad - start.heading_rad).abs() < 1e-12);
        }

        #[test]
        fn a_wrapped_angle_points_the_same_way(angle in -1e4..1e4) {
            let wrapped = wrap(angle);
            prop_assert!(wrapped > -PI && wrapped <= PI);
            prop_assert!((direction(wrapped) - direction(angle)).norm() < 1e-9);
        }
    }

    #[test]
    fn a_chord_joins_the_ends_of_an_arc() {
        let start = Pose { position: Point2::new(1.0, 2.0), heading_rad: 0.7 };
        for (turn_rate, duration) in [(0.0, 4.0), (0.3, 2.5), (-0.5, 10.0)] {
            let end = start.position + chord(direction(0.7) * 15.0, turn_rate, duration);
            assert!((end - start.after(15.0, turn_rate, duration).position).norm() < 1e-12);
        }
        let velocity = Vector2::new(-12.5, 0.1);
        assert_eq!(chord(velocity, 0.0, 3.0), velocity * 3.0, "straight flight gives the same bits");
    }

    #[test]
    fn straight_flight_is_the_limit_of_a_turn() {
        let start = Pose { position: Point2::origin(), heading_rad: 0.3 };
        let (straight, slight) = (start.after(15.0, 0.0, 1.0), start.after(15.0, 1e-9, 1.0));
        assert!((straight.position - slight.position).norm() < 1e-7);
    }
}
