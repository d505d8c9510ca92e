//! Every timestamp of every measured tick, in memory and as a file; latencies are computed from these.
//!
//! Must never compute a latency itself, and must never leave out a tick.

use crate::usage::ProcessUsage;
use bytemuck::{Pod, Zeroable};
use ringwing_bus::BusError;
use serde::{Deserialize, Serialize};
use std::{
    fs::File,
    io::{self, BufWriter, Read, Write},
    path::Path,
};

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

impl Trace {
    /// Writes the trace to `path`. The file appears complete, or not at all.
    pub(crate) fn save(&self, path: &Path, head: &TraceHead) -> Result<(), BusError> {
        let draft = path.with_extension("draft");
        let head = TraceHead { ticks: self.ticks.len(), steps: self.steps.len(), ..head.clone() };
        self.write(&draft, &head).map_err(failed(&draft))?;
        std::fs::rename(&draft, path).map_err(failed(path))
    }

    fn write(&self, path: &Path, head: &TraceHead) -> io::Result<()> {
        let mut file = BufWriter::new(File::create(path)?);
        writeln!(file, "{}", serde_json::to_string(head)?)?;
        file.write_all(bytemuck::cast_slice(&self.ticks))?;
        file.write_all(bytemuck::cast_slice(&self.steps))?;
        file.flush()
    }

    /// Reads what [`Trace::save`] wrote.
    pub(crate) fn load(path: &Path) -> Result<(TraceHead, Self), BusError> {
        Self::read(path).map_err(failed(path))
    }

    fn read(path: &Path) -> io::Result<(TraceHead, Self)> {
        let bytes = std::fs::read(path)?;
        let end =
            bytes.iter().position(|byte| *byte == b'\n').ok_or_else(|| io::Error::other("not a trace"))?;
        let head: TraceHead = serde_json::from_slice(&bytes[..end])?;
        let mut rest = &bytes[end + 1..];
        let mut trace =
            Self { ticks: vec![Zeroable::zeroed(); head.ticks], steps: vec![Zeroable::zeroed(); head.steps] };
        rest.read_exact(bytemuck::cast_slice_mut(&mut trace.ticks))?;
        rest.read_exact(bytemuck::cast_slice_mut(&mut trace.steps))?;
        Ok((head, trace))
    }
}

fn failed(path: &Path) -> impl FnOnce(io::Error) -> BusError + use<> {
    let path = path.to_owned();
    move |source| BusError::File { path, source }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_trace_is_read_back_as_it_was_saved() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("trace");
        let tick = |tick| TickRecord { tick, skipped: 3, ..TickRecord::default() };
        let step = StepRecord { member: 2, sent_ns: u64::MAX, ..StepRecord::default() };
        let trace = Trace { ticks: vec![tick(7), tick(8)], steps: vec![step; 3] };
        let head = TraceHead { began_ns: 5, agent_pss_bytes: 9, ..TraceHead::default() };
        trace.save(&path, &head).unwrap();
        let (read, again) = Trace::load(&path).unwrap();
        assert_eq!(again, trace);
        assert_eq!(read, TraceHead { ticks: 2, steps: 3, ..head });
    }

    #[test]
    fn a_truncated_file_is_an_error() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("trace");
        Trace { ticks: vec![TickRecord::default()], steps: Vec::new() }
            .save(&path, &TraceHead::default())
            .unwrap();
        let whole = std::fs::read(&path).unwrap();
        for length in [0, 3, whole.len() - 1] {
            std::fs::write(&path, &whole[..length]).unwrap();
            assert!(Trace::load(&path).is_err(), "{length} bytes");
        }
    }
}
