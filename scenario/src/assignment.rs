//! Gives the slots of a formation to the UAVs that are near them, at the start and in a manoeuvre.
//!
//! Never depends on anything but the scenario, so that all processes of a run agree on who has which slot.

use crate::{Scenario, start};
use nalgebra::Point2;
use pathfinding::{kuhn_munkres::kuhn_munkres_min, matrix::Matrix};
use ringwing_flight::{Formation, RingOrder, UavId};

/// Square millimetres in a square metre. The method needs whole numbers, and with them no rounding decides a tie. A finer
/// unit would overflow sooner.
const MM2_PER_M2: f64 = 1e6;
/// Largest squared distance that counts. The sum over a swarm of 1024 must stay within an `i64`.
const FARTHEST_MM2: f64 = 1e15;

/// The order with the least sum of squared distances from the starts to the slots at time 0.
///
/// Squares make two UAVs swap slots rather than cross each other's way. A scenario whose starts cannot be drawn is refused
/// before it flies; here it gets the order by number.
pub(crate) fn nearest(scenario: &Scenario) -> RingOrder {
    let uavs = scenario.formation.uavs;
    let Ok(starts) = start::states(scenario) else { return RingOrder::by_number(uavs) };
    let starts: Vec<Point2<f64>> = starts.iter().map(|start| start.position_m.into()).collect();
    let slots: Vec<_> = (1..=uavs).map(|slot| scenario.start_slot(slot)).collect();
    least_squares(&starts, &slots)
}

/// Who gets which place of the formation `after`, if the UAVs fly `before` in these `places`: again the least sum.
///
/// Straight ways of this order come no nearer to each other than 1 / sqrt(2) of the smallest distance of two slots (Turpin,
/// Michael and Kumar 2014).
pub(crate) fn nearest_places(before: &Formation, places: &RingOrder, after: &Formation) -> RingOrder {
    // Any centre will do: the leader moves both formations alike, so its place cancels out.
    let centre = Point2::origin();
    let starts: Vec<_> =
        UavId::all(before.count()).map(|uav| before.slot(places.slot(uav), centre)).collect();
    let slots: Vec<_> = (1..=after.count()).map(|slot| after.slot(slot, centre)).collect();
    least_squares(&starts, &slots)
}

