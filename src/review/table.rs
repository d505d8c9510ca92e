//! A figure's data as comma-separated values, all of them.

use super::flight::{Column, Happening};
use std::fmt::Write;

/// Columns with a heading each.
pub(super) struct Table {
    text: String,
}

impl Table {
    /// `columns` over time.
    pub(super) fn new(times_s: &Column, columns: impl Iterator<Item = (String, Column)>) -> Self {
        let (names, columns): (Vec<String>, Vec<Column>) = columns.unzip();
        let mut text = format!("time_s,{}\n", names.join(","));
        for (tick, time_s) in times_s.iter().enumerate() {
            push(&mut text, *time_s);
            for column in &columns {
                text.push(',');
                push(&mut text, column.get(tick).copied().flatten());
            }
            text.push('\n');
        }
        Self { text }
    }

    /// What happened.
    pub(super) fn of_happenings(happenings: &[Happening]) -> Self {
        let mut text = "time_s,name,text\n".to_owned();
        for Happening { time_s, name, text: what } in happenings {
            // Writing to a string cannot fail.
            let _ = writeln!(text, "{time_s},{},{}", quoted(name), quoted(what));
        }
        Self { text }
    }

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

fn quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('"', "\"\""))
}
