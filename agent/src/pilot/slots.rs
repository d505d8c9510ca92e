//! The slots of all UAVs as one UAV sees them, and how they move when the ring of the living or the formation changes.
//!
//! Never knows where the UAVs are, nor how a UAV was lost.

use nalgebra::Vector2;
use ringwing_flight::{LivingRing, Manoeuvre, Slot, Tick, UavId};
use ringwing_scenario::Scenario;
use std::sync::Arc;

/// What one UAV steers for at one moment: its slot, and the distances to keep.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct SlotGeometry {
    /// From the formation's centre to the slot, metres.
    pub(super) slot: Vector2<f64>,
    /// R: the distance from the centre to the slot.
    pub(super) radius_m: f64,
    /// The previous and the next living UAV in the ring, each with L, the distance between its slot and this UAV's
    /// slot.
    pub(super) neighbours: [Option<(UavId, f64)>; 2],
}

/// All slots, moving from their places in one formation to their places in the next.
#[derive(Debug, Clone)]
pub(super) struct Slots {
    own: UavId,
    ring: LivingRing,
    /// The manoeuvres of the flight, in order of time. Shared, because an agent copies its slots to rehearse each tick.
    manoeuvres: Arc<[Manoeuvre]>,
    /// How many of them have begun.
    begun: usize,
    /// How long the slots move after a loss or a return.
    closing_ticks: i64,
    /// One for each UAV, UAV 1 first.
    transitions: Vec<SlotTransition>,
    began: Tick,
    duration_ticks: i64,
    is_moving: bool,
    /// How many times the slots were sent elsewhere.
    changes: u64,
    geometry: SlotGeometry,
}

/// The path of one slot between two places.
///
/// In a ring or a star that closes, the rates of bearing and radius are constant. Two slots never meet on the way: all
/// stay in ring order. In a shape with an open path, and in most manoeuvres, every slot moves straight.
#[derive(Debug, Clone, Copy, PartialEq)]
struct SlotTransition {
    from: Slot,
    to: Slot,
    is_straight: bool,
}

impl Slots {
    /// The slots that UAV `own` of `scenario` sees while all UAVs are alive.
    pub(super) fn new(scenario: &Scenario, own: UavId) -> Self {
        let ring = scenario.whole_ring();
        let rate_hz = f64::from(scenario.time.rate_hz);
        let transitions = UavId::all(scenario.formation.uavs)
            .map(|uav| SlotTransition::at_rest(ring.slot(uav.0)))
            .collect();
        // A placeholder: the geometry is computed from the rest of `Slots`.
        let geometry = SlotGeometry { slot: Vector2::zeros(), radius_m: 0.0, neighbours: [None; 2] };
        let mut slots = Self {
            own,
            ring,
            manoeuvres: scenario.planned_manoeuvres().into(),
            begun: 0,
            closing_ticks: (scenario.membership.slots_move_s * rate_hz).round() as i64,
            transitions,
            began: Tick::APPROACH,
            duration_ticks: 0,
            is_moving: false,
            changes: 0,
            geometry,
        };
        slots.geometry = slots.geometry_at(1.0);
        slots
    }

    /// Starts to move the slots from where they are to their places in the ring of the UAVs that are alive.
    pub(super) fn reform(&mut self, now: Tick, is_alive: impl Fn(UavId) -> bool) {
        self.begin_manoeuvres(now);
        // A loss during a manoeuvre must not hurry it: the airframes could not follow. After its end this is negative.
        let left_ticks = self.end_of_manoeuvre().since(now);
        // A loss during a move starts the next move from where the slots are now. Read this before the ring changes.
        let progress = self.progress(now);
        let before = self.ring.clone();
        self.ring.reform(|number| is_alive(UavId(number)));
        for (uav, transition) in UavId::all(self.transitions.len() as u32).zip(&mut self.transitions) {
            // The slot of a UAV that returns does not have to move gently: the UAV is far from it anyway.
            let returns = !before.has(uav.0) && self.ring.has(uav.0) && uav != self.own;
            let to = self.ring.slot(uav.0);
            *transition = if returns {
                SlotTransition::at_rest(to)
            } else {
                SlotTransition { from: transition.slot(progress), to, is_straight: false }
            };
        }
        (self.began, self.is_moving) = (now, true);
        self.changes += 1;
        self.duration_ticks = self.closing_ticks.max(left_ticks);
    }

