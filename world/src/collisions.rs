//! Which UAVs have run into each other, into an obstacle or into an intruder.
//!
//! Never reports a contact twice while it lasts.

use crate::{Airframe, by_x::ByX, intruder::Intruder, obstacle::Obstacle};
use nalgebra::Point2;
use ringwing_flight::{Collider, UavId};
use std::collections::BTreeSet;

/// A UAV and another aircraft near it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Neighbours {
    /// Of two UAVs, the one with the lower number.
    pub(crate) uav: UavId,
    pub(crate) with: Collider,
    pub(crate) distance_m: f64,
    /// Where the UAV is.
    pub(crate) position_m: [f64; 2],
}

/// Finds each collision once, in the tick in which it begins.
#[derive(Debug, Clone)]
pub(crate) struct Collisions {
    distance_m: f64,
    /// How far apart two aircraft may be to count as near.
    near_m: f64,
    /// The contacts of the last tick.
    touching: BTreeSet<(UavId, Collider)>,
}

impl Collisions {
    /// Aircraft closer than `distance_m` collide, those closer than `near_m` are near each other.
    pub(crate) fn new(distance_m: f64, near_m: f64) -> Self {
        Self {
            distance_m,
            // Collisions are looked for among what is near, so a smaller distance would miss some.
            near_m: near_m.max(distance_m),
            touching: BTreeSet::new(),
        }
    }

    /// The collisions that began since the last call, in the order of UAVs. `near` is what [`near`](Self::near) found.
    pub(crate) fn begun(
        &mut self,
        airframes: &[Airframe],
        obstacles: &[Obstacle],
        near: &[Neighbours],
    ) -> Vec<(UavId, Collider)> {
        let hits = near.iter().filter(|one| one.distance_m < self.distance_m).map(|one| (one.uav, one.with));
        // The set sorts by UAV. Pairs are found in the order of x, and the order of events must not depend on that.
        let touching: BTreeSet<_> = hits.chain(crashes(airframes, obstacles)).collect();
        let begun = touching.difference(&self.touching).copied().collect();
        self.touching = touching;
        begun
    }

    /// Every UAV that is near another UAV or an intruder, in any order. `by_x` holds the same airframes.
    pub(crate) fn near(&self, airframes: &[Airframe], by_x: &ByX, intruders: &[Intruder]) -> Vec<Neighbours> {
        let mut found = Vec::new();
        for pair in by_x.pairs(self.near_m) {
            // Name a pair by its lower UAV. In the order of x, a contact would begin anew when the two change places.
            let [one, other] = if pair[0].uav < pair[1].uav { pair } else { [pair[1], pair[0]] };
            let is_flying = airframes[other.uav.index()].is_flying();
            let with = Collider::Uav(other.uav);
            found.extend(neighbours(&airframes[one.uav.index()], with, other.position).filter(|_| is_flying));
        }
        for intruder in intruders {
            let with = Collider::Intruder(intruder.id());
            found.extend(airframes.iter().filter_map(|one| neighbours(one, with, intruder.position())));
        }
        found.retain(|one| one.distance_m < self.near_m);
        found
    }
}

/// `one`, if it flies, and something at `place`.
fn neighbours(one: &Airframe, with: Collider, place: Point2<f64>) -> Option<Neighbours> {
    let position = one.pose().position;
    let distance_m = (position - place).norm();
    one.is_flying().then(|| Neighbours { uav: one.uav(), with, distance_m, position_m: position.into() })
}

