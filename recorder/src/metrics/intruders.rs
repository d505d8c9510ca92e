//! How close the swarm came to an aircraft that nobody controls.

use super::IntruderSummary;
use nalgebra::Point2;
use ringwing_flight::{Route, Tick};
use ringwing_scenario::IntruderSection;

/// Watches one intruder.
#[derive(Debug, Clone)]
pub(super) struct IntruderWatch {
    number: u32,
    route: Route,
    rate_hz: u32,
    closest: Option<IntruderSummary>,
}

impl IntruderWatch {
    /// Watches the `number`th intruder of a scenario, counted from 1.
    pub(super) fn new(number: u32, intruder: &IntruderSection, rate_hz: u32) -> Self {
        Self { number, route: intruder.route(), rate_hz, closest: None }
    }

    /// Takes the positions of all UAVs at `tick`; returns the distance of the closest one, or `None` without UAVs.
    pub(super) fn observe(&mut self, tick: i64, places: &[(u32, Point2<f64>)]) -> Option<f64> {
        let time_s = Tick(tick).seconds(self.rate_hz);
        let place = self.route.at(time_s).pose.position;
        let distances = places.iter().map(|(uav, there)| ((there - place).norm(), *uav));
        // Of equally close UAVs the one with the lowest number, whatever the order of the places.
        let (distance_m, uav) =
            distances.min_by(|one, other| one.0.total_cmp(&other.0).then(one.1.cmp(&other.1)))?;
        let is_closer = self.closest.is_none_or(|closest| distance_m < closest.distance_m);
        // JSON has no infinity, and no later distance would be closer than one that is not a number.
        if distance_m.is_finite() && is_closer {
            self.closest = Some(IntruderSummary { intruder: self.number, distance_m, uav, time_s });
        }
        Some(distance_m)
    }

    /// The closest approach of the flight; `None` if no UAV has flown yet.
    pub(super) fn summary(&self) -> Option<IntruderSummary> {
        self.closest
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_closest_approach_is_to_where_the_intruder_is() {
        // It flies north at 20 m/s.
        let mut watch = IntruderWatch::new(2, &crate::testing::intruder([0.0, -100.0]), 100);
        assert_eq!((watch.observe(0, &[]), watch.summary()), (None, None));
        let places = [(3, Point2::new(0.0, 50.0)), (1, Point2::new(30.0, 0.0))];
        for tick in [0, 500, 700] {
            watch.observe(tick, &places);
        }
        let summary = watch.summary().unwrap();
        assert_eq!((summary.intruder, summary.uav, summary.time_s), (2, 3, 7.0));
        assert!((summary.distance_m - 10.0).abs() < 1e-9);
    }

    #[test]
    fn of_equal_approaches_the_first_one_counts_and_of_equally_close_uavs_the_lowest_number() {
        let east = IntruderSection { heading_deg: 0.0, ..crate::testing::intruder([-100.0, 0.0]) };
        let mut watch = IntruderWatch::new(1, &east, 100);
        // It is 20 m west of the UAVs after 4 s, and 20 m east of them after 6 s.
        for tick in [400, 600] {
            watch.observe(tick, &[(3, Point2::new(0.0, 15.0)), (2, Point2::new(0.0, -15.0))]);
        }
        let expected = IntruderSummary { intruder: 1, distance_m: 25.0, uav: 2, time_s: 4.0 };
        assert_eq!(watch.summary(), Some(expected));
    }
}
