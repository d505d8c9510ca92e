//! A path through places at given times, as a flight that was recorded or planned elsewhere.
//!
//! Between two points, the place is a cubic of the time whose velocities at both ends follow from the points beside them
//! (finite differences of second order). So the velocity never jumps, and a wrong point bends the path only near itself.
//! Must never smooth the points: the path passes each of them at its time.

use super::{PathMotion, heading_of};
use crate::Pose;
use nalgebra::{Point2, Vector2};
use serde::{Deserialize, Serialize};

/// Where the leader is at one time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TrackPoint {
    /// The time.
    pub time_s: f64,
    /// The place (x east, y north).
    pub position_m: [f64; 2],
}

/// Points with the velocities at them.
#[derive(Debug, Clone, PartialEq)]
pub struct Track {
    /// At least two, in order of time.
    knots: Vec<Knot>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Knot {
    time_s: f64,
    place: Point2<f64>,
    velocity_m_s: Vector2<f64>,
}

impl Track {
    /// See [`LeaderPath::track`](super::LeaderPath::track).
    pub(super) fn new(points: &[TrackPoint]) -> Self {
        assert!(points.len() >= 2, "a track needs two points");
        let slopes: Vec<_> = points.windows(2).map(|pair| slope(&pair[0], &pair[1])).collect();
        let knot = |(index, point): (usize, &TrackPoint)| Knot {
            time_s: point.time_s,
            place: point.position_m.into(),
            velocity_m_s: velocity(&slopes, index),
        };
        Self { knots: points.iter().enumerate().map(knot).collect() }
    }

