//! The ring of the UAVs that are alive, and the slots that they fly in the formation.
//!
//! The slots are a pure function of the formation and of who is alive, so all UAVs that agree on that fly the same ones.
//! They must never depend on how or when a UAV was lost.

use crate::{CirclePlace, Formation, Manoeuvre, RingOrder, Shape, Slot, UavId};
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// The smallest ring. Fewer UAVs keep their original slots: two would make a line through the centre, and one a point.
const RING_MIN: usize = 3;

/// Which slots the living UAVs take after a loss.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum OnLoss {
    /// Evenly on a circle, neighbours L apart; the circle shrinks.
    KeepSpacing,
    /// Evenly on the circle of radius R; the spacing grows.
    KeepRadius,
    /// Their original ones; the gap stays.
    KeepSlots,
}

/// The slots of the living UAVs.
///
/// The living close the gaps in the order of their places, and so that they move as little as possible:
///
/// - Round the centre (ring, ellipse, star) they spread evenly, turned so that the sum of the squared differences
///   between new and original bearings is smallest. A slot of a star stays an outer or an inner one.
/// - Along a path (vee, echelon, grid, listed offsets) they take successive places, so the arm, line or row closes up.
///   It closes from the side from which the sum of the squared distances to the original places is smallest.
#[derive(Debug, Clone, PartialEq)]
pub struct LivingRing {
    formation: Formation,
    /// Who is whose neighbour: the same for the whole flight.
    order: RingOrder,
    /// Which UAV has which place in the formation. A manoeuvre may change it.
    places: RingOrder,
    /// `None` under a law that ignores losses and always flies the whole ring.
    on_loss: Option<OnLoss>,
    /// The living UAVs as slots of `order`, ascending.
    living: Vec<u32>,
    /// The places that the living UAVs have in the whole formation, ascending.
    taken: Vec<u32>,
    radius_m: f64,
    /// Bearing of the living UAV that comes first round the centre.
    first_rad: f64,
    /// How many places at the beginning of the path stay empty.
    skipped: u32,
}

impl LivingRing {
    /// The ring of the UAVs in this `order` while all are alive. Without `on_loss` it stays whole, whichever UAVs are
    /// lost.
    pub fn whole(formation: Formation, order: RingOrder, on_loss: Option<OnLoss>) -> Self {
        // A whole ring takes its slots from the formation, so what `spread` computes has no meaning in it.
        let living: Vec<_> = (1..=formation.count()).collect();
        let radius_m = formation.radius_m();
        let (taken, places) = (living.clone(), order.clone());
        Self { formation, order, places, on_loss, living, taken, radius_m, first_rad: 0.0, skipped: 0 }
    }

    /// Changes to the ring of the UAVs for which `lives` is true; returns whether the ring has changed.
    ///
    /// Without `on_loss` nothing changes.
    pub fn reform(&mut self, lives: impl Fn(u32) -> bool) -> bool {
        let living = || (1..=self.formation.count()).filter(|slot| lives(self.order.uav(*slot).0));
        let changes = self.on_loss.is_some() && !living().eq(self.living.iter().copied());
        if changes {
            // In ascending order, as the searches below require.
            self.living = living().collect();
            self.spread();
        }
        changes
    }

    /// Changes to the formation of `manoeuvre`. Who is alive, and who is whose neighbour, stays the same.
    pub fn turn_to(&mut self, manoeuvre: &Manoeuvre) {
        self.formation = manoeuvre.formation.clone();
        self.places = manoeuvre.places.clone();
        self.spread();
    }

    fn spread(&mut self) {
        self.taken = self.living.iter().map(|slot| self.places.slot(self.order.uav(*slot))).collect();
        self.taken.sort_unstable();
        // In any other ring all UAVs have their original slots, and nothing reads these numbers.
        if !self.has_closed() {
            return;
        }
        if self.formation.shape().is_path() {
            self.skipped = self.least_moved();
        } else {
            let formation = &self.formation;
            self.radius_m = match self.on_loss {
                Some(OnLoss::KeepSpacing) => formation.radius_of_m(self.living.len() as u32),
                Some(OnLoss::KeepRadius | OnLoss::KeepSlots) | None => formation.radius_m(),
            };
            self.first_rad = self.least_turned_rad();
        }
    }

    /// The formation of the whole swarm.
    pub fn formation(&self) -> &Formation {
        &self.formation
    }

    /// Which UAV is where in the ring, and so who is whose neighbour.
    pub fn order(&self) -> &RingOrder {
        &self.order
    }

