//! Gives the slots of the formation to the UAVs that start near them.
//!
//! Never depends on anything but the scenario, so that all processes of a run agree on who has which slot.

use crate::{Scenario, start};
use nalgebra::Point2;
use pathfinding::{kuhn_munkres::kuhn_munkres_min, matrix::Matrix};
use ringwing_flight::RingOrder;

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
    let slots: Vec<_> = (1..=uavs).map(|slot| scenario.start_slot(slot)).collect();
    let cost = |(start, slot): (usize, usize)| {
        let apart = Point2::from(starts[start].position_m) - slots[slot];
        (apart.norm_squared() * MM2_PER_M2).round().min(FARTHEST_MM2) as i64
    };
    let count = starts.len();
    let (_, chosen) = kuhn_munkres_min(&Matrix::from_fn(count, count, cost));
    RingOrder::new(chosen.into_iter().map(|slot| slot as u32 + 1).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Assignment, StartState};
    use proptest::prelude::*;
    use ringwing_flight::UavId;

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
    fn far_starts_do_not_overflow() {
        let mut scenario = starting_in_slots(&[2, 1, 3]);
        scenario.start.uavs[0].position_m = [1e12, -1e12];
        assert_eq!(scenario.ring_order().count(), 3);
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
