//! Atomic values in a file that several processes map: the one place that maps shared memory by hand.
//!
//! Gives no meaning to any value, and never blocks: see [`crate::futex`] for waiting.

use crate::files::allocate;
use memmap2::MmapRaw;
use std::{
    fs::{File, OpenOptions},
    io,
    ops::Index,
    path::Path,
    sync::atomic::{AtomicI64, AtomicU32},
};

/// How many [`Word`]s a line has.
const WORDS: usize = 4;
/// How many [`Number`]s a line has.
const NUMBERS: usize = 6;

/// One cache line of values.
///
/// Values that the same process reads together should share a line: each further line costs a reader another cache miss.
/// Values that different processes write often must not: each write takes the line away from everybody else.
#[repr(C, align(64))]
struct Line {
    words: [AtomicU32; WORDS],
    numbers: [AtomicI64; NUMBERS],
}

// Processes of different builds must not read different layouts out of one file.
const _: () = assert!(size_of::<Line>() == 64);

/// Names a 32-bit value on a page: the size that a futex needs.
#[derive(Debug, Clone, Copy)]
pub struct Word {
    line: usize,
    place: usize,
}

/// Names a 64-bit value on a page.
#[derive(Debug, Clone, Copy)]
pub struct Number {
    line: usize,
    place: usize,
}

impl Word {
    /// The first one on the line `line`, counted from 0.
    pub const fn on(line: usize) -> Self {
        Self { line, place: 0 }
    }

    /// The one on the same line at `place`, counted from 0.
    ///
    /// # Panics
    /// If a line has no such place.
    pub const fn beside(self, place: usize) -> Self {
        assert!(place < WORDS, "a line has no such word");
        Self { line: self.line, place }
    }
}

impl Number {
    /// The first one on the line `line`, counted from 0.
    pub const fn on(line: usize) -> Self {
        Self { line, place: 0 }
    }

    /// The one on the same line at `place`, counted from 0.
    ///
    /// # Panics
    /// If a line has no such place.
    pub const fn beside(self, place: usize) -> Self {
        assert!(place < NUMBERS, "a line has no such number");
        Self { line: self.line, place }
    }
}

/// Lines of shared atomics as one process maps them. All values are 0 until somebody writes them.
///
/// Index it by [`Word`] or [`Number`].
#[derive(Debug)]
pub struct Page(MmapRaw);

impl Page {
    /// Maps the first `lines` lines of the file `path`, which is created or made longer as needed.
    pub fn create(path: &Path, lines: usize) -> io::Result<Self> {
        // Never shorten the file: SIGBUS would kill a process that has mapped it and reads beyond the new end.
        let file = OpenOptions::new().create(true).truncate(false).read(true).write(true).open(path)?;
        let bytes = (lines * size_of::<Line>()) as u64;
        allocate(&file, bytes)?;
        Self::map(&file)
    }

    /// Maps the file `path`, which another process created with at least `lines` lines.
    pub fn open(path: &Path, lines: usize) -> io::Result<Self> {
        let page = Self::map(&OpenOptions::new().read(true).write(true).open(path)?)?;
        // Check once here: a value beyond the end would panic only when somebody first uses it.
        if page.lines().len() < lines {
            return Err(io::Error::other("too short for its purpose; it belongs to another version"));
        }
        Ok(page)
    }

    fn map(file: &File) -> io::Result<Self> {
        Ok(Self(MmapRaw::map_raw(file)?))
    }

    #[expect(unsafe_code, reason = "the one view of shared memory that iceoryx2 does not manage")]
    #[expect(clippy::cast_ptr_alignment, reason = "a mapping begins on a memory page")]
    fn lines(&self) -> &[Line] {
        let count = self.0.len() / size_of::<Line>();
        // SAFETY: the mapping holds `count` whole lines, is page-aligned, and lives as long as `self`. It is only ever
        // accessed as these atomics, by this process and by the others, and any bytes are valid atomics. The files are
        // never made shorter, so every line keeps its memory.
        unsafe { std::slice::from_raw_parts(self.0.as_ptr().cast::<Line>(), count) }
    }
}

impl Index<Word> for Page {
    type Output = AtomicU32;

    fn index(&self, Word { line, place }: Word) -> &AtomicU32 {
        &self.lines()[line].words[place]
    }
}

impl Index<Number> for Page {
    type Output = AtomicI64;

    fn index(&self, Number { line, place }: Number) -> &AtomicI64 {
        &self.lines()[line].numbers[place]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::Ordering::SeqCst;

    #[test]
    fn two_mappings_of_one_file_share_their_values() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("page");
        let one = Page::create(&path, 3).unwrap();
        one[Word::on(2)].store(7, SeqCst);
        one[Number::on(2)].store(-1, SeqCst);
        one[Word::on(2).beside(1)].store(8, SeqCst);
        one[Number::on(2).beside(5)].store(9, SeqCst);
        for other in [Page::open(&path, 3).unwrap(), Page::create(&path, 3).unwrap()] {
            assert_eq!((other[Word::on(2)].load(SeqCst), other[Number::on(2)].load(SeqCst)), (7, -1));
            assert_eq!(
                (other[Word::on(2).beside(1)].load(SeqCst), other[Number::on(2).beside(5)].load(SeqCst)),
                (8, 9)
            );
            assert_eq!((other[Word::on(1)].load(SeqCst), other[Number::on(1)].load(SeqCst)), (0, 0));
        }
    }

    #[test]
    fn a_file_that_is_too_short_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("page");
        std::fs::write(&path, [0; 64]).unwrap();
        let error = Page::open(&path, 2).unwrap_err();
        assert!(error.to_string().contains("another version"), "{error}");
        assert!(Page::open(&path, 1).is_ok());
    }
}
