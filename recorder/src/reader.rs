//! Reads any file that is said to be a log: what is left of one of ours, or a clear word on what it is instead.
//!
//! Never panics, hangs or takes memory without bound, whatever the file holds; never writes.

mod error;

pub use crate::{
    replay::Replayed,
    salvage::{Damage, Damages},
};
pub use error::ReadError;

use crate::{
    log::{RESULT, RUN, SCENARIO},
    replay::Replay,
    salvage::Salvage,
};
use mcap::records::{self, MessageHeader, Record, SchemaHeader};
use ringwing_scenario::Scenario;
use std::{
    collections::{BTreeMap, VecDeque},
    fs::File,
    io::{BufReader, Read, Seek},
    path::{Path, PathBuf},
    rc::Rc,
};

/// A kind of message, as the log describes it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Schema {
    /// Its name.
    pub name: String,
    /// What the description is written in: `protobuf`, ...
    pub encoding: String,
    /// The description.
    pub data: Vec<u8>,
}

/// A topic of the log.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Channel {
    /// Its name.
    pub topic: String,
    /// The kind of its messages, if the log says it.
    pub schema: Option<Rc<Schema>>,
}

/// A message of the log.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Message {
    /// Where it was sent.
    pub channel: Rc<Channel>,
    /// The tick, in logs of ours.
    pub sequence: u32,
    /// When it was recorded, in nanoseconds since 1970.
    pub log_time: u64,
    /// What it holds, still encoded.
    pub data: Vec<u8>,
}

/// A log that is being read: its messages in the order in which they lie there.
///
/// What stands outside the messages is known as far as the log was read; [`Self::open`] reads on to the first message.
pub struct Reader<R = BufReader<File>> {
    path: PathBuf,
    salvage: Salvage<R>,
    waiting: VecDeque<Message>,
    schemas: BTreeMap<u16, Rc<Schema>>,
    channels: BTreeMap<u16, Rc<Channel>>,
    metadata: BTreeMap<String, BTreeMap<String, String>>,
    attachments: BTreeMap<String, Vec<u8>>,
    /// Messages of channels that the log no longer describes.
    unnamed: u64,
}

impl Reader {
    /// Opens the file at `path`.
    pub fn open(path: &Path) -> Result<Self, ReadError> {
        let unreadable = |source| ReadError::Unreadable { path: path.to_owned(), source };
        let file = File::open(path).map_err(unreadable)?;
        let kind = file.metadata().map_err(unreadable)?;
        if !kind.is_file() {
            return Err(ReadError::NoFile { path: path.to_owned() });
        }
        Self::of(path, BufReader::new(file))
    }
}

impl<R: Read + Seek> Reader<R> {
    /// Reads from `source`, called `path` in errors.
    pub fn of(path: &Path, mut source: R) -> Result<Self, ReadError> {
        error::check_magic(path, &mut source)?;
        let mut reader = Self {
            path: path.to_owned(),
            salvage: Salvage::new(source),
            waiting: VecDeque::new(),
            schemas: BTreeMap::new(),
            channels: BTreeMap::new(),
            metadata: BTreeMap::new(),
            attachments: BTreeMap::new(),
            unnamed: 0,
        };
        let first = reader.next();
        reader.waiting.extend(first);
        Ok(reader)
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// What the log says of its run.
    pub fn run(&self) -> Option<&BTreeMap<String, String>> {
        self.metadata.get(RUN)
    }

    /// What the log says of its end; known when it was read to there, and only if the run came to an end.
    pub fn result(&self) -> Option<&BTreeMap<String, String>> {
        self.metadata.get(RESULT)
    }

    /// The content of the attachment `name`.
    pub fn attachment(&self, name: &str) -> Option<&[u8]> {
        self.attachments.get(name).map(Vec::as_slice)
    }

    /// What could not be read so far.
    pub fn damages(&self) -> &Damages {
        self.salvage.damages()
    }

    /// Whether the log was read to its end; one that was cut has none.
    pub fn ended(&self) -> bool {
        self.salvage.ended()
    }

    /// Messages so far that cannot be told, for what described their topic is lost.
    pub fn unnamed(&self) -> u64 {
        self.unnamed
    }

    /// The scenario that was flown.
    pub fn scenario(&self) -> Result<Scenario, ReadError> {
        let Some(text) = self.attachment(SCENARIO) else {
            return Err(ReadError::foreign(&self.path, self.run().is_some()));
        };
        let text = String::from_utf8_lossy(text);
        Scenario::resolved(&text).map_err(|problems| ReadError::Scenario {
            path: self.path.clone(),
            version: self.run().and_then(|run| run.get("version")).cloned().unwrap_or_default(),
            problems: problems.to_string(),
        })
    }

    fn take(&mut self, record: Record) -> Option<Message> {
        match record {
            Record::Schema { header, data } => self.take_schema(header, data.into_owned()),
            Record::Channel(channel) => self.take_channel(channel),
            Record::Message { header, data } => return self.message(header, data.into_owned()),
            Record::Metadata(metadata) => drop(self.metadata.insert(metadata.name, metadata.metadata)),
            Record::Attachment { header, data, .. } => {
                self.attachments.insert(header.name, data.into_owned());
            }
            _ => {}
        }
        None
    }

    fn take_schema(&mut self, header: SchemaHeader, data: Vec<u8>) {
        let SchemaHeader { id, name, encoding } = header;
        self.schemas.insert(id, Rc::new(Schema { name, encoding, data }));
    }

    fn take_channel(&mut self, channel: records::Channel) {
        let schema = self.schemas.get(&channel.schema_id).cloned();
        self.channels.insert(channel.id, Rc::new(Channel { topic: channel.topic, schema }));
    }

    fn message(&mut self, header: MessageHeader, data: Vec<u8>) -> Option<Message> {
        let Some(channel) = self.channels.get(&header.channel_id) else {
            self.unnamed += 1;
            return None;
        };
        let MessageHeader { sequence, log_time, .. } = header;
        Some(Message { channel: Rc::clone(channel), sequence, log_time, data })
    }
}

impl<R: Read + Seek> Iterator for Reader<R> {
    type Item = Message;

    fn next(&mut self) -> Option<Message> {
        if let Some(message) = self.waiting.pop_front() {
            return Some(message);
        }
        loop {
            let record = self.salvage.next()?;
            if let Some(message) = self.take(record) {
                return Some(message);
            }
        }
    }
}

/// The ticks of a log, in the order in which they lie there.
pub struct Ticks<'r, R> {
    reader: &'r mut Reader<R>,
    replay: Replay,
}

impl<R: Read + Seek> Reader<R> {
    /// The flight of a swarm of `uavs`, tick by tick, from here on.
    pub fn ticks(&mut self, uavs: u32) -> Ticks<'_, R> {
        Ticks { reader: self, replay: Replay::new(uavs) }
    }
}

impl<R: Read + Seek> Iterator for Ticks<'_, R> {
    type Item = Replayed;

    fn next(&mut self) -> Option<Replayed> {
        for message in self.reader.by_ref() {
            let tick = self.replay.take(&message.channel.topic, message.sequence, &message.data);
            if tick.is_some() {
                return tick;
            }
        }
        self.replay.end()
    }
}

#[cfg(test)]
mod tests;
