//! What the log and the progress line show of a run besides the flight: how long ticks take, and how far the swarm is
//! from its formation.

use crate::Tick;
use bytemuck::{Pod, Zeroable};

/// How long one tick took, and where the time went; from the world, once a tick.
///
/// These are wall-clock times, so they must never be part of a payload hash.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct TickTiming {
    /// The tick.
    pub tick: i64,
    /// Time from the opening of the tick until the last answer was sent.
    pub round_trip_ns: u64,
    /// Time from the opening until the last agent saw the tick.
    pub wake_ns: u64,
    /// The longest time an agent took to read its inputs.
    pub read_ns: u64,
    /// The longest time an agent took to compute and publish.
    pub compute_ns: u64,
    /// The longest time from an agent's answer until the world read it.
    pub return_ns: u64,
    /// Time from the tick's deadline until it was opened; 0 in lockstep.
    pub late_ns: u64,
    /// How many airframes flew on the command of this tick.
    pub answered: u32,
    /// How many airframes flew on an older command.
    pub reused: u32,
    /// How many deadlines were missed by a period or more; 0 in lockstep.
    pub missed_deadlines: u32,
    /// Zero; keeps the layout free of padding.
    pub reserved: u32,
}

/// How far the swarm is from its formation; from the recorder, for the progress line.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct FormationError {
    /// The tick at which it was measured.
    pub tick: Tick,
    /// The largest distance of a UAV from its slot, in metres, among the UAVs that fly on command; 0 if it is not known.
    pub slot_error_max_m: f64,
    /// How many UAVs fly on command.
    pub commanded: u32,
    /// 1 if the slot error is known; 0 without a UAV that flies on command, or without the leader.
    pub measured: u32,
}
