//! The ring that the swarm should be, which all slot and neighbour errors refer to.
//!
//! Where the scenario closes the ring after a loss, it is the ring of the UAVs that fly on command, with its final slots
//! from the first tick on: not the slots on the way there, so that the damage of a loss shows until it is repaired.

use nalgebra::Vector2;
use ringwing_flight::{LivingRing, UavId};
use ringwing_scenario::Scenario;

/// The ring of the UAVs that fly on command; the whole ring where the scenario does not close it.
#[derive(Debug, Clone, PartialEq)]
pub struct FlownRing {
    living: LivingRing,
    closes: bool,
    /// From the formation's centre to each slot, UAV 1's first. Kept, because a slot's trigonometry every tick is slow.
    offsets: Vec<Vector2<f64>>,
}

impl FlownRing {
    /// The whole ring of `scenario`.
    pub fn new(scenario: &Scenario) -> Self {
        let living = scenario.whole_ring();
        let offsets = offsets(&living, scenario.formation.uavs);
        Self { living, closes: scenario.control.ring_closes, offsets }
    }

    /// Makes it the ring of the UAVs whose numbers `is_commanded` holds for.
    pub(crate) fn follow(&mut self, is_commanded: impl Fn(u32) -> bool) {
        if self.living.reform(is_commanded) {
            self.offsets = offsets(&self.living, self.uavs());
        }
    }

    /// The ring itself.
    pub fn living(&self) -> &LivingRing {
        &self.living
    }

    /// Whether the scenario closes the ring after a loss.
    pub fn closes(&self) -> bool {
        self.closes
    }

    /// Whether the two UAVs are neighbours in this ring. One that is not in the ring has no neighbours.
    pub(super) fn are_neighbours(&self, uav: u32, other: u32) -> bool {
        self.living.has(uav) && self.living.has(other) && self.living.neighbours(uav).contains(&Some(other))
    }

    /// The number of UAVs in the swarm, lost ones included.
    pub(crate) fn uavs(&self) -> u32 {
        self.offsets.len() as u32
    }

    /// From the formation's centre to the slot of `uav`.
    pub(super) fn slot_offset(&self, uav: UavId) -> Vector2<f64> {
        self.offsets[uav.index()]
    }
}

fn offsets(living: &LivingRing, uavs: u32) -> Vec<Vector2<f64>> {
    UavId::all(uavs).map(|uav| living.slot(uav.0).offset()).collect()
}
