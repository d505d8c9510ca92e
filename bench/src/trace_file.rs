//! A trace as a file: how a case hands its timestamps to the benchmark.
//!
//! Only processes of the same build exchange traces, so records are stored as they are in memory. Must never be kept
//! for another build to read.

use crate::trace::{Trace, TraceHead};
use bytemuck::Zeroable;
use ringwing_bus::{BusError, write_whole_by};
use std::{
    fs::File,
    io::{self, BufWriter, Read, Write},
    path::Path,
};

impl Trace {
    /// Writes the trace to `path`. The file appears complete, or not at all.
    pub(crate) fn save(&self, path: &Path, head: &TraceHead) -> Result<(), BusError> {
        let head = TraceHead { ticks: self.ticks.len(), steps: self.steps.len(), ..head.clone() };
        write_whole_by(path, |draft| self.write(draft, &head)).map_err(failed(path))
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
        // The head is JSON in one line: the first line break ends it, whatever bytes the records hold.
        let end =
            bytes.iter().position(|byte| *byte == b'\n').ok_or_else(|| io::Error::other("not a trace"))?;
        let head: TraceHead = serde_json::from_slice(&bytes[..end])?;
        let mut rest = &bytes[end + 1..];
        // Copy the bytes into records: at their place in the file they need not be aligned.
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
    use crate::trace::{StepRecord, TickRecord};

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
