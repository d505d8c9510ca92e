//! Fly-by waypoints: straight legs joined by arcs that touch both.
//!
//! Must never cut a corner with a smaller radius than asked for: where an arc has no room, it says so.

use super::{Leg, Legs, heading_of};
use crate::{Pose, wrap};
use nalgebra::Point2;

/// Why there is no path through waypoints. Waypoints count from 0.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum WaypointError {
    /// There are no waypoints.
    #[error("a path of waypoints needs at least one")]
    None,
    /// A waypoint is where the one before is, or the first one where the path starts.
    #[error("waypoint {index} is where the path already is, so no direction leads to it")]
    Coincident {
        /// The waypoint.
        index: usize,
    },
    /// The arcs at the two ends of a leg are longer than the leg.
    #[error("the leg to waypoint {index} is {length_m:.1} m long, and its turns need {needed_m:.1} m of it")]
    NoRoom {
        /// The waypoint at the end of the leg.
        index: usize,
        /// Length of the leg.
        length_m: f64,
        /// How much of it the arcs at its ends take.
        needed_m: f64,
        /// The largest radius with which they fit.
        radius_max_m: f64,
    },
}

/// See [`LeaderPath::waypoints`](super::LeaderPath::waypoints).
pub(super) fn path(
    start: Point2<f64>,
    speed_m_s: f64,
    radius_m: f64,
    waypoints: &[Point2<f64>],
) -> Result<Legs, WaypointError> {
    let first = waypoints.first().ok_or(WaypointError::None)?;
    let before = || std::iter::once(&start).chain(waypoints);
    let ways: Vec<_> = before().zip(waypoints).map(|(from, to)| to - from).collect();
    if let Some(index) = ways.iter().position(|way| way.norm() == 0.0) {
        return Err(WaypointError::Coincident { index });
    }
    // Wrapped, so that the leader turns the shorter way round.
    let corners: Vec<f64> =
        ways.windows(2).map(|pair| wrap(heading_of(pair[1]) - heading_of(pair[0]))).collect();
    // An arc that touches both legs begins rho tan(delta / 2) before the corner.
    let tangent_m =
        |corner: Option<&f64>| corner.map_or(0.0, |corner_rad| radius_m * libm::tan(corner_rad.abs() / 2.0));
    let mut legs = Vec::new();
    for (index, way) in ways.iter().enumerate() {
        let (length_m, corner) = (way.norm(), corners.get(index));
        let needed_m =
            tangent_m(index.checked_sub(1).and_then(|before| corners.get(before))) + tangent_m(corner);
        if needed_m > length_m {
            // Both tangents grow with the radius, so this is where they just fit.
            let radius_max_m = radius_m * length_m / needed_m;
            return Err(WaypointError::NoRoom { index, length_m, needed_m, radius_max_m });
        }
        legs.push(Leg { turn_rate_rad_s: 0.0, duration_s: (length_m - needed_m) / speed_m_s });
        if let Some(corner_rad) = corner {
            let turn_rate_rad_s = (speed_m_s / radius_m).copysign(*corner_rad);
            legs.push(Leg { turn_rate_rad_s, duration_s: radius_m * corner_rad.abs() / speed_m_s });
        }
    }
    // Straight on after the last waypoint: its leg never ends.
    if let Some(last) = legs.last_mut() {
        last.duration_s = f64::INFINITY;
    }
    let start = Pose { position: start, heading_rad: heading_of(first - start) };
    Ok(Legs::once(start, speed_m_s, legs))
}

#[cfg(test)]
mod tests {
    use super::{super::LeaderPath, *};
    use std::f64::consts::PI;

    fn path(radius_m: f64, places: &[[f64; 2]]) -> Result<LeaderPath, WaypointError> {
        let waypoints: Vec<_> = places.iter().map(|place| Point2::from(*place)).collect();
        LeaderPath::waypoints(Point2::origin(), 10.0, radius_m, &waypoints)
    }

    #[test]
    fn a_corner_is_flown_by_on_an_arc_that_touches_both_legs() {
        let path = path(100.0, &[[500.0, 0.0], [500.0, 400.0]]).unwrap();
        // A right angle takes 100 m of each leg, and an arc of 50 pi m.
        let half_way = path.at(40.0 + 25.0 * PI / 10.0);
        let expected = Point2::new(400.0 + 100.0 * (PI / 4.0).sin(), 100.0 - 100.0 * (PI / 4.0).cos());
        assert!((half_way.pose.position - expected).norm() < 1e-9);
        assert!((half_way.turn_rate_rad_s - 0.1).abs() < 1e-12);
        let after = path.at(40.0 + 5.0 * PI + 10.0).pose;
        assert!((after.position - Point2::new(500.0, 200.0)).norm() < 1e-9);
        assert!((after.heading_rad - PI / 2.0).abs() < 1e-12);
        let beyond = path.at(40.0 + 5.0 * PI + 130.0).pose;
        assert!((beyond.position - Point2::new(500.0, 1400.0)).norm() < 1e-9, "it flies straight on");
    }

    #[test]
    fn one_waypoint_is_a_direction() {
        let motion = path(100.0, &[[0.0, -50.0]]).unwrap().at(20.0);
        assert!((motion.pose.position - Point2::new(0.0, -200.0)).norm() < 1e-9);
    }

    #[test]
    fn arcs_that_do_not_fit_are_refused_with_the_radius_that_does() {
        let square = [[300.0, 0.0], [300.0, 150.0], [0.0, 150.0]];
        let refused = path(100.0, &square).unwrap_err();
        let WaypointError::NoRoom { index, length_m, needed_m, radius_max_m } = refused else {
            panic!("{refused}")
        };
        assert_eq!((index, length_m), (1, 150.0));
        assert!((needed_m - 200.0).abs() < 1e-9 && (radius_max_m - 75.0).abs() < 1e-9);
        assert!(path(74.999, &square).is_ok() && path(75.001, &square).is_err());
    }

    #[test]
    fn waypoints_without_a_direction_between_them_are_refused() {
        assert_eq!(path(10.0, &[]), Err(WaypointError::None));
        assert_eq!(path(10.0, &[[0.0, 0.0]]), Err(WaypointError::Coincident { index: 0 }));
        let twice = [[100.0, 0.0], [100.0, 0.0]];
        assert_eq!(path(10.0, &twice), Err(WaypointError::Coincident { index: 1 }));
        assert!(path(10.0, &[[100.0, 0.0], [50.0, 0.0]]).is_err(), "no arc turns back on the same line");
    }
}