    /// The living UAVs in the order of their places in the formation.
    pub fn in_formation(&self) -> impl Iterator<Item = u32> {
        self.taken.iter().map(|place| self.places.uav(*place).0)
    }

    /// How many UAVs are alive.
    pub fn count(&self) -> usize {
        self.living.len()
    }

    /// Whether all UAVs are alive.
    pub fn is_whole(&self) -> bool {
        self.living.len() == self.formation.count() as usize
    }

    /// Whether UAV `number` is alive.
    pub fn has(&self, number: u32) -> bool {
        self.living.binary_search(&self.order.slot(UavId(number))).is_ok()
    }

    /// The slot of UAV `number`. A UAV that is not alive has its original slot.
    pub fn slot(&self, number: u32) -> Slot {
        let place = self.places.slot(UavId(number));
        match self.taken.binary_search(&place) {
            Ok(rank) if self.has_closed() => self.closed(rank, place),
            _ => self.formation.place(place),
        }
    }

    /// The slot of the living UAV of this `rank` in the order of places; in the whole formation it has `place`.
    fn closed(&self, rank: usize, place: u32) -> Slot {
        if self.formation.shape().is_path() {
            return self.formation.along_path(self.skipped + rank as u32 + 1);
        }
        let bearing_rad = self.first_rad - self.step_rad(rank);
        self.formation.round_centre(place, CirclePlace { bearing_rad, radius_m: self.radius_m })
    }

    /// The living UAVs before and after UAV `number` in the ring, whether that UAV is alive or not; `None` if no other
    /// UAV is left.
    pub fn neighbours(&self, number: u32) -> [Option<u32>; 2] {
        // A lost UAV has neighbours too: `place` is where it would be if it were alive.
        let own = self.order.slot(UavId(number));
        let place = self.living.partition_point(|living| *living < own);
        let after = place + usize::from(self.has(number));
        let count = self.living.len();
        // With nobody alive there is no place to find; `max` only prevents the division by zero.
        let at = |place: usize| self.living.get(place % count.max(1)).filter(|slot| **slot != own);
        [at(place + count.saturating_sub(1)), at(after)].map(|slot| slot.map(|slot| self.order.uav(*slot).0))
    }

    /// The distance between the slots of UAV `number` and its `neighbour`, in metres: L in a whole ring, and in one
    /// that has closed with the same spacing.
    pub fn rest_m(&self, number: u32, neighbour: u32) -> f64 {
        // In a whole ring, return the exact L: the distance between two computed slots would be off by some bits.
        if self.is_whole() && *self.formation.shape() == Shape::Ring && self.order == self.places {
            return self.formation.spacing_m();
        }
        (self.slot(neighbour).offset() - self.slot(number).offset()).norm()
    }

    /// Whether the living have closed the gaps, and so have other slots than in the whole formation.
    fn has_closed(&self) -> bool {
        !self.is_whole() && self.living.len() >= RING_MIN && self.on_loss != Some(OnLoss::KeepSlots)
    }

    /// The angle from the first living UAV, clockwise round the centre, to the one of this `rank`.
    fn step_rad(&self, rank: usize) -> f64 {
        rank as f64 * TAU / self.living.len() as f64
    }

    /// The first UAV's bearing in the ring that is turned least.
    ///
    /// If one UAV kept its original bearing, the first one's would follow. The sum of squares is smallest at the mean
    /// of these over all the living.
    fn least_turned_rad(&self) -> f64 {
        // A plain mean is right here. Bearings are not wrapped, so there is no jump at pi that would need a circular
        // mean.
        let first = |(rank, place): (usize, &u32)| self.formation.bearing_rad(*place) + self.step_rad(rank);
        self.taken.iter().enumerate().map(first).sum::<f64>() / self.living.len() as f64
    }

