//! The topics of a log, by the numbers of their channels.
//!
//! Never assumes that a number keeps its topic: programs that join files may use it again.

use mcap::records::{Channel, Record};
use std::{collections::BTreeMap, sync::Arc};

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
    pub schema: Option<Arc<TopicSchema>>,
}

/// The schemas and topics that were read so far.
#[derive(Debug, Default)]
pub(super) struct Topics {
    schemas: BTreeMap<u16, Arc<TopicSchema>>,
    topics: BTreeMap<u16, Arc<Topic>>,
}

impl Topics {
    /// Keeps a schema or a channel; returns any other record.
    pub(super) fn take<'r>(&mut self, record: Record<'r>) -> Option<Record<'r>> {
        match record {
            Record::Schema { header, data } => {
                let schema =
                    TopicSchema { name: header.name, encoding: header.encoding, data: data.into_owned() };
                self.schemas.insert(header.id, Arc::new(schema));
            }
            Record::Channel(Channel { id, schema_id, topic: name, .. }) => {
                // By the MCAP specification a schema precedes its channels, so one that is missing here is lost.
                let topic = Topic { name, schema: self.schemas.get(&schema_id).cloned() };
                // Some writers repeat all channels in each chunk. Keeping the topic lets messages share it.
                if self.topics.get(&id).is_none_or(|known| **known != topic) {
                    self.topics.insert(id, Arc::new(topic));
                }
            }
            other => return Some(other),
        }
        None
    }

    /// The topic of the channel with this number; `None` if the record that names it is lost.
    pub(super) fn of(&self, channel: u16) -> Option<&Arc<Topic>> {
        self.topics.get(&channel)
    }
}
