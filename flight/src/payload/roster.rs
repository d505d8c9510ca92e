//! The roster: which processes run, from the launcher to the world.

use crate::{Tick, UavId};
use bytemuck::{Pod, Zeroable};

/// The largest swarm that a [`Roster`] has room for. A larger value makes every roster and the tick gate's page
/// larger; a smaller one limits the swarm.
pub const MAX_UAVS: u32 = 1024;

/// Words of 64 bits for one bit per UAV.
const WORDS: usize = MAX_UAVS as usize / 64;
/// A tick that no flight reaches: with this limit the world may open every tick.
const UNBOUNDED: Tick = Tick(i64::MAX);

// The bits of `Roster::flags`.
const LEADER: u64 = 1;
const RECORDER: u64 = 2;
const HOLD: u64 = 4;
const PAUSED: u64 = 8;

/// Which processes the world may wait for. The launcher sends it whenever it changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Roster {
    /// Grows by one with each change.
    pub revision: u64,
    /// In lockstep the world must not open this tick or a later one: the launcher has to apply a fault first, or the user
    /// has paused the flight.
    pub free_before: Tick,
    flags: u64,
    /// The agents that run: one bit each, UAV 1 in the lowest bit of the first word.
    agents: [u64; WORDS],
}

impl Roster {
    /// A roster of no processes that lets the world open every tick.
    pub fn empty() -> Self {
        // A limit of 0 would keep the world from opening tick 0.
        Self { free_before: UNBOUNDED, ..Self::zeroed() }
    }

    /// Whether `uav`'s agent runs.
    pub fn has(&self, uav: UavId) -> bool {
        // UAV numbers are at most `MAX_UAVS`, so the word exists.
        self.agents[uav.index() / 64] & bit(uav) != 0
    }

    /// Notes whether `uav`'s agent runs.
    pub fn set(&mut self, uav: UavId, runs: bool) {
        set_bits(&mut self.agents[uav.index() / 64], bit(uav), runs);
    }

    /// Whether the leader runs.
    pub fn has_leader(&self) -> bool {
        self.flags & LEADER != 0
    }

    /// Notes whether the leader runs.
    pub fn set_leader(&mut self, runs: bool) {
        set_bits(&mut self.flags, LEADER, runs);
    }

    /// Whether the recorder runs.
    pub fn has_recorder(&self) -> bool {
        self.flags & RECORDER != 0
    }

    /// Notes whether the recorder runs.
    pub fn set_recorder(&mut self, runs: bool) {
        set_bits(&mut self.flags, RECORDER, runs);
    }

    /// Whether a lost leader or recorder is being replaced. In lockstep the world opens no tick meanwhile.
    pub fn holds(&self) -> bool {
        self.flags & HOLD != 0
    }

    /// Notes whether a lost leader or recorder is being replaced.
    pub fn set_hold(&mut self, hold: bool) {
        set_bits(&mut self.flags, HOLD, hold);
    }

    /// Whether the user pauses or steps the flight. In lockstep no time limit runs meanwhile.
    pub fn is_paused(&self) -> bool {
        self.flags & PAUSED != 0
    }

    /// Notes whether the user pauses or steps the flight.
    pub fn set_paused(&mut self, paused: bool) {
        set_bits(&mut self.flags, PAUSED, paused);
    }
}

fn bit(uav: UavId) -> u64 {
    1 << (uav.index() % 64)
}

fn set_bits(word: &mut u64, bits: u64, value: bool) {
    *word = if value { *word | bits } else { *word & !bits };
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_uav_has_a_bit_of_its_own() {
        let mut roster = Roster::empty();
        for uav in UavId::all(MAX_UAVS) {
            assert!(!roster.has(uav));
            roster.set(uav, true);
            assert!(roster.has(uav));
        }
        roster.set(UavId(65), false);
        assert!(!roster.has(UavId(65)) && roster.has(UavId(64)) && roster.has(UavId(66)));
    }

    #[test]
    fn no_flag_changes_another() {
        let mut roster = Roster::empty();
        roster.set_recorder(true);
        assert!(roster.has_recorder() && !roster.has_leader() && !roster.holds());
        roster.set_hold(true);
        roster.set_recorder(false);
        assert!(!roster.has_recorder() && roster.holds() && !roster.is_paused());
        roster.set_paused(true);
        roster.set_hold(false);
        assert!(!roster.holds() && roster.is_paused());
    }
}
