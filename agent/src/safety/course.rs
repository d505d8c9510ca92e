//! Where something will be over the next seconds, at a few moments.
//!
//! All places are relative to where the UAV is now, and turned so that it heads along x: then the courses that it can take
//! are the same in every tick. Never knows who flies the course.

use crate::law::saturate;
use nalgebra::{Point2, Rotation2, Vector2};
use ringwing_flight::{Pose, direction, wrap};

/// Moments at which a course is known, evenly spread over the horizon. More miss less between two of them and cost more
/// time; at 16 over 4 s and 25 m/s, two of them are 6 m apart.
pub(super) const SAMPLES: usize = 16;

/// A course. Single precision is exact to a hundredth of a millimetre here, and twice as fast.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Course {
    pub(super) x_m: [f32; SAMPLES],
    pub(super) y_m: [f32; SAMPLES],
}

impl Course {
    /// The course through `place` at each moment, in seconds from now.
    pub(super) fn through(horizon_s: f64, place: impl Fn(f64) -> Vector2<f64>) -> Self {
        let mut course = Self { x_m: [0.0; SAMPLES], y_m: [0.0; SAMPLES] };
        for (sample, (x_m, y_m)) in (1..).zip(course.x_m.iter_mut().zip(&mut course.y_m)) {
            let place = place(horizon_s * f64::from(sample) / SAMPLES as f64);
            (*x_m, *y_m) = (place.x as f32, place.y as f32);
        }
        course
    }

    /// The place at the first moment.
    pub(super) fn first(&self) -> [f32; 2] {
        [self.x_m[0], self.y_m[0]]
    }

    /// The place at the end of the horizon.
    pub(super) fn last(&self) -> [f32; 2] {
        [self.x_m[SAMPLES - 1], self.y_m[SAMPLES - 1]]
    }

    /// What a UAV flies at a speed of 1 m/s that would turn by `turn_rad` at `turn_rate_rad_s` of the faster one, and fly
    /// straight on. At another speed, the course is longer by that factor.
    pub(super) fn after_turn(turn_rad: f64, turn_rate_rad_s: f64, horizon_s: f64) -> Self {
        let turning_s = turn_rad.abs() / turn_rate_rad_s;
        let start = Pose { position: Point2::origin(), heading_rad: 0.0 };
        let rate_rad_s = turn_rate_rad_s.copysign(turn_rad);
        Self::through(horizon_s, |time_s| {
            let turned = start.after(1.0, rate_rad_s, time_s.min(turning_s));
            let straight_s = (time_s - turning_s).max(0.0);
            turned.position.coords + direction(turned.heading_rad) * straight_s
        })
    }

    /// What a UAV flies that begins with `heading_rad` 0 and heads for where `force` points, turning at `turn_rate_rad_s`
    /// at most; `speed` makes a speed of the force along the heading. The course is given for a speed of 1 m/s, to be flown
    /// at `unit_m_s`. Also returns where it heads half way.
    pub(super) fn under_law(
        own: &Pose,
        turn_rate_rad_s: f64,
        horizon_s: f64,
        unit_m_s: f64,
        force: impl Fn(&Pose, f64) -> Vector2<f64>,
        speed: impl Fn(f64) -> f64,
    ) -> (Self, f64) {
        let step_s = horizon_s / SAMPLES as f64;
        let (mut pose, mut half_way_rad) = (*own, own.heading_rad);
        let mut course = Self { x_m: [0.0; SAMPLES], y_m: [0.0; SAMPLES] };
        for at in 0..SAMPLES {
            let pull = force(&pose, at as f64 * step_s);
            // The heading loop of Eq. (6) is stiff: within one step, the UAV heads along the force or turns all it can.
            let wanted_rad = wrap(libm::atan2(pull.y, pull.x) - pose.heading_rad);
            let rate_rad_s = saturate(wanted_rad / step_s, -turn_rate_rad_s, turn_rate_rad_s);
            pose = pose.after(speed(direction(pose.heading_rad).dot(&pull)), rate_rad_s, step_s);
            let seen = Rotation2::new(-own.heading_rad) * (pose.position - own.position);
            (course.x_m[at], course.y_m[at]) = ((seen.x / unit_m_s) as f32, (seen.y / unit_m_s) as f32);
            if at + 1 == SAMPLES / 2 {
                half_way_rad = pose.heading_rad;
            }
        }
        (course, half_way_rad)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turn_to_the_left_ends_in_a_straight_line_on_that_side() {
        let course = Course::after_turn(1.0, 0.5, 4.0);
        let [before, last] = [SAMPLES - 2, SAMPLES - 1].map(|at| (course.x_m[at], course.y_m[at]));
        let step = (last.0 - before.0, last.1 - before.1);
        assert!((step.1.atan2(step.0) - 1.0).abs() < 1e-4 && last.1 > 0.0);
        assert!((step.0.hypot(step.1) - 0.25).abs() < 1e-5);
    }

    #[test]
    fn a_turn_that_outlasts_the_horizon_is_an_arc() {
        let course = Course::after_turn(-3.0, 0.5, 4.0);
        let radius = |at: usize| course.x_m[at].hypot(course.y_m[at] + 2.0);
        assert!((0..SAMPLES).all(|at| (radius(at) - 2.0).abs() < 1e-5));
    }
}
