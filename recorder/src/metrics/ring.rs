//! The formation that the swarm should form; all slot and neighbour errors refer to it.
//!
//! If the scenario closes the ring after a loss, this is the formation of the UAVs that fly on command. It has its final
//! slots from the first tick on, so that the damage of a loss shows until it is repaired; so has the formation of a
//! manoeuvre. Must never use the slots on the way there.

use nalgebra::Vector2;
use ringwing_flight::{FormationFrame, LeaderState, LivingRing, Manoeuvre, Shape, UavId};
use ringwing_scenario::Scenario;
use std::sync::Arc;

/// The ring of the UAVs that fly on command; the whole ring where the scenario does not close it.
#[derive(Debug, Clone, PartialEq)]
pub struct FlownRing {
    living: LivingRing,
    closes: bool,
    frame: FormationFrame,
    /// The manoeuvres of the flight, in order of time. Shared, because a reader of logs copies the ring in every tick.
    manoeuvres: Arc<[Manoeuvre]>,
    /// How many of them have begun.
    begun: usize,
    /// The place of each UAV, UAV 1 first. Kept, because the trigonometry of slots and distances takes longer than all other
    /// metrics, and the ring rarely changes.
    places: Vec<RingPlace>,
}

/// The place of one UAV in the ring.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct RingPlace {
    /// From the formation's centre to the slot, in the formation's frame.
    pub(super) offset: Vector2<f64>,
    /// Distance of the slot from the centre.
    pub(super) radius_m: f64,
    /// The previous neighbour, unless no other UAV is in the ring.
    pub(super) previous: Option<RingNeighbour>,
    /// The next neighbour.
    pub(super) next: Option<RingNeighbour>,
    /// Whether the UAV is in the ring. A UAV outside has the place that it would return to.
    pub(super) is_in: bool,
}

/// A ring neighbour.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct RingNeighbour {
    /// Its number.
    pub(super) uav: u32,
    /// The distance between the two slots: L, unless the UAVs keep their slots after a loss.
    pub(super) rest_m: f64,
}

impl FlownRing {
    /// The whole ring of `scenario`.
    pub fn new(scenario: &Scenario) -> Self {
        let living = scenario.whole_ring();
        let places = places(&living, scenario.formation.uavs);
        let manoeuvres = scenario.planned_manoeuvres().into();
        let (closes, frame) = (scenario.control.ring_closes, scenario.formation.frame);
        Self { living, closes, frame, manoeuvres, begun: 0, places }
    }

    /// Makes it the formation of `tick`, of the UAVs whose numbers `is_commanded` holds for. Ticks only grow.
    pub(crate) fn follow(&mut self, tick: i64, is_commanded: impl Fn(u32) -> bool) {
        let before = self.begun;
        while let Some(manoeuvre) = self.manoeuvres.get(self.begun).filter(|next| next.begins.0 <= tick) {
            self.living.turn_to(manoeuvre);
            self.begun += 1;
        }
        // `reform` first: `||` would skip it when a manoeuvre begins, and the ring would keep a lost UAV for a tick.
        if self.living.reform(is_commanded) || self.begun > before {
            self.places = places(&self.living, self.uavs());
        }
    }

    /// How many manoeuvres have begun.
    pub(super) fn begun(&self) -> usize {
        self.begun
    }

    /// Who is in the ring: the slots and distances change exactly when this does.
    pub(crate) fn living(&self) -> &LivingRing {
        &self.living
    }

    /// The radius of the circle that the slots lie on, m; `None` in another shape than a ring, or if nobody is left.
    pub fn radius_m(&self) -> Option<f64> {
        // One slot is enough: all slots of a ring lie on one circle.
        let first = self.members().next().map(|(_, place)| place.radius_m);
        first.filter(|_| *self.living.formation().shape() == Shape::Ring)
    }

    /// The distance between the slots of ring neighbours, m; `None` if it differs around the ring, or if no two UAVs are left.
    pub fn spacing_m(&self) -> Option<f64> {
        let mut rests = self.members().filter_map(|(_, place)| place.next.map(|next| next.rest_m));
        let first = rests.next()?;
        // Computed distances of equal gaps differ in their last bits.
        rests.all(|rest| (rest - first).abs() < 1e-6).then_some(first)
    }

    /// The angle from the local frame to that of the formation, around this leader.
    pub(crate) fn frame_rad(&self, leader: &LeaderState) -> f64 {
        match self.frame {
            FormationFrame::Fixed => 0.0,
            FormationFrame::Leader => leader.heading_rad,
        }
    }

    /// The displacement from this leader to the slot of UAV `number`, in the local frame.
    pub(super) fn slot_offset(&self, number: u32, leader: &LeaderState) -> Vector2<f64> {
        self.frame.placed(self.place(number).offset, leader.heading_rad)
    }

    /// The UAVs in the ring, by ascending number, each with the displacement from the centre to its slot, in the formation's
    /// frame.
    pub(crate) fn slots(&self) -> impl Iterator<Item = (u32, Vector2<f64>)> {
        self.members().map(|(number, place)| (number, place.offset))
    }

    /// The slots in the order of their places, as displacements from the centre, and whether the line through them is
    /// closed.
    pub(crate) fn outline(&self) -> (Vec<Vector2<f64>>, bool) {
        let slots = self.living.in_formation().map(|number| self.place(number).offset).collect();
        (slots, !self.living.formation().shape().is_path())
    }

    fn members(&self) -> impl Iterator<Item = (u32, &RingPlace)> {
        (1..).zip(&self.places).filter(|(_, place)| place.is_in)
    }

    /// Whether the scenario closes the ring after a loss.
    pub fn closes(&self) -> bool {
        self.closes
    }

    /// Whether the two UAVs are neighbours in this ring. A UAV outside the ring has no neighbours.
    pub(super) fn are_neighbours(&self, uav: u32, other: u32) -> bool {
        let place = self.place(uav);
        let is_other = |neighbour: Option<RingNeighbour>| neighbour.is_some_and(|one| one.uav == other);
        // A UAV outside has neighbours to return to, but they do not count it as theirs.
        place.is_in && self.place(other).is_in && (is_other(place.previous) || is_other(place.next))
    }

    /// The numbers of all UAVs, lost ones included, in the order of their slots.
    pub fn in_order(&self) -> impl Iterator<Item = u32> + Clone {
        self.living.order().uavs().iter().map(|uav| uav.0)
    }

    /// The number of UAVs in the swarm, lost ones included.
    pub(crate) fn uavs(&self) -> u32 {
        self.places.len() as u32
    }

    /// The place of UAV `number`.
    pub(super) fn place(&self, number: u32) -> &RingPlace {
        &self.places[UavId(number).index()]
    }
}

fn places(living: &LivingRing, uavs: u32) -> Vec<RingPlace> {
    UavId::all(uavs).map(|uav| RingPlace::of(uav.0, living)).collect()
}

impl RingPlace {
    fn of(number: u32, living: &LivingRing) -> Self {
        let slot = living.slot(number);
        let neighbour = |uav| RingNeighbour { uav, rest_m: living.rest_m(number, uav) };
        let [previous, next] = living.neighbours(number).map(|uav| uav.map(neighbour));
        let (offset, radius_m) = (slot.offset(), slot.radius_m());
        Self { offset, radius_m, previous, next, is_in: living.has(number) }
    }
}

#[cfg(test)]
mod tests;
