//! The file that a log is written to: readable at any time, because every flush leaves a finished MCAP file.
//!
//! Never leaves the file without an end: one write puts the new data over the old end and appends a new end.

use mcap::{
    MAGIC,
    records::op::{DATA_END, FOOTER},
};
use std::{
    fs::File,
    io::{self, ErrorKind, Write},
    os::unix::fs::{FileExt, MetadataExt},
};

/// The end of a readable file without indexes: a `DataEnd` record and a `Footer` record whose zeros mean "no checksum"
/// and "no summary", then the magic.
const TAIL: [u8; 50] = {
    // Each record is an opcode, the length of its content in eight bytes, and the content: 4 bytes of checksum in
    // `DataEnd`; 20 bytes of summary offsets and checksum in `Footer`.
    let mut tail = [0; 50];
    tail[0] = DATA_END;
    tail[1] = 4;
    tail[13] = FOOTER;
    tail[14] = 20;
    let mut i = 0;
    while i < MAGIC.len() {
        tail[42 + i] = MAGIC[i];
        i += 1;
    }
    tail
};

/// Collects what is written and stores it in the file at each flush, never before.
#[derive(Debug)]
pub(crate) struct Sink {
    file: File,
    /// Written since the last flush.
    pending: Vec<u8>,
    /// Length of the data in the file, without the tail.
    length: u64,
    /// A write failed; the file is left alone from then on.
    broken: bool,
}

impl Sink {
    /// Writes to `file`, which must be empty.
    pub(crate) fn new(file: File) -> Self {
        Self { file, pending: Vec::new(), length: 0, broken: false }
    }

    /// Writes the pending data and the tail in one call.
    fn store(&mut self) -> io::Result<()> {
        let data = self.pending.len();
        // A finished log brings its own end, with indexes.
        if !self.pending.ends_with(MAGIC) {
            self.pending.extend_from_slice(&TAIL);
        }
        // Writing to a deleted file succeeds, and everything would be lost without an error.
        if self.file.metadata()?.nlink() == 0 {
            return Err(io::Error::new(ErrorKind::NotFound, "the file was removed"));
        }
        self.file.write_all_at(&self.pending, self.length)?;
        self.length += data as u64;
        self.pending.clear();
        Ok(())
    }

    /// Restores the tail that a failed write has overwritten.
    fn restore_tail(&mut self) {
        // Truncating frees the room that the tail needs, even on a full disk. If this fails too, nothing is left to try.
        let _ = self.file.set_len(self.length).and_then(|()| self.file.write_all_at(&TAIL, self.length));
    }
}

impl Write for Sink {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.pending.extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        // `mcap` finishes a log that is dropped. After a failed write that would write once more, over the restored
        // tail.
        if self.pending.is_empty() || self.broken {
            return Ok(());
        }
        self.store().inspect_err(|_| {
            self.broken = true;
            self.restore_tail();
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sink_in(folder: &tempfile::TempDir) -> (Sink, std::path::PathBuf) {
        let path = folder.path().join("log");
        (Sink::new(File::create(&path).unwrap()), path)
    }

    #[test]
    fn each_flush_appends_a_tail_and_the_next_flush_overwrites_it() {
        let folder = tempfile::tempdir().unwrap();
        let (mut sink, path) = sink_in(&folder);
        sink.write_all(b"one").unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"");
        sink.flush().unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), [b"one".as_slice(), &TAIL].concat());
        sink.write_all(b"two").unwrap();
        sink.flush().unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), [b"onetwo".as_slice(), &TAIL].concat());
    }

    #[test]
    fn a_finished_log_gets_no_tail() {
        let folder = tempfile::tempdir().unwrap();
        let (mut sink, path) = sink_in(&folder);
        sink.write_all(&TAIL).unwrap();
        sink.flush().unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), TAIL);
    }

    #[test]
    fn writing_to_a_removed_file_is_an_error() {
        let folder = tempfile::tempdir().unwrap();
        let (mut sink, path) = sink_in(&folder);
        std::fs::remove_file(path).unwrap();
        sink.write_all(b"one").unwrap();
        assert_eq!(sink.flush().unwrap_err().kind(), ErrorKind::NotFound);
        sink.flush().unwrap();
    }

    #[test]
    fn a_full_disk_is_reported_once() {
        let mut sink = Sink::new(std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap());
        sink.write_all(b"one").unwrap();
        assert_eq!(sink.flush().unwrap_err().kind(), ErrorKind::StorageFull);
        sink.flush().unwrap();
    }

    #[test]
    fn a_flush_that_failed_halfway_is_undone() {
        let folder = tempfile::tempdir().unwrap();
        let (mut sink, path) = sink_in(&folder);
        sink.write_all(b"one").unwrap();
        sink.flush().unwrap();
        sink.file.write_all_at(&[7; 100], sink.length).unwrap();
        sink.restore_tail();
        assert_eq!(std::fs::read(&path).unwrap(), [b"one".as_slice(), &TAIL].concat());
    }
}
