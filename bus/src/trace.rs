//! Every stamp of every tick that was measured, as numbers in memory and as a file: what latencies are computed from.
//!
//! Never computes one itself, and never leaves a tick out.

use crate::{BusError, usage::Used};
use bytemuck::{Pod, Zeroable};
use serde::{Deserialize, Serialize};
use std::{
    fs::File,
    io::{self, BufWriter, Read, Write},
    path::Path,
};

/// A tick as the one who opened it saw it. All times are `CLOCK_MONOTONIC` in nanoseconds.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct TickRecord {
    /// Which tick.
    pub tick: i64,
    /// When it should have begun: its deadline where ticks are paced, else `opened_ns`.
    pub intended_ns: u64,
    /// When it began.
    pub opened_ns: u64,
    /// When all that it needs was sent.
    pub published_ns: u64,
    /// When its answers were looked for.
    pub looked_ns: u64,
    /// When they were fetched.
    pub collected_ns: u64,
    /// Ticks that should have begun before this one, after `intended_ns`, and never did.
    pub skipped: u32,
    /// Airframes that flew on an older command.
    pub reused: u32,
}

/// An agent's part in a tick.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct StepRecord {
    /// Which tick.
    pub tick: i64,
    /// It saw the tick.
    pub woke_ns: u64,
    /// It had read its inputs.
    pub read_ns: u64,
    /// It handed its answer over.
    pub sent_ns: u64,
    /// The one who opened the tick had the answer; 0 where that is not known.
    pub seen_ns: u64,
    /// How long handing over took it in the tick before.
    pub sending_ns: u64,
    /// Whose part, from 0.
    pub member: u32,
    /// Zero; keeps the layout free of padding.
    pub reserved: u32,
}

/// What was measured.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Trace {
    /// In order.
    pub ticks: Vec<TickRecord>,
    /// In the order of their fetching.
    pub steps: Vec<StepRecord>,
}

/// How much was measured, and what it took; the first line of a trace's file, in JSON.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct TraceHead {
    /// Ticks in the trace.
    pub ticks: usize,
    /// Steps in the trace.
    pub steps: usize,
    /// When the warm-up was over, in nanoseconds of `CLOCK_MONOTONIC`.
    pub began_ns: u64,
    /// When the measured time was over.
    pub ended_ns: u64,
    /// What all processes used in between.
    pub used: Used,
    /// Proportional set size of an agent, the largest of them; 0 where it is not readable.
    pub agent_pss_bytes: u64,
}

impl Trace {
    /// Writes it to the file `path`, whole or not at all.
    pub fn save(&self, path: &Path, head: &TraceHead) -> Result<(), BusError> {
        let draft = path.with_extension("draft");
        let head = TraceHead { ticks: self.ticks.len(), steps: self.steps.len(), ..head.clone() };
        self.write(&draft, &head).map_err(BusError::file(&draft))?;
        std::fs::rename(&draft, path).map_err(BusError::file(path))
    }

    fn write(&self, path: &Path, head: &TraceHead) -> io::Result<()> {
        let mut file = BufWriter::new(File::create(path)?);
        writeln!(file, "{}", serde_json::to_string(head)?)?;
        file.write_all(bytemuck::cast_slice(&self.ticks))?;
        file.write_all(bytemuck::cast_slice(&self.steps))?;
        file.flush()
    }

    /// Reads what [`Trace::save`] wrote.
    pub fn load(path: &Path) -> Result<(TraceHead, Self), BusError> {
        Self::read(path).map_err(BusError::file(path))
    }

    fn read(path: &Path) -> io::Result<(TraceHead, Self)> {
        let bytes = std::fs::read(path)?;
        let end = bytes.iter().position(|byte| *byte == b'\n').ok_or_else(|| io::Error::other("no trace"))?;
        let head: TraceHead = serde_json::from_slice(&bytes[..end])?;
        let mut rest = &bytes[end + 1..];
        let mut trace =
            Self { ticks: vec![Zeroable::zeroed(); head.ticks], steps: vec![Zeroable::zeroed(); head.steps] };
        rest.read_exact(bytemuck::cast_slice_mut(&mut trace.ticks))?;
        rest.read_exact(bytemuck::cast_slice_mut(&mut trace.steps))?;
        Ok((head, trace))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_trace_comes_back_as_it_was_saved() {
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
    fn a_file_that_breaks_off_is_an_error() {
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
