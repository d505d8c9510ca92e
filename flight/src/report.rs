//! What the world leaves behind when the flight ends, for the verdict and the log.

use crate::{Collider, UavId};
use serde::{Deserialize, Serialize};

/// The flight as the world saw it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct WorldReport {
    /// The last tick flown.
    pub last_tick: i64,
    /// Whether that was the scenario's last tick.
    pub complete: bool,
    /// Hash of every payload that the flight depends on, XXH3 with 128 bits, in hexadecimal.
    pub payload_hash: String,
    /// What ran into what, in order of time.
    pub collisions: Vec<Collision>,
    /// Airframes that were in their failsafe at some time.
    pub failsafes: u32,
    /// Commands that were refused: not finite, from another UAV, or out of their time.
    pub refused_commands: u64,
    /// Airframe ticks flown on an older command.
    pub reused_commands: u64,
    /// Deadlines missed by a period or more; 0 in lockstep.
    pub missed_deadlines: u64,
    /// Times that waiting for answers took longer than the scenario allows.
    pub unanswered_ticks: u64,
    /// The latest a tick was opened after its deadline; 0 in lockstep.
    pub late_max_us: f64,
    /// From the opening of a tick to its last answer; `None` if none came.
    pub latency: Option<Latency>,
}

/// A latency's distribution over the ticks of a run, in microseconds of wall-clock time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Latency {
    /// Median.
    pub p50_us: f64,
    /// 99th percentile.
    pub p99_us: f64,
    /// The largest.
    pub max_us: f64,
}

/// Something ran into something.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Collision {
    /// When, in simulated time.
    pub time_s: f64,
    /// The UAV; the one with the lower number if two met.
    pub uav: UavId,
    /// What it ran into.
    pub with: Collider,
    /// Where the UAV was, in the local frame.
    pub position_m: [f64; 2],
}
