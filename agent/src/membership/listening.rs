//! Which UAVs of one side of the ring are worth listening to.
//!
//! Never decides who is alive.

use ringwing_flight::Tick;

/// Lost UAVs to listen to on each side, in case they return. If more are lost, the others take turns, one at a time. A
/// larger number notices returns sooner and takes more connections.
const LOST_PER_SIDE: usize = 8;
/// How long each turn lasts, in loss timeouts. Shorter turns get round sooner, but may end before anything arrives
/// from a UAV that has returned.
const TURN_TIMEOUTS: i64 = 2;

/// One side of the ring, in places: 0 is the nearest UAV in the whole ring.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Side {
    /// The place of the nearest UAV that is alive.
    nearest_alive: Option<usize>,
    /// The lost UAVs before that place.
    lost: usize,
    /// The place beyond [`LOST_PER_SIDE`] whose turn it is.
    in_turn: Option<usize>,
}

impl Side {
    /// A side of `others` UAVs at `now`.
    pub(super) fn new(nearest_alive: Option<usize>, others: usize, now: Tick, timeout_ticks: i64) -> Self {
        let lost = nearest_alive.unwrap_or(others);
        // The tick alone decides whose turn it is, so a restarted agent takes the same turns.
        let turn = (now.0 / (TURN_TIMEOUTS * timeout_ticks)).unsigned_abs() as usize;
        let beyond = lost.saturating_sub(LOST_PER_SIDE);
        let in_turn = (beyond > 0).then(|| LOST_PER_SIDE + turn % beyond);
        Self { nearest_alive, lost, in_turn }
    }

    /// Whether to listen to the UAV at `place`: the neighbour in the whole ring, the nearest that is alive, and the
    /// lost ones between them.
    pub(super) fn includes(&self, place: usize) -> bool {
        place == 0
            || self.nearest_alive == Some(place)
            || place < LOST_PER_SIDE.min(self.lost)
            || self.in_turn == Some(place)
    }

    /// Whether some UAVs may have to take turns if `listened` UAVs, on both sides together, are listened to.
    pub(super) fn may_take_turns(listened: usize) -> bool {
        // One side is enough: the UAVs of the other may all be alive.
        listened > LOST_PER_SIDE
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn included(nearest_alive: Option<usize>, now: i64) -> Vec<usize> {
        let side = Side::new(nearest_alive, 12, Tick(now), 10);
        (0..12).filter(|place| side.includes(*place)).collect()
    }

    #[test]
    fn the_nearest_alive_and_the_lost_before_it_are_listened_to() {
        assert_eq!(included(Some(0), 0), [0]);
        assert_eq!(included(Some(3), 0), [0, 1, 2, 3]);
    }

    #[test]
    fn of_many_lost_those_farther_away_take_turns() {
        let near = [0, 1, 2, 3, 4, 5, 6, 7];
        for (now, in_turn) in [(0, 8), (19, 8), (20, 9), (40, 10), (60, 8)] {
            assert_eq!(included(Some(11), now), [&near[..], &[in_turn, 11]].concat(), "at {now}");
        }
        assert_eq!(included(None, 60), [&near[..], &[11]].concat(), "with nobody left alive");
    }
}
