//! The paths that a virtual leader can fly, as functions of time.
//!
//! A path is a row of arcs and straight legs at constant speed, or a track of places and times. Its heading never
//! jumps; its turn rate may, where an arc meets a straight leg. Must never keep state: where the leader is depends on the
//! time alone, so a replaced leader goes on exactly where the lost one would be.

mod track;
mod waypoints;

pub use track::{Track, TrackPoint};
pub use waypoints::WaypointError;

use crate::{Pose, direction, wrap};
use nalgebra::{Point2, Vector2};
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// The side to which a path turns first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Turn {
    /// Counterclockwise.
    Left,
    /// Clockwise.
    Right,
}

impl Turn {
    /// The turn rate to this side on a circle of `radius_m`, at `speed_m_s`: `v / rho`, positive to the left.
    pub fn rate_rad_s(self, speed_m_s: f64, radius_m: f64) -> f64 {
        match self {
            Self::Left => speed_m_s / radius_m,
            Self::Right => -speed_m_s / radius_m,
        }
    }
}

/// The leader's pose at one time, and how it flies on from there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PathMotion {
    /// Position and heading.
    pub pose: Pose,
    /// Speed along the heading.
    pub speed_m_s: f64,
    /// Rate of the heading.
    pub turn_rate_rad_s: f64,
}

impl PathMotion {
    /// The velocity.
    pub fn velocity_m_s(&self) -> Vector2<f64> {
        direction(self.pose.heading_rad) * self.speed_m_s
    }
}

/// A path from time 0 on.
#[derive(Debug, Clone, PartialEq)]
pub enum LeaderPath {
    /// Arcs and straight legs at constant speed.
    Legs(Legs),
    /// Through places at given times.
    Track(Track),
}

impl LeaderPath {
    /// Straight on for ever (Assumption 1 of the paper).
    pub fn straight(start: Pose, speed_m_s: f64) -> Self {
        Self::Legs(Legs::once(start, speed_m_s, [Leg { turn_rate_rad_s: 0.0, duration_s: f64::INFINITY }]))
    }

    /// Round one circle for ever.
    pub fn circle(start: Pose, speed_m_s: f64, radius_m: f64, turn: Turn) -> Self {
        let turn_rate_rad_s = turn.rate_rad_s(speed_m_s, radius_m);
        Self::Legs(Legs::once(start, speed_m_s, [Leg { turn_rate_rad_s, duration_s: f64::INFINITY }]))
    }

    /// Round two circles that touch at the start, in turn, for ever.
    pub fn figure_eight(start: Pose, speed_m_s: f64, radius_m: f64, turn: Turn) -> Self {
        let turn_rate_rad_s = turn.rate_rad_s(speed_m_s, radius_m);
        let duration_s = 2.0 * PI * radius_m / speed_m_s;
        let first = Leg { turn_rate_rad_s, duration_s };
        let second = Leg { turn_rate_rad_s: -turn_rate_rad_s, duration_s };
        Self::Legs(Legs::for_ever(start, speed_m_s, [first, second]))
    }

    /// Round two straights of `length_m` that half circles join, for ever. The first straight begins at the start.
    pub fn racetrack(start: Pose, speed_m_s: f64, radius_m: f64, length_m: f64, turn: Turn) -> Self {
        let straight = Leg { turn_rate_rad_s: 0.0, duration_s: length_m / speed_m_s };
        let turn_rate_rad_s = turn.rate_rad_s(speed_m_s, radius_m);
        let half = Leg { turn_rate_rad_s, duration_s: PI * radius_m / speed_m_s };
        Self::Legs(Legs::for_ever(start, speed_m_s, [straight, half, straight, half]))
    }

    /// From `start` to each of `waypoints` in turn, and straight on after the last one.
    ///
    /// Corners are flown by: an arc of `radius_m` begins before the waypoint, touches both legs and passes inside of it.
    ///
    /// # Errors
    /// A waypoint is where the one before is, or the arcs at both ends of a leg do not fit on it.
    pub fn waypoints(
        start: Point2<f64>,
        speed_m_s: f64,
        radius_m: f64,
        waypoints: &[Point2<f64>],
    ) -> Result<Self, WaypointError> {
        waypoints::path(start, speed_m_s, radius_m, waypoints).map(Self::Legs)
    }

