//! Every timestamp of every measured tick, and what the processes used meanwhile: all latencies are computed from these.
//!
//! Must never compute a latency itself, and must never leave out a tick.

use crate::usage::ProcessUsage;
use bytemuck::{Pod, Zeroable};
use serde::{Deserialize, Serialize};

/// A tick, as the process that opened it saw it. All times are nanoseconds of `CLOCK_MONOTONIC`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct TickRecord {
    /// The tick.
    pub(crate) tick: i64,
    /// When it should have begun: its deadline if ticks are paced, otherwise `opened_ns`.
    pub(crate) intended_ns: u64,
    /// When it began.
    pub(crate) opened_ns: u64,
    /// When everything that the agents need for it was sent.
    pub(crate) published_ns: u64,
    /// When the process last began to look for answers.
    pub(crate) looked_ns: u64,
    /// When it had read the last of them.
    pub(crate) collected_ns: u64,
    /// Ticks that should have begun between `intended_ns` and `opened_ns`, and never did.
    pub(crate) skipped: u32,
    /// Airframes that flew on an older command.
    pub(crate) reused: u32,
}

/// An agent's part in a tick.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct StepRecord {
    /// The tick.
    pub(crate) tick: i64,
    /// When the agent saw the tick.
    pub(crate) woke_ns: u64,
    /// When it had read its inputs.
    pub(crate) read_ns: u64,
    /// When it began to send its answer.
    pub(crate) sent_ns: u64,
    /// When the answer had been read; 0 if unknown.
    pub(crate) seen_ns: u64,
    /// How long sending took in the tick before: a message cannot carry how long its own sending takes.
    pub(crate) sending_ns: u64,
    /// The agent, from 0.
    pub(crate) member: u32,
    /// Zero; keeps the layout free of padding.
    pub(crate) reserved: u32,
}

/// The timestamps of a measurement.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct Trace {
    /// All ticks, in order and without a gap.
    pub(crate) ticks: Vec<TickRecord>,
    /// All answers, in the order in which they were read.
    pub(crate) steps: Vec<StepRecord>,
}

/// What a trace covers and what the processes used meanwhile: the first line of its file, in JSON.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct TraceHead {
    /// Number of [`TickRecord`]s.
    pub(crate) ticks: usize,
    /// Number of [`StepRecord`]s.
    pub(crate) steps: usize,
    /// When the warm-up ended, in nanoseconds of `CLOCK_MONOTONIC`.
    pub(crate) began_ns: u64,
    /// When the measured time ended.
    pub(crate) ended_ns: u64,
    /// What all processes together used in between.
    pub(crate) used: ProcessUsage,
    /// Largest proportional set size of an agent, in bytes; 0 if unreadable.
    pub(crate) agent_pss_bytes: u64,
}
