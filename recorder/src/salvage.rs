//! What can still be read of a log, whatever happened to it.
//!
//! Never fails, never panics, and never trusts a length: a record that is cut or damaged is left out and noted, and
//! reading goes on at the next one that is sound. `mcap`'s own parser is not used: it trusts some lengths.

mod chunk;
mod fields;
mod summary;

use chunk::Plain;
use fields::Fields;
use mcap::{
    MAGIC,
    records::{Record, op},
};
use std::{
    collections::VecDeque,
    io::{self, Read, Seek, SeekFrom},
};

/// No record of ours comes near this; a longer one is damage.
const LONGEST_RECORD: u64 = 64 << 20;
/// Opcode and length.
const FRAME_BYTES: u64 = 9;
/// Damages that are told one by one; of more, only the bytes are counted.
const TOLD_DAMAGES: usize = 100;
/// How much of the file a search for the next sound chunk looks at in one go.
const SEARCH_BYTES: usize = 1 << 16;

/// A part of the file that could not be read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Damage {
    /// Where it begins.
    pub offset: u64,
    /// How long it is.
    pub bytes: u64,
    /// What is wrong there.
    pub what: String,
}

/// All that could not be read.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Damages {
    /// The first of them.
    pub told: Vec<Damage>,
    /// How many there are.
    pub count: u64,
    /// Their length in all.
    pub bytes: u64,
}

impl Damages {
    fn note(&mut self, offset: u64, bytes: u64, what: impl Into<String>) {
        self.count += 1;
        self.bytes += bytes;
        if self.told.len() < TOLD_DAMAGES {
            self.told.push(Damage { offset, bytes, what: what.into() });
        }
    }
}

/// The readable records of the data section that hold content, in order: header, schemas, channels, messages,
/// attachments and metadata.
pub(crate) struct Salvage<R> {
    source: R,
    /// Length of the source.
    length: u64,
    /// Where the next record begins.
    offset: u64,
    /// The chunk that is being read.
    chunk: Plain,
    /// There was a chunk: this log's messages are in chunks.
    chunked: bool,
    body: Vec<u8>,
    /// Of everything so far, as long as it was read without a gap.
    checksum: crc32fast::Hasher,
    /// The same before the last record.
    checksum_before: crc32fast::Hasher,
    damages: Damages,
    /// What the summary repeats of schemas and channels, asked for at the first damage.
    repeated: Option<VecDeque<Record<'static>>>,
    /// The data section came to its end.
    ended: bool,
    over: bool,
}

/// Opcode and length of a record.
#[derive(Clone, Copy)]
struct Frame {
    opcode: u8,
    length: u64,
}

impl<R: Read + Seek> Salvage<R> {
    /// Reads from `source`, from its beginning.
    pub(crate) fn new(mut source: R) -> Self {
        let length = source.seek(SeekFrom::End(0)).unwrap_or(0);
        let mut salvage = Self {
            source,
            length,
            offset: 0,
            chunk: Plain::default(),
            chunked: false,
            body: Vec::new(),
            checksum: crc32fast::Hasher::new(),
            checksum_before: crc32fast::Hasher::new(),
            damages: Damages::default(),
            repeated: None,
            ended: false,
            over: false,
        };
        salvage.over = !salvage.begins_as_mcap();
        salvage
    }

    /// What could not be read so far.
    pub(crate) fn damages(&self) -> &Damages {
        &self.damages
    }

    /// Whether the data section came to its end; a log that was cut does not.
    pub(crate) fn ended(&self) -> bool {
        self.ended
    }

    fn begins_as_mcap(&mut self) -> bool {
        self.offset = MAGIC.len() as u64;
        self.source.rewind().is_ok() && self.fill(self.offset).is_ok() && self.body == MAGIC
    }

    /// Reads `bytes` into the body.
    fn fill(&mut self, bytes: u64) -> io::Result<()> {
        self.body.clear();
        // Grows with what is there, not with what is promised.
        let got = self.source.by_ref().take(bytes).read_to_end(&mut self.body)?;
        self.checksum.update(&self.body);
        if got as u64 == bytes { Ok(()) } else { Err(io::ErrorKind::UnexpectedEof.into()) }
    }