    /// Through these places at these times, and straight on after the last one.
    ///
    /// # Panics
    /// There are fewer than two points, or their times do not grow.
    pub fn track(points: &[TrackPoint]) -> Self {
        Self::Track(Track::new(points))
    }

    /// The places from time 0 to `duration_s`, evenly in time: one a second, but no more than `most`, which is at least 2.
    pub fn places(&self, duration_s: f64, most: u32) -> impl Iterator<Item = Point2<f64>> {
        let steps = (duration_s.ceil() as u32).clamp(1, most.max(2) - 1);
        (0..=steps).map(move |step| {
            let share = f64::from(step) / f64::from(steps);
            self.at(duration_s * share).pose.position
        })
    }

    /// The motion at `time_s`. Before time 0 the first leg is continued backwards.
    pub fn at(&self, time_s: f64) -> PathMotion {
        match self {
            Self::Legs(legs) => legs.at(time_s),
            Self::Track(track) => track.at(time_s),
        }
    }
}

/// A part of a path with one turn rate.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Leg {
    turn_rate_rad_s: f64,
    duration_s: f64,
}

/// A leg with its place in the path.
#[derive(Debug, Clone, Copy, PartialEq)]
struct PlacedLeg {
    begins_s: f64,
    start: Pose,
    turn_rate_rad_s: f64,
}

/// Legs flown at one speed, once or in laps.
#[derive(Debug, Clone, PartialEq)]
pub struct Legs {
    speed_m_s: f64,
    /// At least one, in order of time.
    legs: Vec<PlacedLeg>,
    /// How long a lap takes; `None` if the legs are flown once.
    lap_s: Option<f64>,
}

impl Legs {
    /// The legs flown once; the last one never ends.
    fn once(start: Pose, speed_m_s: f64, legs: impl IntoIterator<Item = Leg>) -> Self {
        let (legs, _) = place(start, speed_m_s, legs);
        Self { speed_m_s, legs, lap_s: None }
    }

    /// The legs flown again and again. They have to lead back to the start.
    fn for_ever(start: Pose, speed_m_s: f64, legs: impl IntoIterator<Item = Leg>) -> Self {
        let (legs, lap_s) = place(start, speed_m_s, legs);
        Self { speed_m_s, legs, lap_s: Some(lap_s) }
    }

    fn at(&self, time_s: f64) -> PathMotion {
        // Every lap begins at the same bits, so rounding does not add up over laps.
        let time_s = self.lap_s.map_or(time_s, |lap_s| time_s.rem_euclid(lap_s));
        let begun = self.legs.partition_point(|leg| leg.begins_s <= time_s);
        let PlacedLeg { begins_s, start, turn_rate_rad_s } = self.legs[begun.saturating_sub(1)];
        let pose = start.after(self.speed_m_s, turn_rate_rad_s, time_s - begins_s);
        PathMotion { pose, speed_m_s: self.speed_m_s, turn_rate_rad_s }
    }
}

/// The legs one after the other from `start`, and when the last one ends.
fn place(start: Pose, speed_m_s: f64, legs: impl IntoIterator<Item = Leg>) -> (Vec<PlacedLeg>, f64) {
    let (mut begins_s, mut pose) = (0.0, start);
    let mut placed = Vec::new();
    for Leg { turn_rate_rad_s, duration_s } in legs {
        placed.push(PlacedLeg { begins_s, start: pose, turn_rate_rad_s });
        // Nothing follows a leg that never ends.
        if duration_s.is_finite() {
            pose = pose.after(speed_m_s, turn_rate_rad_s, duration_s);
            begins_s += duration_s;
        }
    }
    (placed, begins_s)
}

