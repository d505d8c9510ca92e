//! Where an obstacle is: it stands, or follows its route whatever happens around it.
//!
//! Never decides what an obstacle does to a UAV.

use nalgebra::Point2;
use ringwing_flight::{Route, RoutePoint, SensedObstacle};
use ringwing_scenario::ObstacleSection;

/// An obstacle at one moment.
#[derive(Debug, Clone)]
pub(crate) struct Obstacle {
    pub(crate) section: ObstacleSection,
    route: Route,
    now: RoutePoint,
}

impl Obstacle {
    pub(crate) fn new(section: &ObstacleSection, time_s: f64) -> Self {
        let route = section.route();
        Self { section: section.clone(), now: route.at(time_s), route }
    }

    /// Moves it to where it is at `time_s`.
    pub(crate) fn move_to(&mut self, time_s: f64) {
        // By the time and not by steps from the last place, so that no rounding errors add up.
        self.now = self.route.at(time_s);
    }

    pub(crate) fn position(&self) -> Point2<f64> {
        self.now.pose.position
    }

    /// Distance of `place` from its edge; negative inside.
    pub(crate) fn to_edge_m(&self, place: &Point2<f64>) -> f64 {
        (place - self.position()).norm() - self.section.radius_m
    }

    /// As a UAV's sensors report it.
    pub(crate) fn sensed(&self) -> SensedObstacle {
        SensedObstacle {
            position_m: self.position().into(),
            radius_m: self.section.radius_m,
            braking_distance_m: self.section.braking_distance_m,
            velocity_m_s: self.now.velocity_m_s().into(),
        }
    }
}
