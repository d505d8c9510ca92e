//! A chunk: a record that holds other records, compressed together.
//!
//! Never allocates the size that a chunk claims, only what decompression yields.

use super::fields::Fields;
use std::io::Read;

/// The records of a chunk, decompressed, and how far they were read.
#[derive(Debug, Default)]
pub(super) struct Chunk {
    records: Vec<u8>,
    position: usize,
}

/// The fields of a chunk record; start and end time are not needed.
struct ChunkHead<'b> {
    /// Length of the records once decompressed, as the chunk claims it.
    size: u64,
    /// CRC-32 of the decompressed records; 0 if the writer computed none.
    checksum: u32,
    compression: &'b str,
    /// The compressed records.
    records: &'b [u8],
}

impl Chunk {
    /// Whether the lengths within a chunk record's `body` add up to its length.
    pub(super) fn has_consistent_lengths(body: &[u8]) -> bool {
        ChunkHead::parse(body).is_some()
    }

    /// Decompresses and checks the chunk record with this `body`; refuses one of more than `longest` bytes.
    pub(super) fn decompress(body: &[u8], longest: u64) -> Result<Self, String> {
        let head = ChunkHead::parse(body).ok_or("a chunk whose lengths disagree")?;
        // Check the claim first: a few damaged bytes could decompress to more than the memory holds.
        if head.size > longest {
            return Err(format!("a chunk that claims to hold {} bytes", head.size));
        }
        let records = head.decompress()?;
        if records.len() as u64 != head.size {
            return Err(format!("a chunk of {} bytes instead of {}", records.len(), head.size));
        }
        if head.checksum != 0 && crc32fast::hash(&records) != head.checksum {
            return Err("a chunk whose checksum is wrong".into());
        }
        Ok(Self { records, position: 0 })
    }

    /// Whether all records were read.
    pub(super) fn is_empty(&self) -> bool {
        self.position >= self.records.len()
    }

    /// Opcode and body of the next record; `None` if the chunk breaks off within it or is empty.
    pub(super) fn next_record(&mut self) -> Option<(u8, &[u8])> {
        let mut fields = Fields::new(&self.records[self.position..]);
        let record = fields.u8().and_then(|opcode| Some((opcode, fields.long_bytes()?)));
        self.position = self.records.len() - fields.left();
        record
    }
}

impl<'b> ChunkHead<'b> {
    fn parse(body: &'b [u8]) -> Option<Self> {
        let mut fields = Fields::new(body);
        let (_start, _end) = (fields.u64()?, fields.u64()?);
        let (size, checksum, compression) = (fields.u64()?, fields.u32()?, fields.text()?);
        let records = fields.long_bytes()?;
        (fields.left() == 0).then_some(Self { size, checksum, compression, records })
    }

    fn decompress(&self) -> Result<Vec<u8>, String> {
        let mut records = Vec::new();
        // Read one byte more than claimed, so that a chunk that is too long does not pass for a complete one.
        let read = match self.compression {
            "" => self.records.take(self.size + 1).read_to_end(&mut records),
            "zstd" => zstd::Decoder::new(self.records)
                .and_then(|decoder| decoder.take(self.size + 1).read_to_end(&mut records)),
            "lz4" => lz4::Decoder::new(self.records)
                .and_then(|decoder| decoder.take(self.size + 1).read_to_end(&mut records)),
            other => {
                return Err(format!("a chunk compressed with {other:?}, which ringwing does not read"));
            }
        };
        read.map_err(|error| format!("a chunk that cannot be decompressed: {error}"))?;
        Ok(records)
    }
}
