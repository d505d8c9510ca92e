//! A chunk: records that were compressed together.
//!
//! Never allocates what a chunk claims, only what it holds.

use super::fields::Fields;
use mcap::records::op;
use std::io::Read;

/// Bytes of a chunk record before its compressed records, with the longest name of a compression.
pub(super) const HEAD_BYTES: usize = 9 + 40 + 4;

/// The records of a chunk, decompressed.
#[derive(Debug, Default)]
pub(super) struct Plain {
    bytes: Vec<u8>,
    at: usize,
}

struct Head<'b> {
    size: u64,
    checksum: u32,
    compression: &'b str,
    records: &'b [u8],
}

impl Plain {
    /// Whether the lengths within a chunk's record fit it.
    pub(super) fn lengths_agree(body: &[u8]) -> bool {
        Head::of(body).is_some()
    }

    /// The chunk whose record holds `body`, if it is sound and not longer than `longest`.
    pub(super) fn of(body: &[u8], longest: u64) -> Result<Self, String> {
        let head = Head::of(body).ok_or("a chunk whose lengths disagree")?;
        if head.size > longest {
            return Err(format!("a chunk that claims to hold {} bytes", head.size));
        }
        let bytes = head.decompress()?;
        if bytes.len() as u64 != head.size {
            return Err(format!("a chunk of {} bytes instead of {}", bytes.len(), head.size));
        }
        if head.checksum != 0 && crc32fast::hash(&bytes) != head.checksum {
            return Err("a chunk whose checksum is wrong".into());
        }
        Ok(Self { bytes, at: 0 })
    }

    pub(super) fn is_over(&self) -> bool {
        self.at >= self.bytes.len()
    }

    /// The next record's opcode and body; none where the chunk breaks off or is over.
    pub(super) fn next_record(&mut self) -> Option<(u8, &[u8])> {
        let mut fields = Fields::new(&self.bytes[self.at..]);
        let record = fields.u8().and_then(|opcode| Some((opcode, fields.long_bytes()?)));
        self.at = self.bytes.len() - fields.left();
        record
    }
}

impl<'b> Head<'b> {
    fn of(body: &'b [u8]) -> Option<Self> {
        let mut fields = Fields::new(body);
        let (_start, _end) = (fields.u64()?, fields.u64()?);
        let (size, checksum, compression) = (fields.u64()?, fields.u32()?, fields.text()?);
        let records = fields.long_bytes()?;
        (fields.left() == 0).then_some(Self { size, checksum, compression, records })
    }

    fn decompress(&self) -> Result<Vec<u8>, String> {
        let mut bytes = Vec::new();
        // One byte more than it may be, so that too much shows.
        let read = match self.compression {
            "" => self.records.take(self.size + 1).read_to_end(&mut bytes),
            "zstd" => zstd::Decoder::new(self.records)
                .and_then(|decoder| decoder.take(self.size + 1).read_to_end(&mut bytes)),
            other => {
                return Err(format!("a chunk compressed with {other:?}, which ringwing does not read"));
            }
        };
        read.map_err(|error| format!("a chunk that cannot be decompressed: {error}"))?;
        Ok(bytes)
    }
}

/// Whether a chunk begins here, `left` bytes before the end of the file: its two lengths must agree.
pub(super) fn begins(window: &[u8], left: u64) -> bool {
    let agree = || {
        let mut fields = Fields::new(window);
        let (opcode, length) = (fields.u8()?, fields.u64()?);
        let (_start, _end, _size, _checksum) = (fields.u64()?, fields.u64()?, fields.u64()?, fields.u32()?);
        let compression = fields.text()?.len() as u64;
        let records = fields.u64()?;
        let whole = records.checked_add(8 + 8 + 8 + 4 + 4 + compression + 8)?;
        Some(opcode == op::CHUNK && length == whole && length.checked_add(9)? <= left)
    };
    window.first() == Some(&op::CHUNK) && agree() == Some(true)
}
