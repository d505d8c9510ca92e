//! Schemas and channels that the summary at the end of a log repeats.
//!
//! They help to read messages whose own descriptions are lost with a damaged chunk. Never an error: a damaged summary
//! is treated like a missing one.

use super::{
    HEAD_BYTES, LONGEST_RECORD,
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

/// Content of a footer record, by the MCAP specification.
const FOOTER_BYTES: u64 = 20;
/// The footer record and the magic after it: the last bytes of every finished MCAP file.
const END_BYTES: u64 = HEAD_BYTES + FOOTER_BYTES + MAGIC.len() as u64;

/// The schemas and channels in the summary of a file of `length` bytes, if it has a readable summary.
pub(super) fn repeated(source: &mut (impl Read + Seek), length: u64) -> Option<VecDeque<Record<'static>>> {
    let end = length.checked_sub(END_BYTES)?;
    let begin = summary_start(&read(source, end, END_BYTES)?)?;
    // A damaged offset must not load the whole file into memory.
    let summary = read(source, begin, end.checked_sub(begin)?.min(LONGEST_RECORD))?;
    let mut fields = Fields::new(&summary);
    let mut records = VecDeque::new();
    while let Some((opcode, body)) = fields.u8().and_then(|opcode| Some((opcode, fields.long_bytes()?))) {
        // Statistics and indexes describe the file as it was written, not what is left of it.
        if matches!(opcode, op::SCHEMA | op::CHANNEL) {
            records.extend(fields::record(opcode, body).ok().flatten());
        }
    }
    Some(records)
}

fn read(source: &mut (impl Read + Seek), from: u64, count: u64) -> Option<Vec<u8>> {
    let mut bytes = Vec::new();
    source.seek(SeekFrom::Start(from)).ok()?;
    source.take(count).read_to_end(&mut bytes).ok()?;
    Some(bytes)
}

/// Offset of the summary, as the footer at the `end` of the file states it; 0 there means that there is no summary.
fn summary_start(end: &[u8]) -> Option<u64> {
    let mut fields = Fields::new(end.strip_suffix(MAGIC)?);
    let is_footer = fields.u8()? == op::FOOTER && fields.u64()? == FOOTER_BYTES;
    fields.u64().filter(|start| is_footer && *start > 0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{record, small_log};
    use std::io::Cursor;

    #[test]
    fn a_summary_repeats_schemas_and_channels_unless_its_footer_is_damaged() {
        let file = small_log(record);
        let repeated = |file: &[u8]| super::repeated(&mut Cursor::new(file), file.len() as u64);
        let whole = repeated(&file).unwrap();
        let channels = whole.iter().filter(|record| matches!(record, Record::Channel(_))).count();
        let schemas = whole.iter().filter(|record| matches!(record, Record::Schema { .. })).count();
        assert!(channels > 0 && schemas > 0 && channels + schemas == whole.len());
        let footer = file.len() - END_BYTES as usize;
        // Its opcode, its length, and the magic behind it.
        for at in [footer, footer + 1, file.len() - 1] {
            let mut damaged = file.clone();
            damaged[at] ^= 0x40;
            assert!(repeated(&damaged).is_none(), "byte {at}");
        }
    }
}
