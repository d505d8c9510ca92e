//! How close the swarm came to an obstacle, and whom it repelled.

use super::ObstacleSummary;
use crate::clock::Clock;
use nalgebra::Point2;
use ringwing_scenario::Obstacle;
use std::collections::BTreeSet;

/// Watches one obstacle.
#[derive(Debug, Clone)]
pub(super) struct ObstacleWatch {
    obstacle: Obstacle,
    closest: Option<Closest>,
    repelled: BTreeSet<u32>,
}

#[derive(Debug, Clone, Copy)]
struct Closest {
    distance_m: f64,
    uav: u32,
    tick: i64,
}

impl ObstacleWatch {
    pub(super) fn new(obstacle: &Obstacle) -> Self {
        Self { obstacle: obstacle.clone(), closest: None, repelled: BTreeSet::new() }
    }

    pub(super) fn observe(&mut self, tick: i64, places: &[(u32, Point2<f64>)]) {
        let centre = Point2::from(self.obstacle.position_m);
        for (uav, place) in places {
            let distance_m = (place - centre).norm();
            if distance_m < self.obstacle.braking_distance_m {
                self.repelled.insert(*uav);
            }
            if distance_m.is_finite() && self.closest.is_none_or(|closest| distance_m < closest.distance_m) {
                self.closest = Some(Closest { distance_m, uav: *uav, tick });
            }
        }
    }

    /// None while nobody has flown.
    pub(super) fn summary(&self, clock: Clock) -> Option<ObstacleSummary> {
        let closest = self.closest?;
        Some(ObstacleSummary {
            name: self.obstacle.name.clone(),
            clearance_m: closest.distance_m - self.obstacle.radius_m,
            uav: closest.uav,
            time_s: clock.seconds(closest.tick),
            repelled: self.repelled.iter().copied().collect(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clearance_is_to_the_edge_and_negative_inside() {
        let mut watch = ObstacleWatch::new(&crate::testing::obstacle([100.0, 0.0]));
        assert_eq!(watch.summary(Clock::new(100)), None);
        for (tick, x) in [(0, 40.0), (50, 96.0), (100, 85.0)] {
            watch.observe(tick, &[(1, Point2::new(0.0, 0.0)), (3, Point2::new(x, 0.0))]);
        }
        let expected = ObstacleSummary {
            name: "tower".into(),
            clearance_m: -6.0,
            uav: 3,
            time_s: 0.5,
            repelled: vec![3],
        };
        assert_eq!(watch.summary(Clock::new(100)), Some(expected));
    }
}