/// The order with the least sum of squared distances, UAV 1 first in `starts` and slot 1 in `slots`.
fn least_squares(starts: &[Point2<f64>], slots: &[Point2<f64>]) -> RingOrder {
    let cost = |(start, slot): (usize, usize)| {
        let apart = starts[start] - slots[slot];
        (apart.norm_squared() * MM2_PER_M2).round().min(FARTHEST_MM2) as i64
    };
    let count = starts.len();
    let (_, chosen) = kuhn_munkres_min(&Matrix::from_fn(count, count, cost));
    RingOrder::new(chosen.into_iter().map(|slot| slot as u32 + 1).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Assignment, FormationSection, ShapeName, StartState};
    use proptest::prelude::*;

    fn drawn(uavs: u32, seed: u64) -> Scenario {
        let mut scenario = Scenario { seed, ..Scenario::default() };
        scenario.formation.uavs = uavs;
        scenario.formation.assignment = Assignment::Nearest;
        scenario
    }

    fn starting_in_slots(slots: &[u32]) -> Scenario {
        let mut scenario = drawn(slots.len() as u32, 1);
        let formation = scenario.formation();
        let start = |slot: &u32| StartState {
            position_m: formation.slot(*slot, Point2::origin()).into(),
            heading_deg: 0.0,
            speed_m_s: 15.0,
        };
        scenario.start.uavs = slots.iter().map(start).collect();
        scenario
    }

    /// The sum of the squared distances from the starts to the slots of `order`.
    fn sum_m2(scenario: &Scenario, order: &RingOrder) -> f64 {
        let starts = start::states(scenario).unwrap();
        let apart = |(uav, start): (UavId, &StartState)| {
            let slot = scenario.formation().slot(order.slot(uav), scenario.leader.start_m.into());
            (slot - Point2::from(start.position_m)).norm_squared()
        };
        UavId::all(order.count()).zip(&starts).map(apart).sum()
    }

    #[test]
    fn who_starts_in_a_slot_has_it() {
        let scenario = starting_in_slots(&[4, 2, 6, 1, 3, 5]);
        assert_eq!(scenario.ring_order(), RingOrder::new(vec![4, 2, 6, 1, 3, 5]));
    }

    #[test]
    fn by_number_the_starts_do_not_matter() {
        let mut scenario = starting_in_slots(&[4, 2, 6, 1, 3, 5]);
        scenario.formation.assignment = Assignment::Number;
        assert_eq!(scenario.ring_order(), RingOrder::by_number(6));
    }

    #[test]
    fn a_swarm_without_room_to_start_has_the_order_by_number() {
        let mut scenario = drawn(6, 1);
        scenario.start.draw.separation_m = 100.0;
        assert_eq!(scenario.ring_order(), RingOrder::by_number(6));
    }

    #[test]
    fn millimetres_decide_who_gets_which_slot() {
        let slots = [Point2::new(0.0, 0.0), Point2::new(40.0, 0.0)];
        let order = |one_m: f64, other_m: f64| {
            least_squares(&[Point2::new(one_m, 0.0), Point2::new(other_m, 0.0)], &slots)
        };
        assert_eq!(order(20.0, 20.001), RingOrder::new(vec![1, 2]));
        assert_eq!(order(20.001, 20.0), RingOrder::new(vec![2, 1]));
    }

    #[test]
    fn far_starts_do_not_overflow() {
        let mut scenario = starting_in_slots(&[2, 1, 3]);
        scenario.start.uavs[0].position_m = [1e12, -1e12];
        assert_eq!(scenario.ring_order().count(), 3);
    }

    proptest! {
        #[test]
        fn straight_ways_to_the_nearest_places_stay_apart(
            uavs in 3_u32..14, from in 0_usize..5, to in 0_usize..5, share in 0.0..1.0, turn in -180.0..180.0,
        ) {
            const SHAPES: [ShapeName; 5] =
                [ShapeName::Ring, ShapeName::Vee, ShapeName::Echelon, ShapeName::Grid, ShapeName::Star];
            let section = |shape, bearing_deg| FormationSection { uavs, shape, bearing_deg, ..FormationSection::default() };
            let (before, after) = (section(SHAPES[from], 180.0).geometry(), section(SHAPES[to], turn).geometry());
            let places = RingOrder::by_number(uavs);
            let next = nearest_places(&before, &places, &after);
            let way = |uav: UavId| {
                let (here, there) = (places.slot(uav), next.slot(uav));
                before.slot(here, Point2::origin()).lerp(&after.slot(there, Point2::origin()), share)
            };
            for (one, other) in (1..=uavs).flat_map(|one| (1..one).map(move |other| (UavId(one), UavId(other)))) {
                let apart_m = (way(one) - way(other)).norm();
                prop_assert!(apart_m > 40.0 / 2.0_f64.sqrt() - 1e-3, "{one} and {other}: {apart_m} m");
            }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        #[test]
        fn no_swap_of_two_slots_brings_the_starts_nearer(uavs in 3_u32..12, seed: u64) {
            let scenario = drawn(uavs, seed);
            let order = scenario.ring_order();
            let least_m2 = sum_m2(&scenario, &order);
            for (one, other) in (0..uavs as usize).flat_map(|one| (0..one).map(move |other| (one, other))) {
                let mut slots: Vec<_> = UavId::all(uavs).map(|uav| order.slot(uav)).collect();
                slots.swap(one, other);
                prop_assert!(sum_m2(&scenario, &RingOrder::new(slots)) > least_m2 - 1e-4);
            }
        }
    }
}
