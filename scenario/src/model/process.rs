//! How the processes of a run are supervised and how they exchange messages.

use serde::{Deserialize, Serialize};

/// `[supervision]`: how long the run waits for a process, by the wall clock.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SupervisionSection {
    /// How long all processes may take to be ready at the start, and a replacement later. Large swarms get more: see
    /// [`Scenario::start_limit`](crate::Scenario::start_limit).
    pub start_timeout_s: f64,
    /// How long a process may take to answer a tick in lockstep. After that the flight goes on without it until it
    /// answers. Large swarms get more: see [`Scenario::answer_limit`](crate::Scenario::answer_limit).
    pub answer_timeout_s: f64,
    /// How many times the run replaces a lost leader or recorder.
    pub replacements: u32,
}

impl Default for SupervisionSection {
    fn default() -> Self {
        Self { start_timeout_s: 10.0, answer_timeout_s: 2.0, replacements: 10 }
    }
}

/// `[ipc]`: how processes exchange messages. The flight is the same for every choice, to the bit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct IpcSection {
    /// How agents wait for a tick, and the world for their answers.
    pub wake: Wake,
    /// Additional bytes that travel each way between the world and every agent in each tick, for benchmarks.
    pub payload_bytes: u32,
    /// Allow one or two UAVs, which form no ring, for benchmarks: one in the centre, or two on opposite sides of it.
    pub few_uavs: bool,
}

impl Default for IpcSection {
    fn default() -> Self {
        Self { wake: Wake::Gate, payload_bytes: 0, few_uavs: false }
    }
}

/// How a process waits for the next tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Wake {
    /// At the tick gate: yields for a short time, then sleeps on a futex.
    Gate,
    /// At the tick gate, without ever sleeping.
    Spin,
    /// On an event of the shared-memory bus.
    Event,
}
