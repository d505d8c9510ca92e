//! The way of something that nobody steers: an obstacle that moves, or an intruder.
//!
//! A route is a pure function of time, so the world, the recorder and every reader of a log agree on where its owner is, to
//! the bit. Never reacts to anything.

use crate::{Pose, direction};
use nalgebra::{Point2, Vector2};

/// Where something is, and how it moves on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RoutePoint {
    /// Position and heading.
    pub pose: Pose,
    /// Speed along the heading.
    pub speed_m_s: f64,
    /// Rate of the heading.
    pub turn_rate_rad_s: f64,
}

impl RoutePoint {
    /// The velocity, east and north, in m/s; exactly zero for what stands.
    pub fn velocity_m_s(&self) -> Vector2<f64> {
        if self.speed_m_s == 0.0 {
            return Vector2::zeros();
        }
        direction(self.pose.heading_rad) * self.speed_m_s
    }

    /// After `duration_s` at this speed and turn rate.
    fn after(&self, duration_s: f64) -> Self {
        // What stands keeps its place to the bit.
        if self.speed_m_s == 0.0 {
            return *self;
        }
        Self { pose: self.pose.after(self.speed_m_s, self.turn_rate_rad_s, duration_s), ..*self }
    }
}

/// A straight way from one place to the next.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Leg {
    start: RoutePoint,
    begin_s: f64,
    end_s: f64,
}

/// Legs through waypoints, and what follows after them.
#[derive(Debug, Clone, PartialEq)]
pub struct Route {
    legs: Vec<Leg>,
    /// `None` if the legs begin again after the last one.
    then: Option<RoutePoint>,
}

impl Route {
    /// The way that begins with `start` at time 0 and never changes speed or turn rate.
    pub fn steady(start: RoutePoint) -> Self {
        Self { legs: Vec::new(), then: Some(start) }
    }

    /// From `start` straight to each of the `waypoints` at `speed_m_s`, with a turn at once at each. After the last one
    /// `then` says how to move on, given the heading there.
    pub fn through(
        start: Point2<f64>,
        waypoints: &[Point2<f64>],
        speed_m_s: f64,
        then: impl FnOnce(Pose) -> RoutePoint,
    ) -> Self {
        let legs = legs(start, waypoints, speed_m_s);
        let position = waypoints.last().copied().unwrap_or(start);
        let heading_rad = legs.last().map_or(0.0, |leg| leg.start.pose.heading_rad);
        Self { legs, then: Some(then(Pose { position, heading_rad })) }
    }

    /// From `start` straight to each of the `waypoints`, back to the start, and round again. If all of them coincide, it
    /// stays there.
    pub fn round(start: Point2<f64>, waypoints: &[Point2<f64>], speed_m_s: f64) -> Self {
        let all: Vec<_> = waypoints.iter().copied().chain([start]).collect();
        let legs = legs(start, &all, speed_m_s);
        let pose = Pose { position: start, heading_rad: 0.0 };
        let stands = RoutePoint { pose, speed_m_s: 0.0, turn_rate_rad_s: 0.0 };
        // Without a leg there is nothing to repeat, and `at` would find no leg to return.
        Self { then: legs.is_empty().then_some(stands), legs }
    }

    /// Where its owner is at `time_s`; before time 0, on the way to its start.
    pub fn at(&self, time_s: f64) -> RoutePoint {
        let length_s = self.legs.last().map_or(0.0, |leg| leg.end_s);
        // A time before 0 must not wrap: then its owner is still on the way to its start.
        let time_s = if self.then.is_none() && time_s > length_s { time_s % length_s } else { time_s };
        match (self.legs.iter().find(|leg| time_s < leg.end_s), &self.then) {
            (Some(leg), _) => leg.start.after(time_s - leg.begin_s),
            (None, Some(then)) => then.after(time_s - length_s),
            // Only at the very end of a round trip is it on none of its legs.
            (None, None) => self.legs[0].start,
        }
    }
}

