//! Copies records from one log into another that numbers its schemas and channels itself.
//!
//! Never decides which records are worth copying; the caller does.

use mcap::{
    Attachment, McapResult, Writer,
    records::{Channel, MessageHeader, Record},
};
use std::{
    collections::BTreeMap,
    io::{Seek, Write},
};

/// Translates the schema and channel numbers of one source log into those of one target log.
#[derive(Debug, Default)]
pub(crate) struct RecordCopier {
    /// Schema numbers of the target, by those of the source.
    schemas: BTreeMap<u16, u16>,
    /// Channels of the target, by the source's numbers.
    channels: BTreeMap<u16, CopiedChannel>,
}

#[derive(Debug)]
struct CopiedChannel {
    id: u16,
    topic: String,
}

impl RecordCopier {
    /// Copies a schema, channel, attachment or metadata record to `writer`.
    ///
    /// Messages need [`Self::translate`] and are left to the caller. Other records are ignored: `writer` makes its own.
    pub(crate) fn copy<W: Write + Seek>(
        &mut self,
        record: Record<'_>,
        writer: &mut Writer<W>,
    ) -> McapResult<()> {
        match record {
            Record::Schema { header, data } => {
                let id = writer.add_schema(&header.name, &header.encoding, &data)?;
                self.schemas.insert(header.id, id);
            }
            Record::Channel(channel) => self.copy_channel(channel, writer)?,
            Record::Metadata(metadata) => writer.write_metadata(&metadata)?,
            Record::Attachment { header, data, .. } => {
                // The checksum is left behind: the writer computes its own.
                let (log_time, create_time) = (header.log_time, header.create_time);
                let (name, media_type) = (header.name, header.media_type);
                writer.attach(&Attachment { log_time, create_time, name, media_type, data })?;
            }
            _ => {}
        }
        Ok(())
    }

    fn copy_channel<W: Write + Seek>(&mut self, channel: Channel, writer: &mut Writer<W>) -> McapResult<()> {
        let Channel { id, schema_id, topic, message_encoding, metadata } = channel;
        // If the schema is lost, fall back to 0, which means "no schema".
        let schema_id = self.schemas.get(&schema_id).copied().unwrap_or(0);
        let new_id = writer.add_channel(schema_id, &topic, &message_encoding, &metadata)?;
        self.channels.insert(id, CopiedChannel { id: new_id, topic });
        Ok(())
    }

    /// The header of a message in the target and the message's topic; `None` if its channel was never copied.
    pub(crate) fn translate(&self, header: MessageHeader) -> Option<(MessageHeader, &str)> {
        let CopiedChannel { id, topic } = self.channels.get(&header.channel_id)?;
        Some((MessageHeader { channel_id: *id, ..header }, topic))
    }
}
