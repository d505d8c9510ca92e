//! The file under the log, which opens at any time: after each flush it ends as a finished MCAP file does.
//!
//! Never leaves the end off: the next flush writes its data over the old end, with a new end, in one go.

use mcap::{
    MAGIC,
    records::op::{DATA_END, FOOTER},
};
use std::{
    fs::File,
    io::{self, ErrorKind, Write},
    os::unix::fs::{FileExt, MetadataExt},
};

/// What makes a file without an index a readable one: a `DataEnd` and a `Footer` that promise nothing (no checksum, no
/// summary), then the magic.
const TAIL: [u8; 50] = {
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

/// A file that takes what is written to it at each flush, and no sooner.
#[derive(Debug)]
pub(crate) struct Sink {
    file: File,
    /// Written since the last flush.
    pending: Vec<u8>,
    /// Length of the data in the file, without their tail.
    length: u64,
    /// A write failed: the file stays as it could be left then.
    broken: bool,
}

impl Sink {
    /// Writes to `file`, which is empty.
    pub(crate) fn new(file: File) -> Self {
        Self { file, pending: Vec::new(), length: 0, broken: false }
    }

    /// Puts data and tail into the file; a log that its writer has finished needs no tail.
    fn store(&mut self) -> io::Result<()> {
        let data = self.pending.len();
        if !self.pending.ends_with(MAGIC) {
            self.pending.extend_from_slice(&TAIL);
        }
        if self.file.metadata()?.nlink() == 0 {
            return Err(io::Error::new(ErrorKind::NotFound, "the file was removed"));
        }
        self.file.write_all_at(&self.pending, self.length)?;
        self.length += data as u64;
        self.pending.clear();
        Ok(())
    }

    /// Brings back the end that a failed write has overwritten.
    fn mend(&mut self) {
        // What room there was for the old tail is free again; if even this fails, nothing is left to try.
        let _ = self.file.set_len(self.length).and_then(|()| self.file.write_all_at(&TAIL, self.length));
    }
}

impl Write for Sink {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.pending.extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        if self.pending.is_empty() || self.broken {
            return Ok(());
        }
        self.store().inspect_err(|_| {
            self.broken = true;
            self.mend();
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
    fn every_flush_ends_with_a_tail_and_the_next_one_takes_its_place() {
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
    fn a_removed_file_is_an_error_and_not_a_silent_loss() {
        let folder = tempfile::tempdir().unwrap();
        let (mut sink, path) = sink_in(&folder);
        std::fs::remove_file(path).unwrap();
        sink.write_all(b"one").unwrap();
        assert_eq!(sink.flush().unwrap_err().kind(), ErrorKind::NotFound);
        sink.flush().unwrap();
    }

    #[test]
    fn a_full_disk_is_said_once() {
        let mut sink = Sink::new(std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap());
        sink.write_all(b"one").unwrap();
        assert_eq!(sink.flush().unwrap_err().kind(), ErrorKind::StorageFull);
        sink.flush().unwrap();
    }

    #[test]
    fn a_half_written_flush_is_taken_back() {
        let folder = tempfile::tempdir().unwrap();
        let (mut sink, path) = sink_in(&folder);
        sink.write_all(b"one").unwrap();
        sink.flush().unwrap();
        sink.file.write_all_at(&[7; 100], sink.length).unwrap();
        sink.mend();
        assert_eq!(std::fs::read(&path).unwrap(), [b"one".as_slice(), &TAIL].concat());
    }
}