/// Places that coincide have no leg between them.
fn legs(start: Point2<f64>, waypoints: &[Point2<f64>], speed_m_s: f64) -> Vec<Leg> {
    let mut legs: Vec<Leg> = Vec::new();
    let mut from = start;
    for to in waypoints {
        let way = to - from;
        let length_m = way.norm();
        if length_m > 0.0 {
            let pose = Pose { position: from, heading_rad: libm::atan2(way.y, way.x) };
            let begin_s = legs.last().map_or(0.0, |leg| leg.end_s);
            let start = RoutePoint { pose, speed_m_s, turn_rate_rad_s: 0.0 };
            legs.push(Leg { start, begin_s, end_s: begin_s + length_m / speed_m_s });
        }
        from = *to;
    }
    legs
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const START: Point2<f64> = Point2::new(10.0, 0.0);

    fn place(route: &Route, time_s: f64) -> [f64; 2] {
        route.at(time_s).pose.position.map(|number| (number * 1e9).round() / 1e9).into()
    }

    fn standing(pose: Pose) -> RoutePoint {
        RoutePoint { pose, speed_m_s: 0.0, turn_rate_rad_s: 0.0 }
    }

    #[test]
    fn waypoints_are_reached_in_turn_and_then_something_else_begins() {
        let waypoints = [Point2::new(10.0, 20.0), Point2::new(40.0, 20.0)];
        let route = Route::through(START, &waypoints, 10.0, standing);
        assert_eq!(
            [-1.0, 0.0, 1.0, 2.0].map(|at| place(&route, at)),
            [[10.0, -10.0], [10.0, 0.0], [10.0, 10.0], [10.0, 20.0]]
        );
        assert_eq!([3.5, 5.0, 99.0].map(|at| place(&route, at)), [[25.0, 20.0], [40.0, 20.0], [40.0, 20.0]]);
        assert_eq!(route.at(99.0).velocity_m_s(), Vector2::zeros());
        let on = |pose| RoutePoint { pose, speed_m_s: 5.0, turn_rate_rad_s: 0.0 };
        assert_eq!(place(&Route::through(START, &waypoints, 10.0, on), 7.0), [50.0, 20.0], "straight on");
    }

    #[test]
    fn a_round_trip_begins_again_at_its_start() {
        let route = Route::round(START, &[Point2::new(10.0, 20.0)], 10.0);
        assert_eq!(
            [3.0, 4.0, 5.0, 8.0].map(|at| place(&route, at)),
            [[10.0, 10.0], [10.0, 0.0], [10.0, 10.0], [10.0, 0.0]]
        );
        assert!((route.at(3.0).velocity_m_s() - Vector2::new(0.0, -10.0)).norm() < 1e-9);
    }

    #[test]
    fn what_stands_keeps_its_place_to_the_bit() {
        let pose = Pose { position: Point2::new(-0.0, 0.1), heading_rad: 0.3 };
        let stands = Route::steady(standing(pose)).at(12.3).pose.position;
        assert_eq!([stands.x.to_bits(), stands.y.to_bits()], [(-0.0_f64).to_bits(), 0.1_f64.to_bits()]);
    }

    #[test]
    fn waypoints_that_coincide_take_no_time() {
        let route = Route::through(START, &[START, START, Point2::new(20.0, 0.0)], 10.0, standing);
        assert_eq!((place(&route, 0.5), place(&route, 1.0)), ([15.0, 0.0], [20.0, 0.0]));
    }

    proptest! {
        #[test]
        fn a_route_never_jumps(
            points in proptest::collection::vec((-50.0..50.0_f64, -50.0..50.0_f64), 1..5), time_s in -1.0..60.0_f64,
        ) {
            let waypoints: Vec<_> = points.into_iter().map(|(x, y)| Point2::new(x, y)).collect();
            let on = |pose| RoutePoint { pose, speed_m_s: 4.0, turn_rate_rad_s: 0.2 };
            for route in [Route::round(START, &waypoints, 4.0), Route::through(START, &waypoints, 4.0, on)] {
                let moved_m = (route.at(time_s + 0.01).pose.position - route.at(time_s).pose.position).norm();
                prop_assert!(moved_m <= 0.04 + 1e-9, "{moved_m}");
            }
        }
    }
}
