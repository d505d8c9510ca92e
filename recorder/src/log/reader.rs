//! Reads the messages and ticks of any log, damaged or not, or says what is wrong with the file.
//!
//! Never panics, never loops forever and never takes unbounded memory, whatever the file holds. Never writes, apart from
//! temporary copies.

pub(super) mod error;
mod shortfalls;
mod sorted;
mod survey;
mod topics;

pub use super::{
    input::{STANDARD_INPUT, locate},
    replay::Replayed,
    salvage::{LogDamage, LogDamages},
};
pub use error::ReadError;
pub use shortfalls::Shortfalls;
pub use topics::{Topic, TopicSchema};

use super::{
    input::{self, LogInput},
    replay::Replay,
    salvage::Salvage,
};
use crate::clock::Clock;
use mcap::records::{MessageHeader, Record};
use ringwing_scenario::Scenario;
use sorted::SortedMessages;
use std::{
    collections::BTreeMap,
    fs::File,
    io::{BufReader, Read, Seek},
    path::{Path, PathBuf},
    sync::Arc,
};
use survey::Survey;
use topics::Topics;

/// A message of the log.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LogMessage {
    /// The topic it was written to.
    pub topic: Arc<Topic>,
    /// The tick of its log time; `None` if the time is not that of a tick, or if the log has no scenario.
    ///
    /// Programs that rewrite logs keep the times, but not always the sequence numbers.
    pub tick: Option<i64>,
    /// When it was recorded, in nanoseconds since 1970.
    pub log_time: u64,
    /// Its content, still encoded.
    pub data: Vec<u8>,
}

/// Iterates over the messages of a log in the order of their times.
///
/// Opening a log reads it once, so that everything but the messages is known from then on.
pub struct Reader<R = BufReader<File>> {
    path: PathBuf,
    survey: Survey,
    messages: Messages<R>,
    /// Converts log times, once the scenario is known.
    clock: Option<Clock>,
}

/// Where the messages come from.
enum Messages<R> {
    /// The file itself, which has them in order.
    InFile { salvage: Box<Salvage<R>>, topics: Topics },
    /// A sorted copy.
    Sorted(SortedMessages),
}

impl Reader {
    /// Opens the log that `path` names: a file, the folder of a run, or `-` for standard input.
    ///
    /// The log may be compressed as a whole with Zstandard.
    pub fn open(path: &Path) -> Result<Self, ReadError> {
        let LogInput { path, file, problem } = input::open(path)?;
        let mut reader = Self::of(&path, BufReader::new(file))?;
        if let Some(problem) = problem {
            reader.survey.damages.add(0, 0, problem);
        }
        Ok(reader)
    }
}

impl<R: Read + Seek> Reader<R> {
    /// Reads from `source`; errors call it `path`.
    pub fn of(path: &Path, mut source: R) -> Result<Self, ReadError> {
        let begin = error::begin_of(path, &mut source)?;
        let mut salvage = Salvage::new(source);
        let survey = Survey::of(&mut salvage);
        if !survey.has_records {
            error::check_begin(path, &begin)?;
        }
        let mut messages = salvage.again();
        let messages = if survey.disordered == 0 {
            Messages::InFile { salvage: Box::new(messages), topics: Topics::default() }
        } else {
            let sorted = SortedMessages::of(&mut messages);
            Messages::Sorted(sorted.map_err(|source| ReadError::no_room(path, source))?)
        };
        let mut reader = Self { path: path.to_owned(), survey, messages, clock: None };
        reader.clock = reader.scenario().ok().map(|scenario| Clock::new(scenario.time.rate_hz));
        Ok(reader)
    }

    /// Starts again with the first message.
    pub fn rewind(self) -> Self {
        let messages = match self.messages {
            Messages::InFile { salvage, .. } => {
                Messages::InFile { salvage: Box::new(salvage.again()), topics: Topics::default() }
            }
            Messages::Sorted(mut sorted) => {
                sorted.rewind();
                Messages::Sorted(sorted)
            }
        };
        Self { messages, ..self }
    }