/// UAVs inside an obstacle: distance from its centre d <= `R_obs`.
fn crashes(airframes: &[Airframe], obstacles: &[Obstacle]) -> Vec<(UavId, Collider)> {
    let mut found = Vec::new();
    for (index, obstacle) in obstacles.iter().enumerate() {
        let inside = |airframe: &&Airframe| {
            airframe.is_flying()
                && (airframe.pose().position - obstacle.position()).norm() <= obstacle.section.radius_m
        };
        found
            .extend(airframes.iter().filter(inside).map(|one| (one.uav(), Collider::Obstacle(index as u32))));
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use ringwing_flight::Tick;
    use ringwing_scenario::{ObstacleSection, Scenario, StartState};

    fn airframes(places: &[[f64; 2]]) -> Vec<Airframe> {
        let at = |(index, place): (usize, &[f64; 2])| {
            let start = StartState { position_m: *place, heading_deg: 0.0, speed_m_s: 15.0 };
            let mut airframe = Airframe::new(&Scenario::default(), UavId(index as u32 + 1), &start);
            airframe.step(Tick::APPROACH);
            airframe
        };
        places.iter().enumerate().map(at).collect()
    }

    fn begun(collisions: &mut Collisions, airframes: &[Airframe]) -> Vec<(UavId, Collider)> {
        let near = collisions.near(airframes, &ByX::new(airframes), &[]);
        collisions.begun(airframes, &[], &near)
    }

    #[test]
    fn a_collision_is_reported_once_until_the_uavs_have_parted() {
        let mut collisions = Collisions::new(2.0, 2.0);
        let flying = airframes(&[[0.0, 0.0], [100.0, 0.0], [1.5, 0.5], [0.0, 50.0]]);
        assert_eq!(begun(&mut collisions, &flying), [(UavId(1), Collider::Uav(UavId(3)))]);
        assert_eq!(begun(&mut collisions, &flying), []);
        let apart = airframes(&[[0.0, 0.0], [100.0, 0.0], [5.0, 0.5], [0.0, 50.0]]);
        assert_eq!(begun(&mut collisions, &apart), []);
        assert_eq!(begun(&mut collisions, &flying).len(), 1, "the UAVs had parted");
    }

    #[test]
    fn uavs_at_just_the_distance_have_not_collided_and_are_not_near() {
        // On a line across their heading, where no step rounds the distance.
        let flying = airframes(&[[0.0, 0.0], [0.0, 2.0], [0.0, 7.0]]);
        let mut collisions = Collisions::new(2.0, 5.0);
        assert_eq!(begun(&mut collisions, &flying), []);
        let near: Vec<_> =
            collisions.near(&flying, &ByX::new(&flying), &[]).iter().map(|one| (one.uav, one.with)).collect();
        assert_eq!(near, [(UavId(1), Collider::Uav(UavId(2)))], "the third is 5 m away");
    }

    #[test]
    fn a_uav_collides_with_an_obstacle_at_its_edge() {
        let obstacle = ObstacleSection::standing("mast", [0.0, 0.0], 10.0, 20.0);
        let mut collisions = Collisions::new(2.0, 2.0);
        let flying = airframes(&[[0.0, 9.999], [0.0, -10.001]]);
        let obstacles = [Obstacle::new(&obstacle, 0.0)];
        assert_eq!(collisions.begun(&flying, &obstacles, &[]), [(UavId(1), Collider::Obstacle(0))]);
    }

    #[test]
    fn the_search_by_x_finds_every_pair_that_a_full_search_finds() {
        // Steps of the golden ratio and of a root fill the square evenly, without order in x.
        let place = |i: i32| [f64::from(i) * 0.618_034 % 1.0 * 30.0, f64::from(i) * 0.414_213 % 1.0 * 30.0];
        let places: Vec<[f64; 2]> = (0..400).map(place).collect();
        let flying = airframes(&places);
        let mut expected = BTreeSet::new();
        for a in &flying {
            for b in flying.iter().filter(|b| b.uav() > a.uav()) {
                if (a.pose().position - b.pose().position).norm() < 2.0 {
                    expected.insert((a.uav(), Collider::Uav(b.uav())));
                }
            }
        }
        assert!(expected.len() > 10);
        let found: BTreeSet<_> = begun(&mut Collisions::new(2.0, 2.0), &flying).into_iter().collect();
        assert_eq!(found, expected);
    }
}
