//! Decodes the fields of records, in the layout of the MCAP specification: little endian, lengths before contents.
//!
//! Never reads beyond a record, and never allocates more than the record holds.

use mcap::records::{AttachmentHeader, Channel, Header, MessageHeader, Metadata, Record, SchemaHeader, op};
use std::{borrow::Cow, collections::BTreeMap};

/// Reads fields one after the other from a record's body; each read yields `None` if too few bytes are left.
#[derive(Debug, Clone, Copy)]
pub(super) struct Fields<'b> {
    rest: &'b [u8],
}

impl<'b> Fields<'b> {
    pub(super) fn new(body: &'b [u8]) -> Self {
        Self { rest: body }
    }

    /// Number of bytes not read yet.
    pub(super) fn left(&self) -> usize {
        self.rest.len()
    }

    fn bytes(&mut self, count: usize) -> Option<&'b [u8]> {
        let (bytes, rest) = self.rest.split_at_checked(count)?;
        self.rest = rest;
        Some(bytes)
    }

    fn array<const N: usize>(&mut self) -> Option<[u8; N]> {
        self.bytes(N)?.try_into().ok()
    }

    pub(super) fn u8(&mut self) -> Option<u8> {
        self.array().map(u8::from_le_bytes)
    }

    pub(super) fn u16(&mut self) -> Option<u16> {
        self.array().map(u16::from_le_bytes)
    }

    pub(super) fn u32(&mut self) -> Option<u32> {
        self.array().map(u32::from_le_bytes)
    }

    pub(super) fn u64(&mut self) -> Option<u64> {
        self.array().map(u64::from_le_bytes)
    }

    /// Opcode and length that precede every record.
    pub(super) fn head(&mut self) -> Option<(u8, u64)> {
        Some((self.u8()?, self.u64()?))
    }

    /// Bytes that follow their length of four bytes.
    fn short_bytes(&mut self) -> Option<&'b [u8]> {
        let count = self.u32()?;
        self.bytes(count as usize)
    }

    /// Bytes that follow their length of eight bytes.
    pub(super) fn long_bytes(&mut self) -> Option<&'b [u8]> {
        let count = self.u64()?;
        self.bytes(usize::try_from(count).ok()?)
    }

    pub(super) fn text(&mut self) -> Option<&'b str> {
        std::str::from_utf8(self.short_bytes()?).ok()
    }

    fn string(&mut self) -> Option<String> {
        self.text().map(str::to_owned)
    }

    fn map(&mut self) -> Option<BTreeMap<String, String>> {
        let mut entries = Self::new(self.short_bytes()?);
        let mut map = BTreeMap::new();
        // A map states its length in bytes, not in entries.
        while entries.left() > 0 {
            map.insert(entries.string()?, entries.string()?);
        }
        Some(map)
    }
}

/// Decodes the record with this `opcode` and `body`; `None` for kinds that hold no content, such as indexes.
///
/// A body that is longer than its fields is an error too: the record's length must be wrong.
pub(super) fn record(opcode: u8, body: &[u8]) -> Result<Option<Record<'static>>, &'static str> {
    let mut fields = Fields::new(body);
    let (record, damage) = match opcode {
        op::HEADER => (header(&mut fields), "a damaged header"),
        op::SCHEMA => (schema(&mut fields), "a damaged schema"),
        op::CHANNEL => (channel(&mut fields), "a damaged channel"),
        op::MESSAGE => (message(&mut fields), "a damaged message"),
        op::ATTACHMENT => (attachment(body, &mut fields), "a damaged attachment"),
        op::METADATA => (metadata(&mut fields), "damaged metadata"),
        op::MESSAGE_INDEX => {
            // Decoded only to notice a wrong length before it hides the records that follow.
            let is_whole = fields.u16().and_then(|_| fields.short_bytes()).is_some() && fields.left() == 0;
            return if is_whole { Ok(None) } else { Err("a damaged index") };
        }
        _ => return Ok(None),
    };
    record.filter(|_| fields.left() == 0).map(Some).ok_or(damage)
}

fn header(fields: &mut Fields) -> Option<Record<'static>> {
    Some(Record::Header(Header { profile: fields.string()?, library: fields.string()? }))
}

fn schema(fields: &mut Fields) -> Option<Record<'static>> {
    let header = SchemaHeader { id: fields.u16()?, name: fields.string()?, encoding: fields.string()? };
    Some(Record::Schema { header, data: Cow::Owned(fields.short_bytes()?.to_vec()) })
}

fn channel(fields: &mut Fields) -> Option<Record<'static>> {
    Some(Record::Channel(Channel {
        id: fields.u16()?,
        schema_id: fields.u16()?,
        topic: fields.string()?,
        message_encoding: fields.string()?,
        metadata: fields.map()?,
    }))
}

fn message(fields: &mut Fields) -> Option<Record<'static>> {
    let header = MessageHeader {
        channel_id: fields.u16()?,
        sequence: fields.u32()?,
        log_time: fields.u64()?,
        publish_time: fields.u64()?,
    };
    let data = fields.bytes(fields.left())?;
    Some(Record::Message { header, data: Cow::Owned(data.to_vec()) })
}

fn attachment(body: &[u8], fields: &mut Fields) -> Option<Record<'static>> {
    let header = AttachmentHeader {
        log_time: fields.u64()?,
        create_time: fields.u64()?,
        name: fields.string()?,
        media_type: fields.string()?,
    };
    let data = Cow::Owned(fields.long_bytes()?.to_vec());
    let crc = fields.u32()?;
    // The CRC covers everything before itself; 0 means that the writer computed none.
    let is_sound = crc == 0 || crc == crc32fast::hash(&body[..body.len() - 4]);
    is_sound.then_some(Record::Attachment { header, data, crc })
}

fn metadata(fields: &mut Fields) -> Option<Record<'static>> {
    Some(Record::Metadata(Metadata { name: fields.string()?, metadata: fields.map()? }))
}
