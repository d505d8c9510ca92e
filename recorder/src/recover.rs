//! Rebuilds a log that was cut or damaged: everything readable moves into a new, whole file with its indexes.
//!
//! Never touches its input, and never writes over anything.

use crate::{
    log::{RESULT, SCENARIO},
    reader::{Damages, ReadError, Reader},
    salvage::Salvage,
};
use mcap::{
    Attachment, McapError, McapResult, WriteOptions, Writer,
    records::{Channel, Header, MessageHeader, Record},
};
use std::{
    collections::BTreeMap,
    fs::{self, File},
    io::{self, BufReader, BufWriter},
    path::{Path, PathBuf},
};

/// What became of a log.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Recovery {
    /// Messages kept.
    pub messages: u64,
    /// Messages whose topic is no longer described: lost.
    pub unnamed: u64,
    /// Names of the attachments kept.
    pub attachments: Vec<String>,
    /// Names of the metadata kept.
    pub metadata: Vec<String>,
    /// Parts of the file that could not be read.
    pub damages: Damages,
    /// Whether the log was read to its end; one that was cut has none.
    pub ended: bool,
    /// Log times of the first and the last message kept, in nanoseconds since 1970.
    pub span: Option<(u64, u64)>,
}

impl Recovery {
    /// Whether the log has the attachment that it can be measured and flown again by.
    pub fn has_scenario(&self) -> bool {
        self.attachments.iter().any(|name| name == SCENARIO)
    }

    /// Whether the log says how the flight ended.
    pub fn has_result(&self) -> bool {
        self.metadata.iter().any(|name| name == RESULT)
    }
}

/// Why a log is not recovered.
#[derive(Debug, thiserror::Error)]
pub enum RecoverError {
    /// There is nothing to read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// There is a file already.
    #[error("{}: exists, and is left as it is; choose another file with --out", path.display())]
    Exists {
        /// That file.
        path: PathBuf,
    },
    /// The file system refused.
    #[error("{}: cannot be written: {reason}; choose another file with --out", path.display())]
    Unwritable {
        /// The file to be made.
        path: PathBuf,
        /// Why.
        reason: McapError,
    },
}

/// Makes a whole log at `output` of what is left of the one at `input`.
pub fn recover(input: &Path, output: &Path) -> Result<Recovery, RecoverError> {
    // Says what is wrong with a file that is no log.
    drop(Reader::open(input)?);
    let source = File::open(input)
        .map_err(|source| ReadError::Unreadable { path: input.to_owned(), source })
        .map(BufReader::new)?;
    let file = File::create_new(output).map_err(|error| refused(output, error))?;
    let mut salvage = Salvage::new(source);
    let recovery = copy(&mut salvage, file).map_err(|reason| {
        // What is begun is worth nothing; the reason is what matters.
        let _ = fs::remove_file(output);
        RecoverError::Unwritable { path: output.to_owned(), reason }
    })?;
    Ok(Recovery { damages: salvage.damages().clone(), ended: salvage.ended(), ..recovery })
}

fn refused(output: &Path, error: io::Error) -> RecoverError {
    let path = output.to_owned();
    match error.kind() {
        io::ErrorKind::AlreadyExists => RecoverError::Exists { path },
        _ => RecoverError::Unwritable { path, reason: error.into() },
    }
}

fn copy(salvage: &mut Salvage<BufReader<File>>, file: File) -> McapResult<Recovery> {
    let mut records = salvage.peekable();
    let header = match records.next_if(|record| matches!(record, Record::Header(_))) {
        Some(Record::Header(header)) => header,
        _ => Header { profile: String::new(), library: String::new() },
    };
    let mut copy = Copy::into(file, header)?;
    for record in records {
        copy.take(record)?;
    }
    copy.writer.finish()?;
    Ok(copy.recovery)
}

/// A log that is being rebuilt.
struct Copy {
    writer: Writer<BufWriter<File>>,
    recovery: Recovery,
    /// Schema numbers there, and here.
    schemas: BTreeMap<u16, u16>,
    /// Channel numbers there, and here.
    channels: BTreeMap<u16, u16>,
}

impl Copy {
    fn into(file: File, header: Header) -> McapResult<Self> {
        let options = WriteOptions::new().library(header.library).profile(header.profile);
        let options = options.chunk_size(Some(1 << 20)).compression_threads(0);
        Ok(Self {
            writer: options.create(BufWriter::new(file))?,
            recovery: Recovery::default(),
            schemas: BTreeMap::new(),
            channels: BTreeMap::new(),
        })
    }

    fn take(&mut self, record: Record) -> McapResult<()> {
        match record {
            Record::Schema { header, data } => {
                let id = self.writer.add_schema(&header.name, &header.encoding, &data)?;
                self.schemas.insert(header.id, id);
            }
            Record::Channel(channel) => self.take_channel(&channel)?,
            Record::Message { header, data } => self.take_message(header, &data)?,
            Record::Metadata(metadata) => {
                self.writer.write_metadata(&metadata)?;
                self.recovery.metadata.push(metadata.name);
            }
            Record::Attachment { header, data, .. } => {
                let (log_time, create_time) = (header.log_time, header.create_time);
                let (name, media_type) = (header.name, header.media_type);
                self.recovery.attachments.push(name.clone());
                self.writer.attach(&Attachment { log_time, create_time, name, media_type, data })?;
            }
            _ => {}
        }
        Ok(())
    }

    fn take_channel(&mut self, channel: &Channel) -> McapResult<()> {
        let Channel { id, schema_id, topic, message_encoding, metadata } = channel;
        let schema_id = self.schemas.get(schema_id).copied().unwrap_or(0);
        let here = self.writer.add_channel(schema_id, topic, message_encoding, metadata)?;
        self.channels.insert(*id, here);
        Ok(())
    }

    fn take_message(&mut self, header: MessageHeader, data: &[u8]) -> McapResult<()> {
        let Some(channel_id) = self.channels.get(&header.channel_id).copied() else {
            self.recovery.unnamed += 1;
            return Ok(());
        };
        self.recovery.messages += 1;
        let time = header.log_time;
        let (first, last) = self.recovery.span.unwrap_or((time, time));
        self.recovery.span = Some((first.min(time), last.max(time)));
        self.writer.write_to_known_channel(&MessageHeader { channel_id, ..header }, data)
    }
}
