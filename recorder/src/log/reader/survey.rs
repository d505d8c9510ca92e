//! The first pass over a log, which finds what later passes must know beforehand.
//!
//! Other programs write attachments and metadata after the messages, and messages in any order. Never keeps messages,
//! and of other records only what names the flight.

use super::topics::Topics;
use crate::log::{
    RESULT, RUN, SCENARIO,
    salvage::{LogDamages, Salvage},
};
use mcap::records::{AttachmentHeader, MessageHeader, Metadata, Record};
use std::{
    collections::BTreeMap,
    io::{Read, Seek},
};

/// Different records of one name that are kept. Two are enough to say that a log holds two flights.
const KEPT: usize = 2;

/// What one pass over a log has found.
#[derive(Debug, Default)]
pub(super) struct Survey {
    /// The different metadata records `run`.
    pub(super) runs: Vec<BTreeMap<String, String>>,
    /// The different metadata records `result`.
    pub(super) results: Vec<BTreeMap<String, String>>,
    /// The different attachments with a scenario.
    pub(super) scenarios: Vec<Vec<u8>>,
    /// Number of messages of each topic.
    pub(super) messages: BTreeMap<String, u64>,
    /// Number of messages whose topic is unknown, because the record that names it is lost.
    pub(super) unnamed: u64,
    /// Number of messages that are older than the message before them.
    pub(super) disordered: u64,
    /// The first of those: its topic and its log time.
    pub(super) first_disordered: Option<(String, u64)>,
    pub(super) damages: LogDamages,
    /// Whether the end of the data was found; it is missing if the log was cut.
    pub(super) has_ended: bool,
    /// Whether the file holds any record of an MCAP file.
    pub(super) has_records: bool,
    newest: u64,
}

impl Survey {
    /// Reads everything that `salvage` yields.
    pub(super) fn of<R: Read + Seek>(salvage: &mut Salvage<R>) -> Self {
        let mut survey = Self::default();
        let mut topics = Topics::default();
        for record in salvage.by_ref() {
            survey.has_records = true;
            if let Some(record) = topics.take(record) {
                survey.take(record, &topics);
            }
        }
        // Asked last: `salvage` finds damages and the end of the data only while it is read.
        survey.damages = salvage.damages().clone();
        survey.has_ended = salvage.has_ended();
        survey
    }

    fn take(&mut self, record: Record, topics: &Topics) {
        match record {
            Record::Message { header, .. } => self.take_message(header, topics),
            Record::Metadata(Metadata { name, metadata }) => match name.as_str() {
                RUN => keep(&mut self.runs, metadata),
                RESULT => keep(&mut self.results, metadata),
                _ => {}
            },
            Record::Attachment { header: AttachmentHeader { name, .. }, data, .. } if name == SCENARIO => {
                keep(&mut self.scenarios, data.into_owned());
            }
            _ => {}
        }
    }

    fn take_message(&mut self, header: MessageHeader, topics: &Topics) {
        let Some(topic) = topics.of(header.channel_id) else {
            self.unnamed += 1;
            return;
        };
        // Not by `entry`, which would copy the name of the topic for every message.
        match self.messages.get_mut(&topic.name) {
            Some(count) => *count += 1,
            None => drop(self.messages.insert(topic.name.clone(), 1)),
        }
        if header.log_time < self.newest {
            self.disordered += 1;
            self.first_disordered.get_or_insert_with(|| (topic.name.clone(), header.log_time));
        }
        self.newest = self.newest.max(header.log_time);
    }
}

/// Keeps `found` unless an equal one is kept already: programs that join files may copy a record twice.
fn keep<T: PartialEq>(kept: &mut Vec<T>, found: T) {
    if kept.len() < KEPT && !kept.contains(&found) {
        kept.push(found);
    }
}
