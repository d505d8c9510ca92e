//! Reads the messages and ticks of any log, damaged or not, or says what is wrong with the file.
//!
//! Never panics, never loops forever and never takes unbounded memory, whatever the file holds. Never writes.

mod error;

pub use super::replay::Replayed;
pub use super::salvage::{LogDamage, LogDamages};
pub use error::ReadError;

use super::replay::Replay;
use super::{RESULT, RUN, SCENARIO, salvage::Salvage};
use mcap::records::{self, MessageHeader, Record, SchemaHeader};
use ringwing_scenario::Scenario;
use std::{
    collections::{BTreeMap, VecDeque},
    fs::File,
    io::{BufReader, Read, Seek},
    path::{Path, PathBuf},
    rc::Rc,
};

/// Describes the messages of a topic, as the log itself states it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TopicSchema {
    /// Full name of the message type, such as `uavstate.UavState`.
    pub name: String,
    /// Format of the description, such as `protobuf`.
    pub encoding: String,
    /// The description itself.
    pub data: Vec<u8>,
}

/// A topic of the log.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Topic {
    /// Its name, such as `/uav/001/state`.
    pub name: String,
    /// What its messages look like; `None` if the log does not say, or lost that.
    pub schema: Option<Rc<TopicSchema>>,
}

/// A message of the log.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LogMessage {
    /// The topic it was written to.
    pub topic: Rc<Topic>,
    /// The tick it belongs to, in logs of ringwing.
    pub sequence: u32,
    /// When it was recorded, in nanoseconds since 1970.
    pub log_time: u64,
    /// Its content, still encoded.
    pub data: Vec<u8>,
}

/// Iterates over the messages of a log in the order of the file.
///
/// Metadata and attachments become known as reading passes them. Opening a log reads up to its first message, and logs
/// of ringwing hold the scenario before that.
pub struct Reader<R = BufReader<File>> {
    path: PathBuf,
    salvage: Salvage<R>,
    /// Messages that were read but not handed out yet.
    pending: VecDeque<LogMessage>,
    schemas: BTreeMap<u16, Rc<TopicSchema>>,
    topics: BTreeMap<u16, Rc<Topic>>,
    metadata: BTreeMap<String, BTreeMap<String, String>>,
    attachments: BTreeMap<String, Vec<u8>>,
    /// Messages skipped because the record that names their topic is lost.
    unnamed: u64,
}

impl Reader {
    /// Opens the file at `path`; fails unless it is a regular file that begins as MCAP files do.
    pub fn open(path: &Path) -> Result<Self, ReadError> {
        let unreadable = |source| ReadError::Unreadable { path: path.to_owned(), source };
        let file = File::open(path).map_err(unreadable)?;
        // Reading a device or a pipe might never end.
        if !file.metadata().map_err(unreadable)?.is_file() {
            return Err(ReadError::NotAFile { path: path.to_owned() });
        }
        Self::of(path, BufReader::new(file))
    }
}

impl<R: Read + Seek> Reader<R> {
    /// Reads from `source`; errors call it `path`.
    pub fn of(path: &Path, mut source: R) -> Result<Self, ReadError> {
        error::check_magic(path, &mut source)?;
        let mut reader = Self {
            path: path.to_owned(),
            salvage: Salvage::new(source),
            pending: VecDeque::new(),
            schemas: BTreeMap::new(),
            topics: BTreeMap::new(),
            metadata: BTreeMap::new(),
            attachments: BTreeMap::new(),
            unnamed: 0,
        };
        // Everything before the first message describes the log, so scenario and metadata are known from now on.
        let first = reader.next();
        reader.pending.extend(first);
        Ok(reader)
    }

    /// The path of the file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The metadata `run`: what flies.
    pub fn run(&self) -> Option<&BTreeMap<String, String>> {
        self.metadata.get(RUN)
    }

    /// The metadata `result`: how the flight went. Known once the log was read to its end, and only if the recorder
    /// finished it.
    pub fn result(&self) -> Option<&BTreeMap<String, String>> {
        self.metadata.get(RESULT)
    }

    /// The content of the attachment `name`.
    pub fn attachment(&self, name: &str) -> Option<&[u8]> {
        self.attachments.get(name).map(Vec::as_slice)
    }

    /// What could not be read so far.
    pub fn damages(&self) -> &LogDamages {
        self.salvage.damages()
    }

    /// Whether the log was read up to its end; a log that was cut has no end.
    pub fn has_ended(&self) -> bool {
        self.salvage.has_ended()
    }

    /// Number of messages skipped so far because the record that names their topic is lost.
    pub fn unnamed(&self) -> u64 {
        self.unnamed
    }

    /// The scenario that was flown, from the log's attachment.
    pub fn scenario(&self) -> Result<Scenario, ReadError> {
        let Some(text) = self.attachment(SCENARIO) else {
            return Err(ReadError::without_scenario(&self.path, self.run().is_some()));
        };
        let text = String::from_utf8_lossy(text);
        Scenario::resolved(&text).map_err(|problems| ReadError::Scenario {
            path: self.path.clone(),
            version: self.run().and_then(|run| run.get("version")).cloned().unwrap_or_default(),
            problems: problems.to_string(),
        })
    }

    /// Keeps a record that describes the log; returns it if it is a message.
    fn take(&mut self, record: Record) -> Option<LogMessage> {
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
        self.schemas.insert(id, Rc::new(TopicSchema { name, encoding, data }));
    }

    fn take_channel(&mut self, channel: records::Channel) {
        // By the MCAP specification a schema precedes its channels, so one that is missing here is lost.
        let schema = self.schemas.get(&channel.schema_id).cloned();
        self.topics.insert(channel.id, Rc::new(Topic { name: channel.topic, schema }));
    }

    fn message(&mut self, header: MessageHeader, data: Vec<u8>) -> Option<LogMessage> {
        let Some(topic) = self.topics.get(&header.channel_id) else {
            self.unnamed += 1;
            return None;
        };
        // A topic with its schema is larger than most messages, so messages share it.
        let MessageHeader { sequence, log_time, .. } = header;
        Some(LogMessage { topic: Rc::clone(topic), sequence, log_time, data })
    }
}

impl<R: Read + Seek> Iterator for Reader<R> {
    type Item = LogMessage;

    fn next(&mut self) -> Option<LogMessage> {
        if let Some(message) = self.pending.pop_front() {
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

/// Iterates over the ticks of a log in the order of the file.
pub struct Ticks<'r, R> {
    reader: &'r mut Reader<R>,
    replay: Replay,
}

impl<R: Read + Seek> Reader<R> {
    /// The flight, which is one of `scenario`, tick by tick, from the current message on.
    pub fn ticks(&mut self, scenario: &Scenario) -> Ticks<'_, R> {
        Ticks { reader: self, replay: Replay::new(scenario) }
    }
}

impl<R: Read + Seek> Iterator for Ticks<'_, R> {
    type Item = Replayed;

    fn next(&mut self) -> Option<Replayed> {
        for message in self.reader.by_ref() {
            let tick = self.replay.take(&message.topic.name, message.sequence, &message.data);
            if tick.is_some() {
                return tick;
            }
        }
        // No later tick completes the last one.
        self.replay.end()
    }
}

#[cfg(test)]
mod tests;
