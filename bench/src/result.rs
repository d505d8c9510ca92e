//! The results of one `ringwing bench`: the JSON that `--json` prints, and that all tables, pages and comparisons show.
//!
//! Must never filter: a distribution holds every sample of its repeat. The warm-up is not part of a repeat.

use crate::{case::Case, latencies::Latencies};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Name of the JSON format. Programs compare it, so a changed format needs a new name.
pub(crate) const FORMAT: &str = "ringwing-bench-1";

/// Name of the results in the folder of `--out`.
pub(crate) const RESULTS_FILE: &str = "results.json";

/// The results of one benchmark.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Results {
    /// [`FORMAT`].
    pub(crate) format: String,
    /// Version of the program that measured.
    pub(crate) ringwing: String,
    /// When the benchmark began: UTC, as RFC 3339.
    pub(crate) began: String,
    /// The command that repeats the benchmark.
    pub(crate) command: String,
    /// Seed of the flights and of the order of the cases.
    pub(crate) seed: u64,
    /// The seed again. Programs that read every number as a float, such as `jq`, round one above 2^53.
    #[serde(default)]
    pub(crate) seed_text: String,
    /// The machine that the benchmark ran on.
    pub(crate) machine: Machine,
    /// Whether the user ended the benchmark before all cases were measured.
    pub(crate) interrupted: bool,
    /// All cases, in the order of the command line.
    pub(crate) cases: Vec<Measured>,
}

/// One case and its repeats.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Measured {
    /// What was measured.
    pub(crate) case: Case,
    /// The measurements, in the order in which they were made.
    pub(crate) repeats: Vec<Repeat>,
    /// Why some repeats are missing, if they are.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) failure: Option<String>,
}

/// One measurement of one case.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Repeat {
    /// Position in the order in which all repeats of all cases were measured, from 0.
    pub(crate) place: u32,
    /// When it began, in seconds after the benchmark did.
    pub(crate) began_s: f64,
    /// Wall-clock time of the measured ticks.
    pub(crate) took_s: f64,
    /// Number of measured ticks.
    pub(crate) ticks: u64,
    /// Mean wall-clock time from one tick to the next.
    pub(crate) tick_ns: f64,
    /// Duration of each hop.
    pub(crate) hops: BTreeMap<Hop, Latencies>,
    /// Deadlines missed by a period or more; 0 in a closed loop.
    pub(crate) missed_deadlines: u64,
    /// Number of times that an airframe flew a tick on an older command; 0 in a closed loop.
    pub(crate) reused_commands: u64,
    /// What the processes used.
    pub(crate) usage: Usage,
    /// The whole tick over time: slices of equal length, in order.
    pub(crate) strip: Vec<TimeSlice>,
}

/// A stage of a tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Hop {
    /// From the opening of the tick until an agent has woken up.
    Wake,
    /// Until the agent has read its inputs.
    Read,
    /// Until it has computed its answer.
    Compute,
    /// Until the world has read the answer. Absent in paced loads, where the world reads answers at its next deadline.
    Return,
    /// From the (intended) beginning of the tick to its last answer: one sample per tick.
    Tick,
}

/// A slice of a repeat's time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct TimeSlice {
    /// Ticks that should have begun in it.
    pub(crate) ticks: u64,
    /// Median of the whole tick; 0 without ticks.
    pub(crate) p50_ns: u64,
    /// The longest tick; 0 without ticks.
    pub(crate) max_ns: u64,
}

/// What all processes together used while a repeat was measured.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Usage {
    /// CPU time in user mode.
    pub(crate) user_s: f64,
    /// CPU time in the kernel.
    pub(crate) system_s: f64,
    /// Context switches because a process waited for something.
    pub(crate) voluntary_switches: u64,
    /// Context switches that the kernel forced.
    pub(crate) involuntary_switches: u64,
    /// Mean time per tick in the law, summed over all agents; 0 without a law.
    pub(crate) law_ns_per_tick: f64,
    /// Mean time per tick in iceoryx2's send and receive, summed over all processes; 0 without iceoryx2.
    pub(crate) ipc_ns_per_tick: f64,
    /// Largest proportional set size of an agent; 0 if unreadable.
    pub(crate) agent_pss_bytes: u64,
}

/// The machine that a benchmark ran on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Machine {
    /// Names and values, in the order in which they are shown.
    pub(crate) facts: Vec<(String, String)>,
    /// What on this machine makes the figures worse or less certain, each with a remedy.
    pub(crate) warnings: Vec<String>,
}
