//! Who runs, from the launcher to the world.

use crate::{Tick, UavId};
use bytemuck::{Pod, Zeroable};

/// How many UAVs a [`Roster`] can name. More take more room in the gate's page and in every roster.
pub const MAX_UAVS: u32 = 1024;

const WORDS: usize = MAX_UAVS as usize / 64;
/// A tick that no flight reaches: nothing holds the flight before its end.
const UNBOUNDED: Tick = Tick(i64::MAX);

// One bit each of a roster's flags.
const LEADER: u64 = 1;
const RECORDER: u64 = 2;
const HOLD: u64 = 4;
const LEADER_THAWED: u64 = 8;

/// Which processes the world may wait for, from the launcher, whenever it changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Roster {
    /// Grows by one with each change.
    pub revision: u64,
    /// In lockstep, the world opens no tick from this one on: the launcher has to apply a fault first.
    pub free_before: Tick,
    flags: u64,
    /// Zero; keeps the size a multiple of a cache line's half.
    reserved: u64,
    /// The agents that run, one bit each, UAV 1 first.
    agents: [u64; WORDS],
    /// The agents that were thawed, one bit each.
    thawed: [u64; WORDS],
}

impl Roster {
    /// A roster without any process.
    pub fn empty() -> Self {
        Self { free_before: UNBOUNDED, ..Self::zeroed() }
    }

    /// Whether `uav`'s agent runs.
    pub fn has(&self, uav: UavId) -> bool {
        self.agents[uav.index() / 64] & bit(uav) != 0
    }

    /// Notes whether `uav`'s agent runs.
    pub fn set(&mut self, uav: UavId, runs: bool) {
        set_bits(&mut self.agents[uav.index() / 64], bit(uav), runs);
    }

    /// Whether `uav`'s agent was thawed: it still answers the tick that was open while it was frozen.
    pub fn is_thawed(&self, uav: UavId) -> bool {
        self.thawed[uav.index() / 64] & bit(uav) != 0
    }

    /// Notes whether `uav`'s agent was thawed.
    pub fn set_thawed(&mut self, uav: UavId, thawed: bool) {
        set_bits(&mut self.thawed[uav.index() / 64], bit(uav), thawed);
    }

    /// Whether the leader runs.
    pub fn has_leader(&self) -> bool {
        self.flags & LEADER != 0
    }

    /// Notes whether the leader runs.
    pub fn set_leader(&mut self, runs: bool) {
        set_bits(&mut self.flags, LEADER, runs);
    }

    /// Whether the leader was thawed.
    pub fn is_leader_thawed(&self) -> bool {
        self.flags & LEADER_THAWED != 0
    }

    /// Notes whether the leader was thawed.
    pub fn set_leader_thawed(&mut self, thawed: bool) {
        set_bits(&mut self.flags, LEADER_THAWED, thawed);
    }

    /// Whether the recorder runs.
    pub fn has_recorder(&self) -> bool {
        self.flags & RECORDER != 0
    }

    /// Notes whether the recorder runs.
    pub fn set_recorder(&mut self, runs: bool) {
        set_bits(&mut self.flags, RECORDER, runs);
    }

    /// Whether a lost leader or recorder is being replaced: in lockstep, no time passes meanwhile.
    pub fn holds(&self) -> bool {
        self.flags & HOLD != 0
    }

    /// Notes whether a lost leader or recorder is being replaced.
    pub fn set_hold(&mut self, hold: bool) {
        set_bits(&mut self.flags, HOLD, hold);
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
    fn a_roster_keeps_each_uav_apart() {
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
    fn each_flag_is_its_own() {
        let mut roster = Roster::empty();
        roster.set_recorder(true);
        assert!(
            roster.has_recorder() && !roster.has_leader() && !roster.holds() && !roster.is_leader_thawed()
        );
        roster.set_hold(true);
        roster.set_recorder(false);
        assert!(!roster.has_recorder() && roster.holds());
    }
}
