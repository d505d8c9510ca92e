//! The world's account of a finished flight, for the verdict and the log.

use crate::{Collider, UavId};
use serde::{Deserialize, Serialize};

/// What the world reports when the flight is over.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct WorldReport {
    /// The last tick flown.
    pub last_tick: i64,
    /// Whether that was the scenario's last tick, or the end of what was to be measured.
    pub complete: bool,
    /// XXH3 hash, 128 bits in hexadecimal, of all payloads that the flight depends on. Equal hashes mean equal flights.
    pub payload_hash: String,
    /// All collisions, in order of time.
    pub collisions: Vec<Collision>,
    /// How many times an airframe went into its failsafe.
    pub failsafes: u32,
    /// Commands that the world refused: not finite, from another UAV, or for another tick.
    pub refused_commands: u64,
    /// How many times an airframe flew a tick on an older command, summed over all airframes.
    pub reused_commands: u64,
    /// Deadlines that were missed by a period or more; 0 in lockstep.
    pub missed_deadlines: u64,
    /// Ticks for which some process did not answer within the scenario's limit; 0 in real time.
    pub unanswered_ticks: u64,
    /// The longest time from a tick's deadline until it was opened, in microseconds; 0 in lockstep.
    pub late_max_us: f64,
    /// Time from the opening of a tick to its last answer; `None` if no process ever answered.
    pub latency: Option<Latency>,
}

/// A latency's distribution over the ticks of a run, in microseconds of wall-clock time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Latency {
    /// Median.
    pub p50_us: f64,
    /// 99th percentile.
    pub p99_us: f64,
    /// Maximum.
    pub max_us: f64,
}

/// A UAV collided with something.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Collision {
    /// Simulated time.
    pub time_s: f64,
    /// The UAV; if two UAVs collided, the one with the lower number.
    pub uav: UavId,
    /// What it collided with.
    pub with: Collider,
    /// Where the UAV was, in the local frame.
    pub position_m: [f64; 2],
}
