//! The slots as one UAV sees them: where they are, and how they move when the ring of the living changes.
//!
//! Never knows where the UAVs are, nor how anybody came to be lost.

use nalgebra::Vector2;
use ringwing_flight::{LivingRing, Slot, Tick, UavId};
use ringwing_scenario::Scenario;

/// What one UAV keeps to at one moment: its slot, and the distances that go with it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shape {
    /// From the formation's centre to the slot.
    pub slot: Vector2<f64>,
    /// R: how far the slot is from the centre.
    pub radius_m: f64,
    /// The living before and after it in the ring, with L: how far their slots are.
    pub neighbours: [Option<(UavId, f64)>; 2],
}

/// All slots, on their way from one ring to the next.
#[derive(Debug, Clone)]
pub struct Slots {
    own: UavId,
    ring: LivingRing,
    /// Each UAV's slot, number 1 first.
    courses: Vec<Course>,
    began: Tick,
    duration_ticks: i64,
    is_moving: bool,
    shape: Shape,
}

/// The even way of one slot from place to place: what lies between two rings in ring order is in ring order too.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Course {
    from: Slot,
    to: Slot,
}

impl Slots {
    /// The slots that UAV `own` of `scenario` sees while all live.
    pub fn new(scenario: &Scenario, own: UavId) -> Self {
        let ring = scenario.whole_ring();
        let (formation, rate_hz) = (scenario.formation(), f64::from(scenario.time.rate_hz));
        let courses = UavId::all(formation.count()).map(|uav| Course::at(ring.slot(uav.0))).collect();
        let shape = Shape { slot: Vector2::zeros(), radius_m: 0.0, neighbours: [None; 2] };
        let mut slots = Self {
            own,
            ring,
            courses,
            began: Tick::APPROACH,
            duration_ticks: (scenario.membership.slots_move_s * rate_hz).round() as i64,
            is_moving: false,
            shape,
        };
        slots.shape = slots.shape_at(1.0);
        slots
    }

    /// Lets the slots set out from where they are for the ring of those whom `lives` holds for.
    pub fn reform(&mut self, now: Tick, lives: impl Fn(UavId) -> bool) {
        let share = self.share(now);
        let was = self.ring.clone();
        self.ring.reform(|number| lives(UavId(number)));
        for (uav, course) in UavId::all(self.courses.len() as u32).zip(&mut self.courses) {
            // Who was lost is far away: its slot is at once where it will be.
            let returns = !was.has(uav.0) && self.ring.has(uav.0) && uav != self.own;
            let slot = self.ring.slot(uav.0);
            *course = if returns { Course::at(slot) } else { Course { from: course.slot(share), to: slot } };
        }
        (self.began, self.is_moving) = (now, true);
    }

    /// Moves the slots to where they are at `now`.
    pub fn advance(&mut self, now: Tick) {
        if self.is_moving {
            let share = self.share(now);
            self.shape = self.shape_at(share);
            self.is_moving = share < 1.0;
        }
    }

    /// What the UAV keeps to.
    pub fn shape(&self) -> &Shape {
        &self.shape
    }

    /// Whether the slots are on their way.
    pub fn is_moving(&self) -> bool {
        self.is_moving
    }

    /// How many live.
    pub fn living(&self) -> u32 {
        self.ring.count() as u32
    }

    /// How much of the way is done.
    fn share(&self, now: Tick) -> f64 {
        let done = now.since(self.began);
        if done >= self.duration_ticks || !self.is_moving {
            1.0
        } else {
            done as f64 / self.duration_ticks as f64
        }
    }

    fn shape_at(&self, share: f64) -> Shape {
        let own = self.courses[self.own.index()].slot(share);
        let neighbours = self.ring.neighbours(self.own.0);
        let [previous, next] =
            neighbours.map(|number| number.map(|number| self.neighbour(UavId(number), &own, share)));
        // Of two that are left each is the only neighbour of the other, and counts once.
        let next = next.filter(|_| neighbours[0] != neighbours[1]);
        Shape { slot: own.offset(), radius_m: own.radius_m, neighbours: [previous, next] }
    }

