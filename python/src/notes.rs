//! What controllers noted, as columns: one for each name.
//!
//! Never yields what `review` does not count: of two messages of a UAV in one tick the first is kept.

use numpy::IntoPyArray;
use prost::Message;
use pyo3::prelude::*;
use ringwing_recorder::{
    log::reader::Reader,
    schema::{UavNotes, topics::UavTopic},
};
use std::{
    collections::{BTreeMap, HashMap},
    io::{Read, Seek},
};

/// The notes of one UAV.
#[derive(Debug, Default)]
pub(crate) struct NoteColumns {
    ticks: Vec<i64>,
    columns: Vec<(String, Vec<f64>)>,
    /// Places of the columns, by name.
    places: HashMap<String, usize>,
}

/// Reads the notes of all UAVs from here on, by topic.
pub(crate) fn read<R: Read + Seek>(reader: &mut Reader<R>) -> BTreeMap<String, NoteColumns> {
    let mut tables: BTreeMap<String, NoteColumns> = BTreeMap::new();
    for message in reader.by_ref() {
        let topic = &message.topic.name;
        // Asked first, because nearly all messages are of other topics.
        let Some(UavTopic::Notes) = UavTopic::parse(topic) else { continue };
        let (Some(tick), Ok(notes)) = (message.tick, UavNotes::decode(&*message.data)) else { continue };
        match tables.get_mut(topic) {
            Some(table) => table.push(tick, notes),
            None => tables.entry(topic.clone()).or_default().push(tick, notes),
        }
    }
    tables
}

impl NoteColumns {
    fn push(&mut self, tick: i64, notes: UavNotes) {
        if self.ticks.last() == Some(&tick) {
            return;
        }
        let row = self.ticks.len();
        self.ticks.push(tick);
        for note in notes.notes {
            let place = *self.places.entry(note.name).or_insert_with_key(|name| {
                self.columns.push((name.clone(), Vec::new()));
                self.columns.len() - 1
            });
            let column = &mut self.columns[place].1;
            // The rows since the last one with this name have no number for it.
            column.resize(row, f64::NAN);
            column.push(note.value);
        }
    }

    /// The columns for Python: `tick`, then each name in the order in which the names first came.
    pub(crate) fn into_python(self, py: Python<'_>) -> Vec<(String, Py<PyAny>)> {
        let rows = self.ticks.len();
        let tick = ("tick".to_owned(), self.ticks.into_pyarray(py).into_any().unbind());
        let columns = self.columns.into_iter().map(|(name, mut column)| {
            column.resize(rows, f64::NAN);
            (name, column.into_pyarray(py).into_any().unbind())
        });
        std::iter::once(tick).chain(columns).collect()
    }
}
