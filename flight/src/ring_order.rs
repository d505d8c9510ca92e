//! Which UAV has which slot of the formation, and so who is whose ring neighbour.
//!
//! It holds for the whole flight: a UAV that returns after a loss has its slot again. It must never depend on where the
//! UAVs are during the flight.

use crate::UavId;

/// The UAVs in the order of their slots, round the whole ring.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RingOrder {
    /// The slot of each UAV, UAV 1 first.
    slots: Vec<u32>,
    /// The UAV in each slot, slot 1 first.
    uavs: Vec<UavId>,
}

impl RingOrder {
    /// UAV i of `count` has slot i, as in the paper.
    pub fn by_number(count: u32) -> Self {
        Self { slots: (1..=count).collect(), uavs: UavId::all(count).collect() }
    }

    /// Gives each UAV its slot in `slots`, UAV 1 first; slots count from 1.
    ///
    /// # Panics
    /// If two UAVs have the same slot, or a slot is not in 1 to n.
    pub fn new(slots: Vec<u32>) -> Self {
        let mut uavs: Vec<_> = UavId::all(slots.len() as u32).collect();
        // The inverse is kept as well, so that a search for a neighbour needs no loop over the swarm.
        uavs.sort_by_key(|uav| slots[uav.index()]);
        let order = Self { slots, uavs };
        // A slot that two UAVs have, or that is out of range, shows as a UAV at another place than its slot.
        assert!(
            order.uavs.iter().zip(1..).all(|(uav, slot)| order.slot(*uav) == slot),
            "not an order of slots: {:?}",
            order.slots
        );
        order
    }

    /// n, the number of UAVs and of slots.
    pub fn count(&self) -> u32 {
        self.slots.len() as u32
    }

    /// The slot of `uav`, from 1.
    pub fn slot(&self, uav: UavId) -> u32 {
        self.slots[uav.index()]
    }

    /// The UAV that has `slot`.
    pub fn uav(&self, slot: u32) -> UavId {
        self.uavs[slot as usize - 1]
    }

    /// All UAVs round the ring, that of slot 1 first.
    pub fn uavs(&self) -> &[UavId] {
        &self.uavs
    }

    /// The UAV in the slot before that of `uav`. Before slot 1 comes slot n.
    pub fn previous(&self, uav: UavId) -> UavId {
        let slot = self.slot(uav);
        self.uav(if slot == 1 { self.count() } else { slot - 1 })
    }

    /// The UAV in the slot after that of `uav`. After slot n comes slot 1.
    pub fn next(&self, uav: UavId) -> UavId {
        let slot = self.slot(uav);
        self.uav(if slot == self.count() { 1 } else { slot + 1 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_and_the_last_uav_are_ring_neighbours() {
        let order = RingOrder::by_number(6);
        assert_eq!(order.next(UavId(6)), UavId(1));
        assert_eq!(order.previous(UavId(1)), UavId(6));
    }

    #[test]
    fn neighbours_are_those_in_the_slots_on_both_sides() {
        // Slot 1 has UAV 2, slot 2 UAV 4, slot 3 UAV 1, slot 4 UAV 3.
        let order = RingOrder::new(vec![3, 1, 4, 2]);
        assert_eq!(order.uavs(), [2, 4, 1, 3].map(UavId));
        assert_eq!((order.previous(UavId(1)), order.next(UavId(1))), (UavId(4), UavId(3)));
        for uav in UavId::all(4) {
            assert_eq!(order.next(order.previous(uav)), uav);
        }
    }

    #[test]
    #[should_panic(expected = "not an order of slots")]
    fn two_uavs_never_share_a_slot() {
        RingOrder::new(vec![1, 2, 2]);
    }
}
