//! How close the swarm came to an obstacle, wherever that moves, and which UAVs the obstacle repelled.

use super::ObstacleSummary;
use nalgebra::Point2;
use ringwing_flight::{Route, Tick, UavId};
use ringwing_scenario::ObstacleSection;

/// Watches one obstacle.
#[derive(Debug, Clone)]
pub(super) struct ObstacleWatch {
    obstacle: ObstacleSection,
    route: Route,
    rate_hz: u32,
    /// The closest approach of each UAV, UAV 1 first; `None` for UAVs that never flew.
    nearest: Vec<Option<Nearest>>,
}

#[derive(Debug, Clone, Copy)]
struct Nearest {
    distance_m: f64,
    uav: u32,
    tick: i64,
}

impl ObstacleWatch {
    pub(super) fn new(obstacle: &ObstacleSection, rate_hz: u32) -> Self {
        Self { obstacle: obstacle.clone(), route: obstacle.route(), rate_hz, nearest: Vec::new() }
    }

    /// Takes the positions of all UAVs at `tick`; returns the smallest distance from the obstacle's edge to any of them,
    /// negative inside, or `None` without UAVs.
    pub(super) fn observe(&mut self, tick: i64, places: &[(u32, Point2<f64>)]) -> Option<f64> {
        let centre = self.route.at(Tick(tick).seconds(self.rate_hz)).pose.position;
        let mut closest_m: Option<f64> = None;
        for (uav, place) in places {
            let distance_m = (place - centre).norm();
            closest_m = Some(closest_m.map_or(distance_m, |closest_m| closest_m.min(distance_m)));
            let index = UavId(*uav).index();
            // The watch does not know the size of the swarm; it grows with the numbers that it sees.
            if index >= self.nearest.len() {
                self.nearest.resize(index + 1, None);
            }
            let so_far = &mut self.nearest[index];
            if distance_m.is_finite() && so_far.is_none_or(|so_far| distance_m < so_far.distance_m) {
                *so_far = Some(Nearest { distance_m, uav: *uav, tick });
            }
        }
        closest_m.map(|closest_m| closest_m - self.obstacle.radius_m)
    }

    /// The closest approach of the flight; `None` if no UAV has flown yet.
    pub(super) fn summary(&self) -> Option<ObstacleSummary> {
        let mut approaches: Vec<Nearest> = self.nearest.iter().flatten().copied().collect();
        // A stable sort: of equally close UAVs, the lowest number comes first.
        approaches.sort_by(|a, b| a.distance_m.total_cmp(&b.distance_m));
        let closest = approaches.first()?;
        let is_repelled = |one: &&Nearest| one.distance_m < self.obstacle.braking_distance_m;
        Some(ObstacleSummary {
            name: self.obstacle.name.clone(),
            clearance_m: closest.distance_m - self.obstacle.radius_m,
            uav: closest.uav,
            time_s: Tick(closest.tick).seconds(self.rate_hz),
            repelled: approaches.iter().take_while(is_repelled).map(|one| one.uav).collect(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_uav_that_was_repelled_hardest_comes_first() {
        let mut watch = ObstacleWatch::new(&crate::testing::obstacle([100.0, 0.0]), 100);
        let at = |uav, x| (uav, Point2::new(x, 0.0));
        watch.observe(0, &[at(1, 100.0 - 18.0), at(2, 0.0), at(3, 100.0 - 19.0)]);
        watch.observe(1, &[at(1, 0.0), at(3, 100.0 - 12.0)]);
        assert_eq!(watch.summary().map(|summary| summary.repelled), Some(vec![3, 1]));
    }

    #[test]
    fn clearance_is_to_the_edge_and_negative_inside() {
        let mut watch = ObstacleWatch::new(&crate::testing::obstacle([100.0, 0.0]), 100);
        assert_eq!(watch.summary(), None);
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
        assert_eq!(watch.summary(), Some(expected));
    }

    #[test]
    fn a_uav_at_the_braking_distance_is_not_repelled_and_of_equal_approaches_the_first_counts() {
        let mut watch = ObstacleWatch::new(&crate::testing::obstacle([100.0, 0.0]), 100);
        let at = |uav, x| (uav, Point2::new(x, 0.0));
        for tick in [100, 200] {
            assert_eq!(watch.observe(tick, &[at(1, 0.0), at(2, 70.0)]), Some(20.0));
        }
        let summary = watch.summary().unwrap();
        assert_eq!((summary.uav, summary.time_s, summary.repelled.len()), (2, 1.0, 0));
    }

    #[test]
    fn clearance_is_to_where_a_moving_obstacle_is() {
        let drifting =
            ObstacleSection { velocity_m_s: [0.0, 10.0], ..crate::testing::obstacle([100.0, 0.0]) };
        let mut watch = ObstacleWatch::new(&drifting, 100);
        for tick in [0, 100, 200] {
            watch.observe(tick, &[(1, Point2::new(100.0, 35.0))]);
        }
        let summary = watch.summary().unwrap();
        assert!((summary.clearance_m - 5.0).abs() < 1e-9 && summary.time_s == 2.0, "{summary:?}");
    }
}