    /// The path of the file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The metadata `run`: what flies.
    pub fn run(&self) -> Option<&BTreeMap<String, String>> {
        self.survey.runs.first()
    }

    /// The metadata `result`: how the flight went, if the recorder finished the log.
    pub fn result(&self) -> Option<&BTreeMap<String, String>> {
        self.survey.results.first()
    }

    /// What could not be read.
    pub fn damages(&self) -> &LogDamages {
        &self.survey.damages
    }

    /// Whether the log has its end; a log that was cut has no end.
    pub fn has_ended(&self) -> bool {
        self.survey.has_ended
    }

    /// Number of messages that are skipped because the record that names their topic is lost.
    pub fn unnamed(&self) -> u64 {
        self.survey.unnamed
    }

    /// The topics that have messages.
    pub fn topics(&self) -> impl Iterator<Item = &str> {
        self.survey.messages.keys().map(String::as_str)
    }

    /// What the log lacks of its flight, which is one of `scenario`, and what is unusual about it.
    pub fn shortfalls(&self, scenario: &Scenario) -> Shortfalls {
        Shortfalls::of(&self.survey, scenario)
    }

    /// The scenario that was flown, from the log's attachment; an error if the log holds two flights.
    pub fn scenario(&self) -> Result<Scenario, ReadError> {
        let Survey { runs, results, scenarios, .. } = &self.survey;
        // Each of these is written once, so different ones are of different flights.
        if [runs.len(), results.len(), scenarios.len()].iter().any(|different| *different > 1) {
            return Err(ReadError::two_flights(&self.path, runs));
        }
        let Some(text) = scenarios.first() else {
            return Err(ReadError::without_scenario(&self.path, self.run().is_some()));
        };
        Scenario::resolved(&String::from_utf8_lossy(text)).map_err(|problems| ReadError::Scenario {
            path: self.path.clone(),
            version: self.run().and_then(|run| run.get("version")).cloned().unwrap_or_default(),
            problems: problems.to_string(),
        })
    }
}

impl<R: Read + Seek> Iterator for Messages<R> {
    type Item = (Arc<Topic>, MessageHeader, Vec<u8>);

    fn next(&mut self) -> Option<Self::Item> {
        let (salvage, topics) = match self {
            Self::Sorted(sorted) => return sorted.next(),
            Self::InFile { salvage, topics } => (salvage, topics),
        };
        loop {
            let record = salvage.next()?;
            if let Some(Record::Message { header, data }) = topics.take(record)
                && let Some(topic) = topics.of(header.channel_id)
            {
                // A topic with its schema is larger than most messages, so messages share it.
                return Some((Arc::clone(topic), header, data.into_owned()));
            }
        }
    }
}

impl<R: Read + Seek> Iterator for Reader<R> {
    type Item = LogMessage;

    fn next(&mut self) -> Option<LogMessage> {
        let (topic, MessageHeader { log_time, .. }, data) = self.messages.next()?;
        let tick = self.clock.and_then(|clock| clock.tick_at(log_time));
        Some(LogMessage { topic, tick, log_time, data })
    }
}

/// Iterates over the ticks of a log in the order of time.
pub struct Ticks<'r, R> {
    reader: &'r mut Reader<R>,
    replay: Replay,
}

impl<R: Read + Seek> Reader<R> {
    /// The flight, which is one of `scenario`, tick by tick, from the current message on.
    pub fn ticks(&mut self, scenario: &Scenario) -> Ticks<'_, R> {
        // The caller may know the scenario of a log that has lost it.
        self.clock = Some(Clock::new(scenario.time.rate_hz));
        Ticks { reader: self, replay: Replay::new(scenario) }
    }
}

impl<R: Read + Seek> Iterator for Ticks<'_, R> {
    type Item = Replayed;

    fn next(&mut self) -> Option<Replayed> {
        for message in self.reader.by_ref() {
            // A message of another program has its own times, and is no part of the flight.
            let Some(tick) = message.tick else { continue };
            let before = self.replay.take(&message.topic.name, tick, &message.data);
            if before.is_some() {
                return before;
            }
        }
        // No later tick completes the last one.
        self.replay.end()
    }
}

#[cfg(test)]
mod tests;
