//! The timestamps of a process: a record of a tick and three times for every tick.
//!
//! Must never write before the run is over: that would be measured.

use std::{fs, io, path::Path};

/// Records that memory is reserved for. After more, a tick may wait for the trace to be copied.
const RESERVED: usize = 1 << 20;

/// All records of a process.
#[derive(Debug)]
pub(crate) struct Trace(Vec<[u64; 4]>);

impl Default for Trace {
    fn default() -> Self {
        Self(Vec::with_capacity(RESERVED))
    }
}

impl Trace {
    pub(crate) fn push(&mut self, tick: i64, [first, second, third]: [u64; 3]) {
        self.0.push([tick.cast_unsigned(), first, second, third]);
    }

    pub(crate) fn save(&self, path: &Path) -> io::Result<()> {
        let bytes: Vec<u8> = self.0.iter().flatten().flat_map(|word| word.to_le_bytes()).collect();
        fs::write(path, bytes)
    }
}
