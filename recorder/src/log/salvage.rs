//! Reads every intact record of a log, whatever happened to the file.
//!
//! Never fails, never panics and never trusts a length. A cut or damaged record is skipped and reported, and reading
//! resumes at the next record that can be recognised. `mcap`'s own parser is not used, because it allocates what some
//! lengths claim.

mod chunk;
mod fields;
mod resume;
mod summary;

use chunk::Chunk;
use fields::Fields;
use mcap::{
    MAGIC,
    records::{Record, op},
};
use resume::Landmarks;
use std::{
    collections::{BTreeSet, VecDeque},
    io::{self, Read, Seek, SeekFrom},
};

/// Longest record that is believed, in bytes. ringwing's chunks hold about 1 MiB, but other writers may be told to put a
/// whole flight into one. A larger limit would let one wrong length allocate that much memory.
const LONGEST_RECORD: u64 = 256 << 20;
/// Opcode (1 byte) and length (8 bytes) that precede every record, by the MCAP specification.
const HEAD_BYTES: u64 = 9;
/// Damages listed one by one. Beyond this only their number and bytes are counted, so that a file of noise cannot
/// fill the memory with reports.
const LISTED_DAMAGES: usize = 100;
/// Bytes examined at once when searching for the next record. Smaller reads cost more system calls, larger ones only
/// memory.
const SEARCH_BYTES: usize = 1 << 16;
/// Bytes that are searched for the next record. A longer search would take hours in a file that is mostly a hole; a
/// shorter one could give up within the damage of a log that is worth reading.
const LONGEST_SEARCH: u64 = 1 << 30;

/// A part of the file that could not be read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LogDamage {
    /// Its first byte, counted from the beginning of the file.
    pub offset: u64,
    /// Its length in bytes; 0 if only a record within an otherwise readable chunk is damaged.
    pub bytes: u64,
    /// What is wrong there, for people.
    pub problem: String,
}

/// Everything that could not be read.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct LogDamages {
    /// The first 100 damages, in the order of the file.
    pub listed: Vec<LogDamage>,
    /// Number of all damages, listed or not.
    pub count: u64,
    /// Bytes of all damages, listed or not.
    pub bytes: u64,
}

impl LogDamages {
    pub(super) fn add(&mut self, offset: u64, bytes: u64, problem: impl Into<String>) {
        self.count += 1;
        self.bytes += bytes;
        if self.listed.len() < LISTED_DAMAGES {
            self.listed.push(LogDamage { offset, bytes, problem: problem.into() });
        }
    }
}

/// Iterates over the readable records of a log in the order of the file: header, schemas, channels, messages,
/// attachments and metadata.
///
/// Chunks are unpacked on the way. Indexes and other records without content of their own are left out.
pub(crate) struct Salvage<R> {
    source: R,
    /// Length of the source in bytes.
    length: u64,
    /// Where the next record outside the chunks begins.
    offset: u64,
    /// The chunk whose records are being handed out.
    chunk: Chunk,
    /// A chunk was found, so messages outside the chunks are rare.
    has_chunks: bool,
    /// Numbers of the channels found so far.
    channels: BTreeSet<u16>,
    /// Body of the current record.
    body: Vec<u8>,
    /// Checksum of everything read so far; meaningful only while nothing was skipped.
    checksum: crc32fast::Hasher,
    /// The checksum before the current record: what the end of the data section states.
    checksum_before: crc32fast::Hasher,
    damages: LogDamages,
    /// Schemas and channels from the summary, fetched at the first damage and handed out next.
    repeated: Option<VecDeque<Record<'static>>>,
    /// The end of the data section was found.
    has_ended: bool,
    /// Nothing is left to read outside the current chunk.
    is_exhausted: bool,
}

/// Opcode and length of a record.
#[derive(Clone, Copy)]
struct RecordHead {
    opcode: u8,
    length: u64,
}

impl<R: Read + Seek> Salvage<R> {
    /// Reads `source` from its beginning.
    pub(crate) fn new(mut source: R) -> Self {
        let length = source.seek(SeekFrom::End(0)).unwrap_or(0);
        let mut salvage = Self {
            source,
            length,
            offset: 0,
            chunk: Chunk::default(),
            has_chunks: false,
            channels: BTreeSet::new(),
            body: Vec::new(),
            checksum: crc32fast::Hasher::new(),
            checksum_before: crc32fast::Hasher::new(),
            damages: LogDamages::default(),
            repeated: None,
            has_ended: false,
            is_exhausted: false,
        };
        if !salvage.begins_with_magic() {
            salvage.begin_after_damage();
        }
        salvage
    }

    /// Reads the same source again from its beginning.
    pub(crate) fn again(self) -> Self {
        Self::new(self.source)
    }

    /// What could not be read so far.
    pub(crate) fn damages(&self) -> &LogDamages {
        &self.damages
    }

    /// Whether the end of the data section was found; it is missing if the log was cut.
    pub(crate) fn has_ended(&self) -> bool {
        self.has_ended
    }

