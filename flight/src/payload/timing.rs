//! How long ticks take, and how far the swarm is from its formation: for the log and the progress line.

use crate::Tick;
use bytemuck::{Pod, Zeroable};

/// How long one tick took and where, once a tick, from the world. Wall clock: never part of a payload hash.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct TickTiming {
    /// The tick.
    pub tick: i64,
    /// From the opening of the tick until the last answer was sent.
    pub round_trip_ns: u64,
    /// From the opening until the last agent saw it.
    pub wake_ns: u64,
    /// The longest time an agent took to read its inputs.
    pub read_ns: u64,
    /// The longest time an agent took to compute and publish.
    pub compute_ns: u64,
    /// The longest time from an agent's answer until the world read it.
    pub return_ns: u64,
    /// How late the tick opened against its deadline; 0 in lockstep.
    pub late_ns: u64,
    /// Airframes whose command of this tick arrived in time.
    pub answered: u32,
    /// Airframes that flew on an older command.
    pub reused: u32,
    /// Deadlines missed by a whole period or more; 0 in lockstep.
    pub missed_deadlines: u32,
    /// Zero; keeps the layout free of padding.
    pub reserved: u32,
}

/// How far the swarm is from its formation, from the recorder, for the progress line.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct FormationError {
    /// The tick it describes.
    pub tick: Tick,
    /// The largest slot error among the UAVs that fly on command, metres.
    pub slot_error_max_m: f64,
    /// How many UAVs fly on command.
    pub commanded: u32,
    /// Zero; keeps the layout free of padding.
    pub reserved: u32,
}
