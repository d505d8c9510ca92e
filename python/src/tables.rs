//! The topics of a log as columns.
//!
//! Never yields what `review` does not count: a message that is in the file twice is one row, and of two messages of a UAV in
//! one tick the first is kept.

use crate::{columns::Columns, message_shape::MessageShape};
use ringwing_recorder::{
    log::reader::{LogMessage, Reader, TopicSchema},
    schema::topics::UavTopic,
};
use std::{
    collections::BTreeMap,
    io::{Read, Seek},
    sync::Arc,
};

/// A topic that is being read.
struct OpenTable {
    columns: Columns,
    /// Whether it has one message in a tick.
    is_single: bool,
    /// The messages of the tick that is being read, to find repetitions.
    tick: Option<i64>,
    of_tick: Vec<Vec<u8>>,
}

/// Reads the messages of the `wanted` topics from here on. A topic whose messages are not rows is left out.
pub(crate) fn read<R: Read + Seek>(
    reader: &mut Reader<R>,
    wanted: impl Fn(&str) -> bool,
) -> BTreeMap<String, Columns> {
    let mut tables: BTreeMap<String, Option<OpenTable>> = BTreeMap::new();
    for message in reader.by_ref() {
        let name = &message.topic.name;
        if let Some(table) = tables.get_mut(name) {
            // Known, and not wanted or without rows.
            let Some(table) = table else { continue };
            table.take(message);
            continue;
        }
        let schema = message.topic.schema.as_ref().filter(|_| wanted(name));
        let mut table = schema.and_then(|schema| OpenTable::new(name, schema));
        let name = name.clone();
        if let Some(table) = &mut table {
            table.take(message);
        }
        // An unwanted topic is stored as `None`, so that its schema is looked at only once.
        tables.insert(name, table);
    }
    tables.into_iter().filter_map(|(name, table)| Some((name, table?.columns))).collect()
}

impl OpenTable {
    fn new(topic: &str, schema: &Arc<TopicSchema>) -> Option<Self> {
        let columns = Columns::new(MessageShape::of(schema)?);
        Some(Self { columns, is_single: UavTopic::parse(topic).is_some(), tick: None, of_tick: Vec::new() })
    }

    fn take(&mut self, LogMessage { tick, data, .. }: LogMessage) {
        // A message of another program has its own times, and is no part of the flight.
        let Some(tick) = tick else { return };
        if self.tick != Some(tick) {
            self.tick = Some(tick);
            self.of_tick.clear();
        }
        let is_known = if self.is_single { !self.of_tick.is_empty() } else { self.of_tick.contains(&data) };
        // A damaged message does not count as the first of its tick, so an intact one after it still gets the row.
        if !is_known && self.columns.push(tick, &data) {
            self.of_tick.push(data);
        }
    }
}
