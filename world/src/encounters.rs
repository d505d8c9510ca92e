//! Near misses: aircraft that pass each other at a small distance and do not collide.
//!
//! An encounter lasts while two aircraft are nearer than the distance of a near miss. Never reports one encounter twice: it is
//! over before anybody knows how near the two came.

use crate::collisions::Neighbours;
use ringwing_flight::{Collider, Event, Tick, UavId};
use std::collections::BTreeMap;

/// The encounters that are not over yet.
#[derive(Debug, Clone)]
pub(crate) struct Encounters {
    distance_m: f64,
    collision_m: f64,
    open: BTreeMap<(UavId, Collider), Closest>,
}

/// How near two aircraft have come so far.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Closest {
    distance_m: f64,
    position_m: [f64; 2],
    tick: Tick,
}

impl Encounters {
    pub(crate) fn new(distance_m: f64, collision_m: f64) -> Self {
        Self { distance_m, collision_m, open: BTreeMap::new() }
    }

    /// Takes everybody who is near somebody at `now`; returns the near misses that are over, in the order of UAVs.
    pub(crate) fn observe(&mut self, now: Tick, near: &[Neighbours]) -> Vec<Event> {
        let mut last = std::mem::take(&mut self.open);
        for one in near.iter().filter(|one| one.distance_m < self.distance_m) {
            let who = (one.uav, one.with);
            let here = Closest { distance_m: one.distance_m, position_m: one.position_m, tick: now };
            // Remove the pair even if it is nearer now than before: whatever is left in `last` is over.
            let before = last.remove(&who).filter(|before| before.distance_m <= here.distance_m);
            self.open.insert(who, before.unwrap_or(here));
        }
        last.into_iter().filter_map(|encounter| self.near_miss(encounter)).collect()
    }

    /// Ends all encounters, because the flight is over.
    pub(crate) fn end(&mut self) -> Vec<Event> {
        // Nobody is near, so no encounter takes over this tick, and any tick is right.
        self.observe(Tick::APPROACH, &[])
    }

    /// The event of an encounter that is over; `None` if it was a collision, which has an event of its own.
    fn near_miss(&self, ((uav, with), closest): ((UavId, Collider), Closest)) -> Option<Event> {
        let Closest { distance_m, position_m, tick } = closest;
        (distance_m >= self.collision_m).then_some(Event::NearMiss {
            uav,
            with,
            distance_m,
            position_m,
            closest: tick,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const OTHER: Collider = Collider::Uav(UavId(5));

    fn near(distance_m: f64) -> Neighbours {
        Neighbours { uav: UavId(2), with: OTHER, distance_m, position_m: [distance_m, 0.0] }
    }

    /// What is reported of two UAVs at these distances, tick by tick.
    fn reported(distances_m: &[f64]) -> Vec<(i64, Event)> {
        let mut encounters = Encounters::new(8.0, 2.0);
        let mut reported = Vec::new();
        for (tick, distance_m) in (0..).zip(distances_m) {
            let events = encounters.observe(Tick(tick), &[near(*distance_m)]);
            reported.extend(events.into_iter().map(|event| (tick, event)));
        }
        reported.extend(encounters.end().into_iter().map(|event| (-1, event)));
        reported
    }

    fn near_miss(distance_m: f64, tick: i64) -> Event {
        let position_m = [distance_m, 0.0];
        Event::NearMiss { uav: UavId(2), with: OTHER, distance_m, position_m, closest: Tick(tick) }
    }

    #[test]
    fn an_encounter_is_reported_once_as_it_was_at_its_closest_point() {
        assert_eq!(reported(&[9.0, 7.5, 7.3, 7.6, 7.4, 8.0, 20.0]), [(5, near_miss(7.3, 2))]);
        assert_eq!(reported(&[7.0, 9.0, 6.0, 9.0]), [(1, near_miss(7.0, 0)), (3, near_miss(6.0, 2))]);
    }

    #[test]
    fn an_encounter_that_lasts_to_the_end_is_reported_there() {
        assert_eq!(reported(&[9.0, 5.0, 6.0]), [(-1, near_miss(5.0, 1))]);
    }

    #[test]
    fn a_collision_is_no_near_miss() {
        assert_eq!(reported(&[7.0, 1.9, 7.0, 9.0]), []);
        assert_eq!(reported(&[7.0, 2.0, 9.0]), [(2, near_miss(2.0, 1))]);
    }
}