    fn neighbour(&self, uav: UavId, own: &Slot, share: f64) -> (UavId, f64) {
        if share >= 1.0 {
            return (uav, self.ring.rest_m(self.own.0, uav.0));
        }
        (uav, (self.courses[uav.index()].slot(share).offset() - own.offset()).norm())
    }
}

impl Course {
    fn at(slot: Slot) -> Self {
        Self { from: slot, to: slot }
    }

    fn slot(&self, share: f64) -> Slot {
        let between = |from: f64, to: f64| if share >= 1.0 { to } else { from + (to - from) * share };
        Slot {
            bearing_rad: between(self.from.bearing_rad, self.to.bearing_rad),
            radius_m: between(self.from.radius_m, self.to.radius_m),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point2;
    use proptest::prelude::*;

    fn slots(own: u32) -> Slots {
        let mut scenario = Scenario::default();
        scenario.control.ring_closes = true;
        Slots::new(&scenario, UavId(own))
    }

    fn advanced(slots: &mut Slots, tick: i64) -> Shape {
        slots.advance(Tick(tick));
        *slots.shape()
    }

    #[test]
    fn a_whole_ring_is_the_formation_to_the_bit() {
        let scenario = Scenario::default();
        let shape = *slots(3).shape();
        assert_eq!(Point2::origin() + shape.slot, scenario.formation().slot(3, Point2::origin()));
        assert_eq!(shape.radius_m, scenario.formation().radius_m());
        assert_eq!(shape.neighbours, [Some((UavId(2), 40.0)), Some((UavId(4), 40.0))]);
    }

    #[test]
    fn slots_set_out_from_where_they_are_and_come_to_rest_in_the_new_ring() {
        let mut slots = slots(2);
        let before = *slots.shape();
        slots.reform(Tick(100), |uav| uav != UavId(3));
        let moved = |shape: Shape| (shape.slot - before.slot).norm();
        assert_eq!(moved(advanced(&mut slots, 100)), 0.0);
        assert!(moved(advanced(&mut slots, 110)) < 0.5 && slots.is_moving());
        let there = advanced(&mut slots, 600);
        assert!(!slots.is_moving() && moved(there) > 10.0);
        let [previous, next] = there.neighbours.map(Option::unwrap);
        assert_eq!((previous.0, next.0), (UavId(1), UavId(4)));
        assert!((previous.1 - 40.0).abs() < 1e-9 && (next.1 - 40.0).abs() < 1e-9);
    }

    #[test]
    fn the_last_two_keep_their_slots_and_each_other_once() {
        let mut slots = slots(1);
        slots.reform(Tick(0), |uav| uav.0 % 3 == 1);
        let shape = advanced(&mut slots, 500);
        assert!((shape.slot - self::slots(1).shape().slot).norm() < 1e-9);
        let (uav, distance_m) = shape.neighbours[0].unwrap();
        assert!(uav == UavId(4) && (distance_m - 80.0).abs() < 1e-9 && shape.neighbours[1].is_none());
    }

    proptest! {
        #[test]
        fn no_change_on_the_way_makes_a_slot_jump(
            changes in prop::collection::vec((0_i64..400, prop::array::uniform6(any::<bool>())), 1..6),
        ) {
            let (mut slots, mut now) = (slots(1), 0);
            let mut place = slots.shape().slot;
            for (pause, lives) in changes {
                slots.reform(Tick(now), |uav| uav == UavId(1) || lives[uav.index()]);
                for _ in 0..=pause {
                    now += 1;
                    let next = advanced(&mut slots, now).slot;
                    // Half the whole ring in five seconds.
                    prop_assert!((next - place).norm() < 0.26, "{} m in a tick", (next - place).norm());
                    place = next;
                }
            }
        }
    }
}