    /// Starts to move the slots to the formation of each manoeuvre that is due.
    ///
    /// An agent that starts late begins all manoeuvres that it has missed, each at its own tick.
    fn begin_manoeuvres(&mut self, now: Tick) {
        while let Some(manoeuvre) = self.manoeuvres.get(self.begun).filter(|next| next.begins <= now) {
            let progress = self.progress(manoeuvre.begins);
            self.ring.turn_to(manoeuvre);
            for (uav, transition) in UavId::all(self.transitions.len() as u32).zip(&mut self.transitions) {
                let (from, to) = (transition.slot(progress), self.ring.slot(uav.0));
                *transition = SlotTransition { from, to, is_straight: !manoeuvre.goes_round };
            }
            (self.began, self.duration_ticks) = (manoeuvre.begins, manoeuvre.lasts_ticks);
            self.is_moving = true;
            self.begun += 1;
            self.changes += 1;
        }
    }

    /// When the last manoeuvre that has begun is over.
    fn end_of_manoeuvre(&self) -> Tick {
        let last = self.begun.checked_sub(1).and_then(|last| self.manoeuvres.get(last));
        last.map_or(Tick::APPROACH, |last| Tick(last.begins.0 + last.lasts_ticks))
    }

    /// Moves the slots to their places at `now`.
    pub(super) fn advance(&mut self, now: Tick) {
        self.begin_manoeuvres(now);
        if self.is_moving {
            let progress = self.progress(now);
            self.geometry = self.geometry_at(progress);
            self.is_moving = progress < 1.0;
        }
    }

    /// What the UAV steers for.
    pub(super) fn geometry(&self) -> &SlotGeometry {
        &self.geometry
    }

    /// The formation whose slots they move to, or have.
    pub(super) fn ring(&self) -> &LivingRing {
        &self.ring
    }

    /// Grows with every change of [`ring`](Self::ring).
    pub(super) fn changes(&self) -> u64 {
        self.changes
    }

    /// Whether the slots are moving.
    pub(super) fn is_moving(&self) -> bool {
        self.is_moving
    }

    /// How many UAVs are alive.
    pub(super) fn living(&self) -> u32 {
        self.ring.count() as u32
    }

    /// All UAVs, alive or lost.
    pub(super) fn uavs(&self) -> impl Iterator<Item = UavId> + use<> {
        UavId::all(self.transitions.len() as u32)
    }

    /// The share of the move that is done, from 0 to 1.
    fn progress(&self, now: Tick) -> f64 {
        let done = now.since(self.began);
        // A move of no duration is over at once, so nothing is divided by zero.
        if done >= self.duration_ticks || !self.is_moving {
            1.0
        } else {
            done as f64 / self.duration_ticks as f64
        }
    }

    fn geometry_at(&self, progress: f64) -> SlotGeometry {
        // The distances L and R follow the moving slots. Those of the new ring would pull UAVs out of slots that still
        // move.
        let own = self.transitions[self.own.index()].slot(progress);
        let neighbours = self.ring.neighbours(self.own.0);
        let [previous, next] =
            neighbours.map(|number| number.map(|number| self.neighbour(UavId(number), &own, progress)));
        // In a ring of two, both neighbours are the same UAV; its term counts once.
        let next = next.filter(|_| neighbours[0] != neighbours[1]);
        SlotGeometry { slot: own.offset(), radius_m: own.radius_m(), neighbours: [previous, next] }
    }

    fn neighbour(&self, uav: UavId, own: &Slot, progress: f64) -> (UavId, f64) {
        // At rest, use the formation's own distance, so that a whole ring gives the paper's L to the bit.
        if progress >= 1.0 {
            return (uav, self.ring.rest_m(self.own.0, uav.0));
        }
        (uav, (self.transitions[uav.index()].slot(progress).offset() - own.offset()).norm())
    }
}

impl SlotTransition {
    fn at_rest(slot: Slot) -> Self {
        Self { from: slot, to: slot, is_straight: false }
    }