    pub(super) fn at(&self, time_s: f64) -> PathMotion {
        // The time of a point belongs to the stretch after it, so no time is in two stretches.
        let after = self.knots.partition_point(|knot| knot.time_s <= time_s);
        match (after.checked_sub(1).map(|before| &self.knots[before]), self.knots.get(after)) {
            (Some(from), Some(to)) => between(from, to, time_s),
            // Before the first point and after the last one, the leader flies straight.
            (Some(end), None) | (None, Some(end)) => {
                let place = end.place + end.velocity_m_s * (time_s - end.time_s);
                motion(place, end.velocity_m_s, Vector2::zeros())
            }
            (None, None) => unreachable!("a track has points"),
        }
    }
}

/// The time between two points and the mean velocity.
fn slope(from: &TrackPoint, to: &TrackPoint) -> (f64, Vector2<f64>) {
    let duration_s = to.time_s - from.time_s;
    assert!(duration_s > 0.0, "the times of a track grow");
    (duration_s, (Point2::from(to.position_m) - Point2::from(from.position_m)) / duration_s)
}

/// The velocity at point `index`: that of the parabola through it and the points beside it.
fn velocity(slopes: &[(f64, Vector2<f64>)], index: usize) -> Vector2<f64> {
    let at_end = |(near_s, near): (f64, Vector2<f64>), (far_s, far): (f64, Vector2<f64>)| {
        near + (near - far) * (near_s / (near_s + far_s))
    };
    match (index.checked_sub(1).and_then(|before| slopes.get(before)), slopes.get(index)) {
        (Some((before_s, before)), Some((after_s, after))) => {
            // Each slope counts by the duration of the other: the nearer neighbour says more about this point.
            (before * *after_s + after * *before_s) / (before_s + after_s)
        }
        // Two points define no parabola, so the leader flies straight between them.
        (None, Some(first)) => slopes.get(1).map_or(first.1, |second| at_end(*first, *second)),
        (Some(last), None) => {
            let other = index.checked_sub(2).and_then(|other| slopes.get(other));
            other.map_or(last.1, |other| at_end(*last, *other))
        }
        (None, None) => unreachable!("a track has two points"),
    }
}

/// Hermite's cubic between two points, with its first two derivatives.
fn between(from: &Knot, to: &Knot, time_s: f64) -> PathMotion {
    let duration_s = to.time_s - from.time_s;
    let s = (time_s - from.time_s) / duration_s;
    let way = to.place - from.place;
    let (start, end) = (from.velocity_m_s * duration_s, to.velocity_m_s * duration_s);
    // p(s) = a + start s + square s^2 + cube s^3, which meets places and velocities at s = 0 and 1.
    let square = way * 3.0 - start * 2.0 - end;
    let cube = start + end - way * 2.0;
    let place = from.place + start * s + square * (s * s) + cube * (s * s * s);
    let velocity_m_s = (start + square * (2.0 * s) + cube * (3.0 * s * s)) / duration_s;
    let acceleration_m_s2 = (square * 2.0 + cube * (6.0 * s)) / (duration_s * duration_s);
    motion(place, velocity_m_s, acceleration_m_s2)
}

fn motion(place: Point2<f64>, velocity_m_s: Vector2<f64>, acceleration_m_s2: Vector2<f64>) -> PathMotion {
    let speed_m_s = velocity_m_s.norm();
    let across = velocity_m_s.x * acceleration_m_s2.y - velocity_m_s.y * acceleration_m_s2.x;
    // A leader that stands has no heading and does not turn. Validation refuses such tracks.
    let turn_rate_rad_s = if speed_m_s > 0.0 { across / (speed_m_s * speed_m_s) } else { 0.0 };
    let pose = Pose { position: place, heading_rad: heading_of(velocity_m_s) };
    PathMotion { pose, speed_m_s, turn_rate_rad_s }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wrap;
    use proptest::prelude::*;

    /// A circle of 300 m at 15 m/s, with a point every `step_s`.
    fn circle(step_s: f64) -> Track {
        let point = |number: i32| {
            let time_s = f64::from(number) * step_s;
            let (sin, cos) = (0.05 * time_s).sin_cos();
            TrackPoint { time_s, position_m: [300.0 * sin, 300.0 - 300.0 * cos] }
        };
        Track::new(&(0..=200).map(point).collect::<Vec<_>>())
    }

    #[test]
    fn a_circle_of_points_is_flown_as_a_circle() {
        let track = circle(1.0);
        for time_s in [5.0, 5.3, 77.5, 150.99] {
            let motion = track.at(time_s);
            assert!(((motion.pose.position - Point2::new(0.0, 300.0)).norm() - 300.0).abs() < 1e-3);
            assert!((motion.speed_m_s - 15.0).abs() < 0.02, "{}", motion.speed_m_s);
            assert!((motion.turn_rate_rad_s - 0.05).abs() < 1e-3, "{}", motion.turn_rate_rad_s);
        }
    }

    #[test]
    fn outside_its_times_the_track_goes_straight_on() {
        let points = [(0.0, [0.0, 0.0]), (2.0, [30.0, 0.0])];
        let track = Track::new(&points.map(|(time_s, position_m)| TrackPoint { time_s, position_m }));
        for (time_s, x) in [(-1.0, -15.0), (1.0, 15.0), (4.0, 60.0)] {
            let motion = track.at(time_s);
            assert!((motion.pose.position - Point2::new(x, 0.0)).norm() < 1e-12);
            assert_eq!((motion.speed_m_s, motion.turn_rate_rad_s), (15.0, 0.0));
        }
    }

    proptest! {
        #[test]
        fn each_point_is_passed_at_its_time_without_a_jump_of_the_velocity(
            steps in prop::collection::vec((0.5..3.0, -0.3..0.3), 2..12),
        ) {
            let (mut time_s, mut heading, mut place) = (0.0, 0.0, Point2::origin());
            let mut points = vec![TrackPoint { time_s, position_m: place.into() }];
            for (step_s, turn) in steps {
                heading += turn;
                time_s += step_s;
                place += crate::direction(heading) * (15.0 * step_s);
                points.push(TrackPoint { time_s, position_m: place.into() });
            }
            let track = Track::new(&points);
            for point in &points {
                let (before, here, after) =
                    (track.at(point.time_s - 1e-7), track.at(point.time_s), track.at(point.time_s + 1e-7));
                prop_assert!((here.pose.position - Point2::from(point.position_m)).norm() < 1e-9);
                prop_assert!((before.speed_m_s - after.speed_m_s).abs() < 1e-4);
                prop_assert!(wrap(before.pose.heading_rad - after.pose.heading_rad).abs() < 1e-5);
            }
        }
    }
}