    /// The next record outside chunks, or none if it is damaged; moves on in any case.
    fn next_outside(&mut self) -> Option<Record<'static>> {
        let begin = self.offset;
        let Some(frame) = self.frame() else {
            self.find_next_chunk(begin);
            return None;
        };
        if let Err(error) = self.fill(frame.length) {
            self.damages.note(begin, self.length - begin, format!("cannot be read: {error}"));
            self.over = true;
            return None;
        }
        self.offset = begin + FRAME_BYTES + frame.length;
        match frame.opcode {
            op::CHUNK => {
                self.chunked = true;
                self.open_chunk(begin);
                None
            }
            op::MESSAGE if self.chunked => {
                // One bit makes it of a message index, and out here no checksum tells.
                self.damages.note(begin, self.offset - begin, "a message outside the chunks");
                None
            }
            op::DATA_END => {
                self.end(begin);
                None
            }
            opcode => self.parse(begin, opcode),
        }
    }

    /// Opcode and length at the offset, if they can be true.
    fn frame(&mut self) -> Option<Frame> {
        self.checksum_before = self.checksum.clone();
        self.fill(FRAME_BYTES).ok()?;
        let mut fields = Fields::new(&self.body);
        let frame = Frame { opcode: fields.u8()?, length: fields.u64()? };
        let left = self.length.saturating_sub(self.offset + FRAME_BYTES);
        let is_known = (op::HEADER..=op::DATA_END).contains(&frame.opcode) || frame.opcode >= 0x80;
        (is_known && frame.length <= left.min(LONGEST_RECORD)).then_some(frame)
    }

    fn open_chunk(&mut self, begin: u64) {
        if !Plain::lengths_agree(&self.body) {
            // The record's own length may be what is wrong.
            return self.find_next_chunk(begin);
        }
        match Plain::of(&self.body, LONGEST_RECORD) {
            Ok(chunk) => self.chunk = chunk,
            Err(what) => {
                self.damages.note(begin, self.offset - begin, what);
                self.ask_summary();
            }
        }
    }

    /// Reads schemas and channels from the summary, in case the lost chunk held them.
    fn ask_summary(&mut self) {
        if self.repeated.is_none() {
            self.repeated = Some(summary::repeated(&mut self.source, self.length).unwrap_or_default());
            self.over |= self.source.seek(SeekFrom::Start(self.offset)).is_err();
        }
    }

    fn end(&mut self, begin: u64) {
        let Some(stated) = Fields::new(&self.body).u32().filter(|_| self.body.len() == 4) else {
            self.damages.note(begin, self.offset - begin, "not a whole end of the data");
            return;
        };
        (self.ended, self.over) = (true, true);
        let found = self.checksum_before.clone().finalize();
        if stated != 0 && stated != found && self.damages.count == 0 {
            self.damages.note(
                0,
                0,
                "the checksum of the whole is wrong: something outside the chunks changed",
            );
        }
    }

    fn parse(&mut self, begin: u64, opcode: u8) -> Option<Record<'static>> {
        fields::record(opcode, &self.body).unwrap_or_else(|_| {
            // Its length may be what is wrong.
            self.find_next_chunk(begin);
            None
        })
    }

    /// Goes on at the next chunk after `begin` whose lengths agree, or ends.
    fn find_next_chunk(&mut self, begin: u64) {
        let next = self.search(begin + 1).unwrap_or(self.length);
        self.offset = next;
        self.over = next >= self.length || self.source.seek(SeekFrom::Start(next)).is_err();
        if next > begin {
            let what = if self.over { "cut off, or damaged to the end" } else { "damaged" };
            self.damages.note(begin, next - begin, what);
        }
        if !self.over {
            self.ask_summary();
        }
    }

    fn search(&mut self, from: u64) -> Option<u64> {
        let mut window = Vec::new();
        let mut start = from;
        while start < self.length {
            self.source.seek(SeekFrom::Start(start)).ok()?;
            window.clear();
            let size = (SEARCH_BYTES + chunk::HEAD_BYTES) as u64;
            self.source.by_ref().take(size).read_to_end(&mut window).ok()?;
            let starts = 0..window.len().min(SEARCH_BYTES);
            let left = |at: usize| self.length - start - at as u64;
            if let Some(at) = starts.into_iter().find(|at| chunk::begins(&window[*at..], left(*at))) {
                return Some(start + at as u64);
            }
            start += SEARCH_BYTES as u64;
        }
        None
    }

    /// The next record of the chunk, or none at its end or damage.
    fn next_inside(&mut self) -> Option<Record<'static>> {
        let Some((opcode, body)) = self.chunk.next_record() else {
            self.damages.note(self.offset, 0, "the chunk before this breaks off within a record");
            self.chunk = Plain::default();
            return None;
        };
        match fields::record(opcode, body) {
            Ok(record) => record,
            Err(what) => {
                self.damages.note(self.offset, 0, format!("in the chunk before this: {what}"));
                None
            }
        }
    }
}

impl<R: Read + Seek> Iterator for Salvage<R> {
    type Item = Record<'static>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            let repeated = self.repeated.as_mut().and_then(VecDeque::pop_front);
            let record = if repeated.is_some() {
                repeated
            } else if !self.chunk.is_over() {
                self.next_inside()
            } else if self.over {
                return None;
            } else if self.offset >= self.length {
                self.over = true;
                None
            } else {
                self.next_outside()
            };
            if record.is_some() {
                return record;
            }
        }
    }
}

#[cfg(test)]
mod tests;