    fn slot(&self, progress: f64) -> Slot {
        // Linear, because a smooth start and end would need a faster middle, which airframes cannot follow.
        if self.is_straight {
            self.from.straight_towards(&self.to, progress)
        } else {
            self.from.towards(&self.to, progress)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point2;
    use proptest::prelude::*;
    use ringwing_scenario::{ManoeuvreSection, ShapeName, SlotOrder};

    fn slots(own: u32) -> Slots {
        let mut scenario = Scenario::default();
        scenario.control.ring_closes = true;
        Slots::new(&scenario, UavId(own))
    }

    fn advanced(slots: &mut Slots, tick: i64) -> SlotGeometry {
        slots.advance(Tick(tick));
        *slots.geometry()
    }

    #[test]
    fn a_whole_ring_is_the_formation_to_the_bit() {
        let scenario = Scenario::default();
        let geometry = *slots(3).geometry();
        assert_eq!(Point2::origin() + geometry.slot, scenario.formation().slot(3, Point2::origin()));
        assert_eq!(geometry.radius_m, scenario.formation().radius_m());
        assert_eq!(geometry.neighbours, [Some((UavId(2), 40.0)), Some((UavId(4), 40.0))]);
    }

    #[test]
    fn slots_start_where_they_are_and_come_to_rest_in_the_new_ring() {
        let mut slots = slots(2);
        let before = *slots.geometry();
        slots.reform(Tick(100), |uav| uav != UavId(3));
        let moved = |geometry: SlotGeometry| (geometry.slot - before.slot).norm();
        assert_eq!(moved(advanced(&mut slots, 100)), 0.0);
        assert!(moved(advanced(&mut slots, 110)) < 0.5 && slots.is_moving());
        let at_rest = advanced(&mut slots, 600);
        assert!(!slots.is_moving() && moved(at_rest) > 10.0);
        let [previous, next] = at_rest.neighbours.map(Option::unwrap);
        assert_eq!((previous.0, next.0), (UavId(1), UavId(4)));
        assert!((previous.1 - 40.0).abs() < 1e-9 && (next.1 - 40.0).abs() < 1e-9);
    }

    #[test]
    fn the_last_two_keep_their_slots_and_have_one_neighbour_each() {
        let mut slots = slots(1);
        slots.reform(Tick(0), |uav| uav.0 % 3 == 1);
        let geometry = advanced(&mut slots, 500);
        assert!((geometry.slot - self::slots(1).geometry().slot).norm() < 1e-9);
        let (uav, distance_m) = geometry.neighbours[0].unwrap();
        assert!(uav == UavId(4) && (distance_m - 80.0).abs() < 1e-9 && geometry.neighbours[1].is_none());
    }

    #[test]
    fn the_slot_of_a_uav_that_returns_is_at_its_place_at_once_and_the_others_move_there() {
        let mut slots = slots(2);
        slots.reform(Tick(0), |uav| uav != UavId(3));
        let closed = advanced(&mut slots, 600);
        slots.reform(Tick(600), |_| true);
        let opening = advanced(&mut slots, 600);
        assert!((opening.slot - closed.slot).norm() < 1e-9, "its own slot has not moved yet");
        let place = self::slots(3).geometry().slot;
        let [previous, next] = opening.neighbours.map(Option::unwrap);
        assert_eq!((previous.0, next.0), (UavId(1), UavId(3)));
        assert!((previous.1 - 40.0).abs() < 1e-9, "nor has that of uav 1: {} m", previous.1);
        assert!((next.1 - (place - closed.slot).norm()).abs() < 1e-9, "{} m to uav 3", next.1);
        assert!((advanced(&mut slots, 1200).neighbours[1].unwrap().1 - 40.0).abs() < 1e-9);
    }

    /// The slots of six UAVs that become a vee from tick 100 to 2100.
    fn becoming_a_vee(own: u32) -> Slots {
        let mut scenario = Scenario::default();
        scenario.control.ring_closes = true;
        let shape = Some(ShapeName::Vee);
        scenario.manoeuvres =
            vec![ManoeuvreSection { at_s: 1.0, over_s: 20.0, shape, ..ManoeuvreSection::default() }];
        Slots::new(&scenario, UavId(own))
    }

    #[test]
    fn in_a_manoeuvre_slots_move_straight_and_the_distances_follow_them() {
        let all = |tick: i64| [1, 2, 3, 4, 5, 6].map(|own| advanced(&mut becoming_a_vee(own), tick));
        let (before, halfway, after) = (all(99), all(1100), all(2100));
        for own in 0..6 {
            let middle = (before[own].slot + after[own].slot) / 2.0;
            assert!((halfway[own].slot - middle).norm() < 1e-9, "{own}");
            let (next, rest_m) = halfway[own].neighbours[1].unwrap();
            let apart_m = (halfway[next.index()].slot - halfway[own].slot).norm();
            assert!((rest_m - apart_m).abs() < 1e-9 && next.index() == (own + 1) % 6, "{own}: {rest_m} m");
        }
        let tip = after.iter().map(|geometry| geometry.slot.x).fold(f64::NEG_INFINITY, f64::max);
        assert_eq!(
            after.iter().filter(|geometry| geometry.slot.x > tip - 1.0).count(),
            1,
            "a vee has one tip"
        );
    }

    #[test]
    fn an_agent_that_starts_during_a_manoeuvre_sees_the_slots_where_the_others_see_them() {
        let mut there = becoming_a_vee(2);
        (0..700).for_each(|tick| there.advance(Tick(tick)));
        assert_eq!(advanced(&mut becoming_a_vee(2), 700), advanced(&mut there, 700));
    }

    #[test]
    fn a_loss_during_a_manoeuvre_does_not_hurry_it() {
        let mut slots = becoming_a_vee(2);
        let before = advanced(&mut slots, 600).slot;
        slots.reform(Tick(600), |uav| uav != UavId(5));
        assert!((advanced(&mut slots, 600).slot - before).norm() < 1e-9);
        advanced(&mut slots, 2099);
        assert!(slots.is_moving());
        advanced(&mut slots, 2100);
        assert!(!slots.is_moving());
    }

    #[test]
    fn a_uav_that_returns_during_a_manoeuvre_has_its_slot_where_the_manoeuvre_ends() {
        let mut slots = becoming_a_vee(4);
        slots.reform(Tick(300), |uav| uav != UavId(5));
        slots.reform(Tick(1000), |_| true);
        let (uav, rest_m) = advanced(&mut slots, 1000).neighbours[1].unwrap();
        let end = advanced(&mut becoming_a_vee(5), 2100).slot;
        assert_eq!(uav, UavId(5));
        assert!((rest_m - (end - slots.geometry().slot).norm()).abs() < 1e-9, "{rest_m} m");
    }

    #[test]
    fn a_ring_that_turns_with_the_numbers_of_its_slots_goes_round_its_centre() {
        let turn = ManoeuvreSection {
            at_s: 1.0,
            over_s: 10.0,
            bearing_deg: Some(90.0),
            order: SlotOrder::Keep,
            ..ManoeuvreSection::default()
        };
        let scenario = Scenario { manoeuvres: vec![turn], ..Scenario::default() };
        let mut slots = Slots::new(&scenario, UavId(1));
        let halfway = advanced(&mut slots, 600);
        let bearing = Vector2::new(-1.0, 1.0) / 2.0_f64.sqrt();
        assert!((halfway.slot - bearing * 40.0).norm() < 1e-9, "{}", halfway.slot);
    }

    #[test]
    fn a_move_of_no_duration_is_over_at_once() {
        let mut scenario = Scenario::default();
        scenario.control.ring_closes = true;
        scenario.membership.slots_move_s = 0.0;
        let mut slots = Slots::new(&scenario, UavId(2));
        slots.reform(Tick(10), |uav| uav != UavId(3));
        let [_, next] = advanced(&mut slots, 10).neighbours.map(Option::unwrap);
        assert!(!slots.is_moving() && next.0 == UavId(4) && (next.1 - 40.0).abs() < 1e-9);
    }

    proptest! {
        #[test]
        fn no_change_on_the_way_makes_a_slot_jump(
            changes in prop::collection::vec((0_i64..400, prop::array::uniform6(any::<bool>())), 1..6),
        ) {
            let (mut slots, mut now) = (slots(1), 0);
            let mut place = slots.geometry().slot;
            for (pause, alive) in changes {
                slots.reform(Tick(now), |uav| uav == UavId(1) || alive[uav.index()]);
                for _ in 0..=pause {
                    now += 1;
                    let next = advanced(&mut slots, now).slot;
                    // No slot moves faster than half of the whole ring in five seconds.
                    prop_assert!((next - place).norm() < 0.26, "{} m in a tick", (next - place).norm());
                    place = next;
                }
            }
        }
    }
}