    fn begins_with_magic(&mut self) -> bool {
        self.offset = MAGIC.len() as u64;
        self.source.rewind().is_ok() && self.read_body(self.offset).is_ok() && self.body == MAGIC
    }

    /// Begins at the first record that can be recognised, in a file whose first bytes are not those of a log.
    fn begin_after_damage(&mut self) {
        // A log without chunks names its channels at its beginning, and a message is recognised by its channel.
        self.fetch_summary();
        self.channels.extend(self.repeated.iter().flatten().filter_map(|record| match record {
            Record::Channel(channel) => Some(channel.id),
            _ => None,
        }));
        let Some(first) = self.find_record(0) else {
            // Not a log, and not a part of one. The caller has a clearer message for that.
            self.is_exhausted = true;
            return;
        };
        self.damages.add(0, first, "the first bytes are not those of an MCAP file");
        self.offset = first;
        self.is_exhausted = self.source.seek(SeekFrom::Start(first)).is_err();
    }

    /// Reads the next `bytes` of the source into the body.
    fn read_body(&mut self, bytes: u64) -> io::Result<()> {
        self.body.clear();
        // `read_to_end` allocates for the bytes that exist, not for the number that a damaged length claims.
        let read = self.source.by_ref().take(bytes).read_to_end(&mut self.body)?;
        self.checksum.update(&self.body);
        if read as u64 == bytes { Ok(()) } else { Err(io::ErrorKind::UnexpectedEof.into()) }
    }

