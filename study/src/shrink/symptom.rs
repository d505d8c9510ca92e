//! What a smaller flight must have in common with the original.
//!
//! Never compares measured values: a smaller flight may violate its requirement by another amount.

use crate::flight::Outcome;
use ringwing_flight::{Collider, Event};
use serde::Serialize;

/// The requirements about coming too close. They fail at one moment, so the rest of the flight can be cut off.
const AT_ONE_MOMENT: [&str; 3] = ["collisions_max", "separation_min_m", "clearance_min_m"];

/// A violated requirement and the events that come with it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Symptom {
    /// The key in `[requirements]`, or [`ALWAYS`](crate::flight::ALWAYS).
    pub requirement: String,
    /// Whether a UAV hit another aircraft; only for requirements about coming too close.
    pub aircraft_collide: bool,
    /// Whether a UAV hit an obstacle; only for requirements about coming too close.
    pub obstacle_hit: bool,
}

impl Symptom {
    /// The symptom of each requirement that a flight violated; those about coming too close are first.
    pub(super) fn all(outcome: &Outcome) -> Vec<Self> {
        let hits = |wanted: fn(&Collider) -> bool| {
            outcome
                .collisions()
                .any(|timed| matches!(&timed.event, Event::Collision { with, .. } if wanted(with)))
        };
        let aircraft_collide = hits(|with| matches!(with, Collider::Uav(_) | Collider::Intruder(_)));
        let obstacle_hit = hits(|with| matches!(with, Collider::Obstacle(_)));
        let symptom = |requirement: &str| {
            let is_close = AT_ONE_MOMENT.contains(&requirement);
            Self {
                requirement: requirement.into(),
                aircraft_collide: is_close && aircraft_collide,
                obstacle_hit: is_close && obstacle_hit,
            }
        };
        let mut all: Vec<_> = outcome.violated().map(symptom).collect();
        // The sort is stable, so the order of the alphabet stays within the two groups.
        all.sort_by_key(|symptom| !symptom.is_at_one_moment());
        all
    }

    /// Whether one moment of the flight violates the requirement, whatever comes later.
    pub(super) fn is_at_one_moment(&self) -> bool {
        AT_ONE_MOMENT.contains(&self.requirement.as_str())
    }

    /// Whether a flight with the symptom `other` still shows this one. A smaller flight may lose a second kind of
    /// collision, but not the only one.
    pub(super) fn is_shown_by(&self, other: &Self) -> bool {
        let keeps_kind = (self.aircraft_collide && other.aircraft_collide)
            || (self.obstacle_hit && other.obstacle_hit)
            || !(self.aircraft_collide || self.obstacle_hit);
        self.requirement == other.requirement && keeps_kind
    }

    /// The symptom in words.
    pub fn sentence(&self) -> String {
        let event = match (self.aircraft_collide, self.obstacle_hit) {
            (true, true) => ", with collisions of UAVs and of obstacles",
            (true, false) => ", with a collision of UAVs",
            (false, true) => ", with a collision with an obstacle",
            (false, false) => "",
        };
        format!("violates {}{event}", self.requirement)
    }
}