    /// How many places to leave empty at the beginning of the path, so that the living move least.
    fn least_moved(&self) -> u32 {
        let offset = |place: u32| self.formation.along_path(place).offset();
        let moved_m2 = |skipped: u32| -> f64 {
            let ranked = (skipped + 1..).zip(&self.taken);
            ranked.map(|(to, from)| (offset(to) - offset(*from)).norm_squared()).sum()
        };
        let lost = self.formation.count() - self.living.len() as u32;
        // The first of equals, so that every process takes the same.
        (0..=lost).min_by(|one, other| moved_m2(*one).total_cmp(&moved_m2(*other))).unwrap_or(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector2;
    use proptest::prelude::*;
    use std::f64::consts::PI;

    fn ring(uavs: u32, on_loss: OnLoss, lost: &[u32]) -> LivingRing {
        let mut ring =
            LivingRing::whole(Formation::new(uavs, 40.0, PI), RingOrder::by_number(uavs), Some(on_loss));
        ring.reform(|number| !lost.contains(&number));
        ring
    }

    fn bearing_rad(slot: Slot) -> f64 {
        let Slot::Circle(place) = slot else { panic!("not on a circle: {slot:?}") };
        place.bearing_rad
    }

    fn original(ring: &LivingRing, number: u32) -> Slot {
        ring.formation.place(ring.places.slot(UavId(number)))
    }

    /// How far the bearing of UAV `number` is from that in the whole ring.
    fn turn_rad(ring: &LivingRing, number: u32) -> f64 {
        bearing_rad(ring.slot(number)) - bearing_rad(original(ring, number))
    }

    fn offsets(ring: &LivingRing) -> Vec<Vector2<f64>> {
        ring.living.iter().map(|number| ring.slot(*number).offset()).collect()
    }

    #[test]
    fn a_whole_ring_is_the_formation_to_the_bit() {
        let formation = Formation::new(6, 40.0, PI);
        for number in 1..=6 {
            let slot = formation.slot(number, nalgebra::Point2::origin());
            assert_eq!(ring(6, OnLoss::KeepSpacing, &[]).slot(number).offset(), slot.coords);
        }
    }

    #[test]
    fn a_ring_that_does_not_close_stays_whole() {
        let mut ring = LivingRing::whole(Formation::new(6, 40.0, PI), RingOrder::by_number(6), None);
        assert!(!ring.reform(|number| number > 2) && ring.is_whole());
        assert_eq!((ring.neighbours(3), ring.rest_m(3, 2)), ([Some(2), Some(4)], 40.0));
    }

    #[test]
    fn five_of_six_are_a_ring_of_five_turned_by_half_a_gap_each_way() {
        let five = ring(6, OnLoss::KeepSpacing, &[3]);
        assert!((five.slot(1).radius_m() - 40.0 / (2.0 * (TAU / 10.0).sin())).abs() < 1e-9);
        let turn = |number| turn_rad(&five, number);
        // Slots 2 and 4 were 120 degrees apart and are now 72: each closes half of the difference.
        assert!((turn(4) - 24_f64.to_radians()).abs() < 1e-9 && (turn(2) + 24_f64.to_radians()).abs() < 1e-9);
        assert!(turn(6).abs() < 1e-9, "the slot opposite the gap stays");
    }

    #[test]
    fn the_radius_or_the_slots_are_kept_if_the_scenario_says_so() {
        let radius = ring(6, OnLoss::KeepRadius, &[2, 5]);
        assert!(radius.living.iter().all(|number| (radius.slot(*number).radius_m() - 40.0).abs() < 1e-9));
        let slots = ring(6, OnLoss::KeepSlots, &[2, 5]);
        assert!(slots.living.iter().all(|number| slots.slot(*number) == original(&slots, *number)));
    }

    #[test]
    fn neighbours_on_both_sides_of_a_gap_that_stays_open_are_as_far_apart_as_their_slots() {
        let slots = ring(6, OnLoss::KeepSlots, &[2]);
        assert!((slots.rest_m(1, 3) - 40.0 * 3_f64.sqrt()).abs() < 1e-9);
        assert!((slots.rest_m(3, 4) - 40.0).abs() < 1e-9);
    }

    #[test]
    fn whoever_is_left_at_the_end_of_a_line_stays_there() {
        let line = Formation::shaped(Shape::Echelon { sweep_rad: 0.3 }, 6, 40.0, PI);
        let mut left = LivingRing::whole(line, RingOrder::by_number(6), Some(OnLoss::KeepSpacing));
        left.reform(|number| number > 3);
        for number in 4..=6 {
            assert_eq!(left.slot(number), original(&left, number), "uav {number}");
        }
    }

    #[test]
    fn fewer_than_three_keep_their_own_slots() {
        for lost in [&[1, 2, 4, 5][..], &[1, 2, 3, 4, 5], &[1, 2, 3, 4, 5, 6]] {
            let left = ring(6, OnLoss::KeepSpacing, lost);
            assert!((1..=6).all(|number| left.slot(number) == original(&left, number)), "{lost:?}");
        }
    }

    #[test]
    fn the_nearest_living_uavs_on_either_side_are_the_neighbours() {
        let left = ring(6, OnLoss::KeepSpacing, &[2, 3]);
        assert_eq!(left.neighbours(1), [Some(6), Some(4)]);
        assert_eq!(left.neighbours(4), [Some(1), Some(5)]);
        assert_eq!(left.neighbours(2), [Some(1), Some(4)], "a lost one would return between these");
        assert_eq!(ring(6, OnLoss::KeepSpacing, &[2, 3, 4, 5]).neighbours(1), [Some(6), Some(6)]);
        assert_eq!(ring(3, OnLoss::KeepSpacing, &[2, 3]).neighbours(1), [None, None]);
        assert_eq!(ring(3, OnLoss::KeepSpacing, &[1, 2, 3]).neighbours(1), [None, None]);
    }

    #[test]
    fn the_ring_is_that_of_the_slots_whatever_the_numbers_in_them() {
        // UAV 5 has slot 1, UAV 3 slot 2, and so on.
        let order = RingOrder::new(vec![6, 3, 2, 5, 1, 4]);
        let mut ordered =
            LivingRing::whole(Formation::new(6, 40.0, PI), order.clone(), Some(OnLoss::KeepSpacing));
        ordered.reform(|number| number != order.uav(3).0);
        let by_number = ring(6, OnLoss::KeepSpacing, &[3]);
        for slot in 1..=6 {
            let number = order.uav(slot).0;
            assert_eq!(ordered.slot(number), by_number.slot(slot));
            let expected = by_number.neighbours(slot).map(|slot| slot.map(|slot| order.uav(slot).0));
            assert_eq!(ordered.neighbours(number), expected);
        }
    }

    fn shaped(shape: Shape, uavs: u32, lost: &[u32]) -> LivingRing {
        let formation = Formation::shaped(shape, uavs, 40.0, PI);
        let mut ring = LivingRing::whole(formation, RingOrder::by_number(uavs), Some(OnLoss::KeepSpacing));
        ring.reform(|number| !lost.contains(&number));
        ring
    }

    /// How far the slot of each of `numbers` is from that in the whole formation, in multiples of L.
    fn moved(ring: &LivingRing, numbers: &[u32]) -> Vec<i64> {
        let moved = |number: &u32| {
            let spacings = (ring.slot(*number).offset() - original(ring, *number).offset()).norm() / 40.0;
            assert!((spacings - spacings.round()).abs() < 1e-9, "{spacings}");
            spacings.round() as i64
        };
        numbers.iter().map(moved).collect()
    }

    #[test]
    fn the_arm_of_a_vee_closes_up_towards_the_tip() {
        // UAVs 1 to 3 fly in the left arm, UAV 4 is the tip.
        let vee = |lost: &[u32]| shaped(Shape::Vee { sweep_rad: 0.5 }, 6, lost);
        assert_eq!(moved(&vee(&[2]), &[1, 3, 4, 5, 6]), [1, 0, 0, 0, 0]);
        assert_eq!(moved(&vee(&[5]), &[1, 2, 3, 4, 6]), [0, 0, 0, 0, 1]);
        assert_eq!(moved(&vee(&[4]), &[1, 2, 3, 5, 6]), [0, 0, 0, 1, 1], "the shorter arm gives the new tip");
        assert_eq!(moved(&vee(&[2, 5]), &[1, 3, 4, 6]), [1, 0, 0, 1]);
    }

    #[test]
    fn a_line_and_a_grid_close_up_from_the_end_that_is_nearer() {
        let line = shaped(Shape::Echelon { sweep_rad: 0.5 }, 6, &[5]);
        assert_eq!(moved(&line, &[1, 2, 3, 4, 6]), [0, 0, 0, 0, 1]);
        let grid = shaped(Shape::Grid { columns: 3 }, 9, &[2]);
        assert_eq!(moved(&grid, &[1, 3, 4, 5, 6, 7, 8, 9]), [1, 0, 0, 0, 0, 0, 0, 0]);
    }

    #[test]
    fn a_manoeuvre_changes_places_and_never_neighbours() {
        let mut ring = shaped(Shape::Ring, 6, &[]);
        let formation = Formation::shaped(Shape::Echelon { sweep_rad: 0.0 }, 6, 40.0, PI);
        let (begins, places) = (crate::Tick(0), RingOrder::new(vec![3, 1, 2, 6, 5, 4]));
        ring.turn_to(&Manoeuvre {
            begins,
            lasts_ticks: 1,
            formation: formation.clone(),
            places,
            goes_round: false,
        });
        assert_eq!(ring.neighbours(1), [Some(6), Some(2)]);
        assert_eq!(ring.slot(1), formation.place(3));
        assert!((ring.rest_m(1, 6) - 40.0).abs() < 1e-9 && (ring.rest_m(1, 2) - 80.0).abs() < 1e-9);
        // In the line, UAV 2 comes first, then UAVs 3, 1, 6, 5 and 4: it closes in that order.
        ring.reform(|number| number != 3);
        assert_eq!(ring.in_formation().collect::<Vec<_>>(), [2, 1, 6, 5, 4]);
        assert_eq!(moved(&ring, &[2, 1, 6, 5, 4]), [1, 0, 0, 0, 0]);
    }

    #[test]
    fn a_star_keeps_its_outer_and_inner_slots() {
        let star = shaped(Shape::Star { inner_ratio: 0.5 }, 8, &[2]);
        let radius_m = |number| star.slot(number).radius_m();
        for (outer, inner) in [(1, 4), (3, 4), (5, 6), (7, 8)] {
            assert!((radius_m(outer) - 2.0 * radius_m(inner)).abs() < 1e-9, "{outer} and {inner}");
        }
    }

    #[test]
    fn an_ellipse_closes_as_the_ring_that_it_is_made_of() {
        let (ellipse, ring) = (shaped(Shape::Ellipse { aspect: 1.5 }, 7, &[3]), shaped(Shape::Ring, 7, &[3]));
        for number in [1, 2, 4, 5, 6, 7] {
            let (stretched, round) = (ellipse.slot(number).offset(), ring.slot(number).offset());
            assert!((stretched - Vector2::new(round.x, 1.5 * round.y)).norm() < 1e-9, "{number}");
        }
    }

    proptest! {
        #[test]
        fn no_loss_brings_two_slots_of_a_path_nearer_together(
            uavs in 3_u32..30, lives in prop::collection::vec(any::<bool>(), 30), columns in 1_u32..6, sweep in -1.0..1.0,
        ) {
            let lost: Vec<u32> = (1..=uavs).filter(|number| !lives[*number as usize - 1]).collect();
            for shape in [Shape::Vee { sweep_rad: sweep }, Shape::Echelon { sweep_rad: sweep }, Shape::Grid { columns }] {
                let ring = shaped(shape, uavs, &lost);
                let closest = crate::formation::closest(&offsets(&ring));
                prop_assert!(closest.is_none_or(|(.., apart_m)| apart_m > 40.0 - 1e-9), "{closest:?}");
            }
        }

        #[test]
        fn the_living_are_evenly_spread_in_ring_order_and_turned_least(
            uavs in 3_u32..40, lives in prop::collection::vec(any::<bool>(), 40), turn in -1.0..1.0,
        ) {
            let lost: Vec<u32> = (1..=uavs).filter(|number| !lives[*number as usize]).collect();
            let ring = ring(uavs, OnLoss::KeepSpacing, &lost);
            prop_assume!(ring.count() >= 3);
            let offsets = offsets(&ring);
            for (one, next) in offsets.iter().zip(offsets.iter().cycle().skip(1)) {
                prop_assert!(((one - next).norm() - 40.0).abs() < 1e-9);
            }
            let moved = |extra: f64| -> f64 {
                ring.living.iter().map(|number| (turn_rad(&ring, *number) + extra).powi(2)).sum()
            };
            prop_assert!(moved(0.0) <= moved(turn) + 1e-9);
        }

        #[test]
        fn renumbering_the_uavs_around_the_ring_turns_it_and_changes_nothing_else(
            uavs in 3_u32..20, lives in prop::collection::vec(any::<bool>(), 20), by in 0_u32..20,
        ) {
            let lost: Vec<u32> = (1..=uavs).filter(|number| !lives[*number as usize]).collect();
            let shifted = |number: u32| (number - 1 + by) % uavs + 1;
            let (one, other) = (
                ring(uavs, OnLoss::KeepSpacing, &lost),
                ring(uavs, OnLoss::KeepSpacing, &lost.iter().map(|number| shifted(*number)).collect::<Vec<_>>()),
            );
            let angle = -f64::from(by) * TAU / f64::from(uavs);
            for number in &one.living {
                let turned = nalgebra::Rotation2::new(angle) * one.slot(*number).offset();
                prop_assert!((turned - other.slot(shifted(*number)).offset()).norm() < 1e-6);
            }
        }
    }
}