    /// Reads the next record outside the chunks and always advances; `None` if it holds no content or is damaged.
    fn next_outside(&mut self) -> Option<Record<'static>> {
        let begin = self.offset;
        // Without a plausible head, nothing tells where the next record begins: search for one.
        let Some(head) = self.read_head() else {
            self.skip_to_next_record(begin);
            return None;
        };
        self.offset = begin + HEAD_BYTES + head.length;
        // The record fits into the file, so this is an error of the disk. The next record may be readable all the same.
        if let Err(error) = self.read_body(head.length) {
            self.damages.add(begin, self.offset - begin, format!("cannot be read: {error}"));
            self.is_exhausted = self.source.seek(SeekFrom::Start(self.offset)).is_err();
            return None;
        }
        match head.opcode {
            op::CHUNK => {
                self.has_chunks = true;
                self.open_chunk(begin);
                None
            }
            op::MESSAGE if self.has_chunks && !self.is_certain_message() => {
                self.damages.add(begin, self.offset - begin, "a message that may be a damaged index");
                None
            }
            op::DATA_END => {
                self.end(begin);
                None
            }
            opcode => self.parse(begin, opcode),
        }
    }

    /// Whether the current record, a message between chunks, can be nothing else.
    ///
    /// One flipped bit turns a message index into a message, and no checksum covers records outside chunks.
    fn is_certain_message(&self) -> bool {
        let mut fields = Fields::new(&self.body);
        let channel = fields.u16();
        // Where a message has its times, an index has a time and an offset in its chunk.
        let (_sequence, _log_time, offset) = (fields.u32(), fields.u64(), fields.u64());
        let could_be_index = matches!(fields::record(op::MESSAGE_INDEX, &self.body), Ok(None))
            && offset.is_none_or(|offset| offset < LONGEST_RECORD);
        !could_be_index && channel.is_some_and(|channel| self.channels.contains(&channel))
    }

    /// Opcode and length at the current offset, if both are plausible.
    fn read_head(&mut self) -> Option<RecordHead> {
        self.checksum_before = self.checksum.clone();
        if let Err(error) = self.read_body(HEAD_BYTES) {
            if error.kind() != io::ErrorKind::UnexpectedEof {
                self.damages.add(self.offset, 0, format!("cannot be read: {error}"));
            }
            return None;
        }
        let mut fields = Fields::new(&self.body);
        let head = RecordHead { opcode: fields.u8()?, length: fields.u64()? };
        let left = self.length.saturating_sub(self.offset + HEAD_BYTES);
        (resume::is_opcode(head.opcode) && head.length <= left.min(LONGEST_RECORD)).then_some(head)
    }

    fn open_chunk(&mut self, begin: u64) {
        if !Chunk::has_consistent_lengths(&self.body) {
            // The record's own length may be wrong, so the next record may begin elsewhere.
            return self.skip_to_next_record(begin);
        }
        match Chunk::decompress(&self.body, LONGEST_RECORD) {
            Ok(chunk) => self.chunk = chunk,
            Err(problem) => {
                self.damages.add(begin, self.offset - begin, problem);
                self.fetch_summary();
            }
        }
    }

    /// Fetches schemas and channels from the summary, in case the lost chunk held them.
    fn fetch_summary(&mut self) {
        if self.repeated.is_none() {
            self.repeated = Some(summary::repeated(&mut self.source, self.length).unwrap_or_default());
            // The summary lies at the end of the file, so go back to the current record.
            self.is_exhausted = self.source.seek(SeekFrom::Start(self.offset)).is_err();
        }
    }

    /// Ends the data section and compares its checksum with that of everything read.
    fn end(&mut self, begin: u64) {
        let Some(stated) = Fields::new(&self.body).u32().filter(|_| self.body.len() == 4) else {
            self.damages.add(begin, self.offset - begin, "an incomplete end of the data section");
            return;
        };
        self.has_ended = true;
        let found = self.checksum_before.clone().finalize();
        // 0 means that the writer stated no checksum. After a damage the mismatch is already explained.
        if stated != 0 && stated != found && self.damages.count == 0 {
            let problem =
                "the checksum of the data section does not match: something outside the chunks changed";
            self.damages.add(0, 0, problem);
        }
        self.pass_summary();
    }

    /// Passes the summary, which holds nothing of its own, and looks for what does not belong to the log.
    fn pass_summary(&mut self) {
        self.is_exhausted = true;
        while let Some(head) = self.read_head() {
            self.offset += HEAD_BYTES + head.length;
            if self.source.seek(SeekFrom::Start(self.offset)).is_err() {
                return;
            }
            if head.opcode == op::FOOTER {
                let end = self.offset + MAGIC.len() as u64;
                // Nothing of the flight is lost if the footer is cut.
                if end < self.length {
                    let problem = "more bytes after the end of the log, as if another file was appended";
                    self.damages.add(end, self.length - end, problem);
                }
                return;
            }
        }
    }

    fn parse(&mut self, begin: u64, opcode: u8) -> Option<Record<'static>> {
        fields::record(opcode, &self.body).unwrap_or_else(|_| {
            // The record's own length may be wrong, so the next record may begin elsewhere.
            self.skip_to_next_record(begin);
            None
        })
    }

    /// Resumes at the first record after `begin` that can be recognised, or ends if there is no such record.
    fn skip_to_next_record(&mut self, begin: u64) {
        let next = self.find_record(begin + 1).unwrap_or(self.length);
        self.offset = next;
        self.is_exhausted = next >= self.length || self.source.seek(SeekFrom::Start(next)).is_err();
        let problem = if self.is_exhausted { "cut off, or damaged up to the end" } else { "damaged" };
        self.damages.add(begin, next - begin, problem);
        if !self.is_exhausted {
            self.fetch_summary();
        }
    }

    /// Offset of the first record at or after `from` that can be recognised.
    fn find_record(&mut self, from: u64) -> Option<u64> {
        let landmarks = Landmarks { channels: &self.channels, has_chunks: self.has_chunks };
        let end = self.length.min(from.saturating_add(LONGEST_SEARCH));
        let mut window = Vec::new();
        let mut start = from;
        while start < end {
            self.source.seek(SeekFrom::Start(start)).ok()?;
            window.clear();
            // Windows overlap by the head of a record, so that one across their border is found too.
            let size = (SEARCH_BYTES + resume::HEAD_BYTES) as u64;
            if let Err(error) = self.source.by_ref().take(size).read_to_end(&mut window) {
                self.damages.add(start, 0, format!("cannot be read: {error}"));
                return None;
            }
            let starts = 0..window.len().min(SEARCH_BYTES);
            let left = |at: usize| self.length - start - at as u64;
            let found = starts
                .into_iter()
                .find(|at| landmarks.is_record(window.get(*at..).unwrap_or(&[]), left(*at)));
            if let Some(at) = found {
                return Some(start + at as u64);
            }
            start += SEARCH_BYTES as u64;
        }
        None
    }

    /// Reads the next record of the current chunk; `None` if it holds no content or is damaged.
    fn next_inside(&mut self) -> Option<Record<'static>> {
        let Some((opcode, body)) = self.chunk.next_record() else {
            self.damages.add(self.offset, 0, "the chunk before this breaks off within a record");
            // Give up the rest of the chunk: records have lengths but no marks to search for.
            self.chunk = Chunk::default();
            return None;
        };
        match fields::record(opcode, body) {
            Ok(record) => record,
            Err(problem) => {
                self.damages.add(self.offset, 0, format!("in the chunk before this: {problem}"));
                None
            }
        }
    }
}

impl<R: Read + Seek> Iterator for Salvage<R> {
    type Item = Record<'static>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            // What the summary repeats comes before the messages that need it.
            let repeated = self.repeated.as_mut().and_then(VecDeque::pop_front);
            let record = if repeated.is_some() {
                repeated
            } else if !self.chunk.is_empty() {
                self.next_inside()
            } else if self.is_exhausted {
                return None;
            } else if self.offset >= self.length {
                // A file that was cut between two records ends here. Nothing is damaged; `has_ended` tells that the
                // end is missing.
                self.is_exhausted = true;
                None
            } else {
                self.next_outside()
            };
            if let Some(Record::Channel(channel)) = &record {
                self.channels.insert(channel.id);
            }
            if record.is_some() {
                return record;
            }
        }
    }
}

#[cfg(test)]
mod tests;
