//! What the end of a log repeats of its beginning.
//!
//! Only a help: where it is damaged too, there is none.

use super::{
    LONGEST_RECORD,
    fields::{self, Fields},
};
use mcap::{
    MAGIC,
    records::{Record, op},
};
use std::{
    collections::VecDeque,
    io::{Read, Seek, SeekFrom},
};

/// Opcode, length and content of the footer, and the magic after it.
const END_BYTES: u64 = 9 + 20 + 8;

/// The schemas and channels that the summary of a file of `length` bytes repeats.
pub(super) fn repeated(source: &mut (impl Read + Seek), length: u64) -> Option<VecDeque<Record<'static>>> {
    let end = length.checked_sub(END_BYTES)?;
    let begin = begin(&bytes(source, end, END_BYTES)?)?;
    let summary = bytes(source, begin, end.checked_sub(begin)?.min(LONGEST_RECORD))?;
    let mut fields = Fields::new(&summary);
    let mut records = VecDeque::new();
    while let Some((opcode, body)) = fields.u8().and_then(|opcode| Some((opcode, fields.long_bytes()?))) {
        if matches!(opcode, op::SCHEMA | op::CHANNEL) {
            records.extend(fields::record(opcode, body).ok().flatten());
        }
    }
    Some(records)
}

fn bytes(source: &mut (impl Read + Seek), from: u64, count: u64) -> Option<Vec<u8>> {
    let mut bytes = Vec::new();
    source.seek(SeekFrom::Start(from)).ok()?;
    source.take(count).read_to_end(&mut bytes).ok()?;
    Some(bytes)
}

/// Where the summary begins, according to the footer.
fn begin(end: &[u8]) -> Option<u64> {
    let mut fields = Fields::new(end.strip_suffix(MAGIC)?);
    let is_footer = fields.u8()? == op::FOOTER && fields.u64()? == 20;
    fields.u64().filter(|begin| is_footer && *begin > 0)
}
