//! The data of a figure as comma-separated values.
//!
//! Never thins the data: unlike the drawing, a table has every tick.

use super::flight::{Column, ShownEvent};
use std::fmt::Write;

/// Columns of equal length, each with a heading.
pub(super) struct Table {
    text: String,
}

impl Table {
    /// A table of `columns` over time; a value that does not exist is an empty cell.
    pub(super) fn new(times_s: &Column, columns: impl Iterator<Item = (String, Column)>) -> Self {
        Self::with("time_s", times_s, columns)
    }

    /// A table whose first column has the heading `first`.
    pub(super) fn with(
        first: &str,
        leading: &Column,
        columns: impl Iterator<Item = (String, Column)>,
    ) -> Self {
        let (names, columns): (Vec<String>, Vec<Column>) = columns.unzip();
        // The headings come from this program and contain no commas, so they need no quotes.
        let mut text = format!("{first},{}\n", names.join(","));
        for (row, value) in leading.iter().enumerate() {
            push(&mut text, *value);
            for column in &columns {
                text.push(',');
                // A column that is too short gives empty cells, so that every row has equally many.
                push(&mut text, column.get(row).copied().flatten());
            }
            text.push('\n');
        }
        Self { text }
    }

    /// A table of events.
    pub(super) fn of_events(events: &[ShownEvent]) -> Self {
        let mut text = "time_s,name,text\n".to_owned();
        for ShownEvent { time_s, name, text: sentence, .. } in events {
            // Writing to a string cannot fail.
            let _ = writeln!(text, "{time_s},{},{}", quoted(name), quoted(sentence));
        }
        Self { text }
    }

    /// The table as the content of a CSV file.
    pub(super) fn csv(&self) -> &str {
        &self.text
    }
}

fn push(text: &mut String, value: Option<f64>) {
    if let Some(value) = value {
        // Writing to a string cannot fail.
        let _ = write!(text, "{value}");
    }
}

/// `text` in quotes, with the quotes in it doubled.
fn quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('"', "\"\""))
}
