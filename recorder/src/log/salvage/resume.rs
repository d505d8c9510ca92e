//! Recognises records in a damaged file, where no length leads from one to the next.
//!
//! Opcodes are single bytes and appear everywhere, so a record counts only if its lengths agree with each other. Never
//! decodes a record: the caller checks it once more when it reads it.

use super::{HEAD_BYTES as RECORD_HEAD_BYTES, LONGEST_RECORD, fields::Fields};
use mcap::records::op;
use std::collections::BTreeSet;

/// Most bytes of a record that are needed to recognise it: its head, fixed fields, and names of up to 400 bytes. A
/// smaller value would miss records at the border of a search window.
pub(super) const HEAD_BYTES: usize = 512;

/// Content of a message record before its data: channel, sequence and two times.
const MESSAGE_BYTES: u64 = 22;

/// What is known of a log when a search begins.
pub(super) struct Landmarks<'a> {
    /// Numbers of the channels found so far.
    pub(super) channels: &'a BTreeSet<u16>,
    /// Whether the log keeps its messages in chunks.
    pub(super) has_chunks: bool,
}

/// Whether records of this kind exist. Opcodes from 0x80 are reserved for private records.
pub(super) fn is_opcode(opcode: u8) -> bool {
    (op::HEADER..=op::DATA_END).contains(&opcode) || opcode >= 0x80
}

impl Landmarks<'_> {
    /// Whether a record to resume at begins at the start of `window`, `left` bytes before the end of the file.
    pub(super) fn is_record(&self, window: &[u8], left: u64) -> bool {
        // The search calls this for every byte, so test the opcode before anything else.
        let expected = match window.first() {
            Some(&op::CHUNK) => chunk_length(window),
            Some(&op::ATTACHMENT) => attachment_length(window),
            Some(&op::METADATA) => metadata_length(window),
            Some(&op::MESSAGE) if !self.has_chunks => return self.is_message(window, left),
            _ => return false,
        };
        let stated = Fields::new(window).head().map(|(_opcode, length)| length);
        stated.is_some()
            && stated == expected
            && stated
                .and_then(|length| length.checked_add(RECORD_HEAD_BYTES))
                .is_some_and(|size| size <= left)
    }

    /// Whether a message begins here that is followed by another record. A message has no inner lengths to compare.
    fn is_message(&self, window: &[u8], left: u64) -> bool {
        self.message_length(window).is_some_and(|length| {
            let next = window.get((RECORD_HEAD_BYTES + length) as usize..).unwrap_or_default();
            let is_last = length + RECORD_HEAD_BYTES == left;
            is_last || self.message_length(next).is_some() || is_plausible_head(next)
        })
    }

    fn message_length(&self, window: &[u8]) -> Option<u64> {
        let mut fields = Fields::new(window);
        let (opcode, length) = fields.head()?;
        let is_known = self.channels.contains(&fields.u16()?);
        (opcode == op::MESSAGE && is_known && (MESSAGE_BYTES..LONGEST_RECORD).contains(&length))
            .then_some(length)
    }
}

/// Whether `window` begins with a record that may stand among messages outside chunks.
fn is_plausible_head(window: &[u8]) -> bool {
    let is_neighbour = |opcode| {
        matches!(opcode, op::SCHEMA | op::CHANNEL | op::CHUNK | op::ATTACHMENT | op::METADATA | op::DATA_END)
    };
    Fields::new(window)
        .head()
        .is_some_and(|(opcode, length)| is_neighbour(opcode) && length <= LONGEST_RECORD)
}

/// The length that a chunk record must have by the length of the records in it.
fn chunk_length(window: &[u8]) -> Option<u64> {
    let mut fields = Fields::new(window);
    fields.head()?;
    let (_start, _end, _size, _checksum) = (fields.u64()?, fields.u64()?, fields.u64()?, fields.u32()?);
    let compression = fields.text()?.len() as u64;
    // Start, end, size, checksum, length of the compression's name, the name, length of the records.
    fields.u64()?.checked_add(8 + 8 + 8 + 4 + 4 + compression + 8)
}

/// The length that an attachment record must have by the lengths of its names and data.
fn attachment_length(window: &[u8]) -> Option<u64> {
    let mut fields = Fields::new(window);
    fields.head()?;
    let (_log_time, _create_time) = (fields.u64()?, fields.u64()?);
    let names = (fields.text()?.len() + fields.text()?.len()) as u64;
    // Two times, the lengths of two names, the names, length of the data, the data, checksum.
    fields.u64()?.checked_add(8 + 8 + 4 + 4 + names + 8 + 4)
}

/// The length that a metadata record must have by the lengths of its name and entries.
fn metadata_length(window: &[u8]) -> Option<u64> {
    let mut fields = Fields::new(window);
    fields.head()?;
    let name = fields.text()?.len() as u64;
    // Length of the name, the name, length of the entries, the entries.
    Some(4 + name + 4 + u64::from(fields.u32()?))
}

#[cfg(test)]
mod tests;