/// The heading of `direction`, in (-pi, pi].
fn heading_of(direction: Vector2<f64>) -> f64 {
    wrap(libm::atan2(direction.y, direction.x))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const START: Pose = Pose { position: Point2::new(3.0, -4.0), heading_rad: 0.4 };

    fn turn() -> impl Strategy<Value = Turn> + Clone {
        prop_oneof![Just(Turn::Left), Just(Turn::Right)]
    }

    fn path() -> impl Strategy<Value = LeaderPath> {
        let sizes = (12.0..25.0, 60.0..400.0, 10.0..900.0, turn());
        prop_oneof![
            sizes.clone().prop_map(|(v, r, _, turn)| LeaderPath::circle(START, v, r, turn)),
            sizes.clone().prop_map(|(v, r, _, turn)| LeaderPath::figure_eight(START, v, r, turn)),
            sizes.prop_map(|(v, r, length, turn)| LeaderPath::racetrack(START, v, r, length, turn)),
            waypoint_path(),
        ]
    }

    /// Waypoints 500 m apart with corners of up to 120 degrees: two arcs of up to 140 m need 485 m of a leg.
    fn waypoint_path() -> impl Strategy<Value = LeaderPath> {
        let corners = prop::collection::vec(-2.09..2.09, 1..8);
        (corners, 12.0..25.0, 20.0..140.0).prop_map(|(corners, speed, radius)| {
            let (mut place, mut heading) = (START.position, 0.0);
            let mut next = |corner: f64| {
                heading += corner;
                place += direction(heading) * 500.0;
                place
            };
            let waypoints: Vec<_> = corners.into_iter().map(&mut next).collect();
            LeaderPath::waypoints(START.position, speed, radius, &waypoints).unwrap()
        })
    }

    proptest! {
        #[test]
        fn place_and_heading_never_jump(path in path(), time_s in 0.0..500.0) {
            // Over 10 ms, a leader at 25 m/s that turns at 1.25 rad/s moves 0.25 m and turns 0.0125 rad.
            let (before, after) = (path.at(time_s).pose, path.at(time_s + 0.01).pose);
            prop_assert!((after.position - before.position).norm() < 0.2501);
            prop_assert!(wrap(after.heading_rad - before.heading_rad).abs() < 0.012_51);
        }

        #[test]
        fn the_path_flies_the_speed_and_turn_rate_that_it_states(path in path(), time_s in 0.0..500.0) {
            let (now, soon) = (path.at(time_s), path.at(time_s + 1e-3));
            let predicted = now.pose.after(now.speed_m_s, now.turn_rate_rad_s, 1e-3);
            // Where a leg ends within this millisecond, the turn rate of the next one makes a difference.
            prop_assert!((predicted.position - soon.pose.position).norm() < 3e-5);
            prop_assert!(wrap(predicted.heading_rad - soon.pose.heading_rad).abs() < 3e-3);
            let is_same_leg = now.turn_rate_rad_s == soon.turn_rate_rad_s;
            prop_assert!(!is_same_leg || (predicted.position - soon.pose.position).norm() < 1e-9);
        }
    }

    #[test]
    fn a_circle_keeps_its_distance_from_its_centre() {
        for (turn, side) in [(Turn::Left, 1.0), (Turn::Right, -1.0)] {
            let path = LeaderPath::circle(START, 15.0, 300.0, turn);
            let centre = START.position + direction(0.4 + side * PI / 2.0) * 300.0;
            for time_s in [0.0, 1.0, 77.7, 1e4] {
                assert!(((path.at(time_s).pose.position - centre).norm() - 300.0).abs() < 1e-8);
            }
        }
    }

    #[test]
    fn laps_end_where_they_begin() {
        let racetrack = LeaderPath::racetrack(START, 15.0, 100.0, 600.0, Turn::Left);
        let eight = LeaderPath::figure_eight(START, 15.0, 100.0, Turn::Right);
        for (path, lap_m) in [(&racetrack, 1200.0 + 2.0 * PI * 100.0), (&eight, 4.0 * PI * 100.0)] {
            for laps in [1.0, 50.0] {
                let pose = path.at(laps * lap_m / 15.0).pose;
                assert!((pose.position - START.position).norm() < 1e-8, "{laps} laps");
                assert!(wrap(pose.heading_rad - START.heading_rad).abs() < 1e-9);
            }
        }
        // After the first straight and half of a circle, the leader flies back beside the first straight.
        let back = racetrack.at((600.0 + PI * 100.0 + 200.0) / 15.0).pose;
        let expected = START.position + direction(0.4) * 400.0 + direction(0.4 + PI / 2.0) * 200.0;
        assert!((back.position - expected).norm() < 1e-9);
        // Half of an eight later, the leader is at the crossing again and turns the other way.
        let crossing = eight.at(2.0 * PI * 100.0 / 15.0 + 1e-9);
        assert!((crossing.pose.position - START.position).norm() < 1e-6 && crossing.turn_rate_rad_s > 0.0);
    }
}
