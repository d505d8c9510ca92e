//! What a user's controller notes for the log: numbers with names.

use crate::{Tick, UavId};
use bytemuck::{Pod, Zeroable};
use serde::{Deserialize, Serialize};
use std::fmt;

/// Notes of one UAV in one tick. More would make every message larger, also that of a controller with one note.
pub const MAX_NOTES: usize = 16;
/// Bytes of a note's name. More would make every message larger; fewer would not hold a name with its unit.
pub const MAX_NOTE_NAME: usize = 32;
/// Names that the log's tables use themselves.
const RESERVED: [&str; 3] = ["tick", "time_s", "uav"];

/// Why a note is not recorded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum NoteRefusal {
    /// A log cannot have such a name.
    Name,
    /// The tick has [`MAX_NOTES`] others.
    TooMany,
}

impl NoteRefusal {
    /// How a message between processes names it. 0 means that nothing was refused.
    fn number(self) -> u32 {
        match self {
            Self::Name => 1,
            Self::TooMany => 2,
        }
    }

    fn of_number(number: u32) -> Option<Self> {
        [Self::Name, Self::TooMany].into_iter().find(|refusal| refusal.number() == number)
    }
}

impl fmt::Display for NoteRefusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Name => write!(
                f,
                "a name has 1 to {MAX_NOTE_NAME} letters (a to z, A to Z), digits and underscores, begins with a letter, \
                 and is not {}",
                RESERVED.join(", ")
            ),
            Self::TooMany => write!(f, "a controller may note at most {MAX_NOTES} numbers in a tick"),
        }
    }
}

/// The name of a note, filled up with zeros.
#[derive(Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
#[repr(transparent)]
struct NoteName([u8; MAX_NOTE_NAME]);

/// A number with its name.
#[derive(Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
struct Note {
    name: NoteName,
    value: f64,
}

/// What a controller has noted in one tick. The log gets it, and nothing else depends on it.
#[derive(Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Notes {
    /// The tick.
    pub tick: Tick,
    /// The UAV.
    pub uav: UavId,
    /// How many of `notes` are there.
    count: u32,
    /// Why the first refused note was refused; 0 if none was.
    refusal: u32,
    /// Zero; keeps the layout free of padding.
    reserved: u32,
    /// The beginning of the name of the first refused note.
    refused: NoteName,
    notes: [Note; MAX_NOTES],
}

impl NoteName {
    /// The name `text`, which has to be one that a log can have.
    fn parse(text: &str) -> Option<Self> {
        let mut letters = text.bytes();
        let is_name = letters.next().is_some_and(|first| first.is_ascii_alphabetic())
            && letters.all(|letter| letter.is_ascii_alphanumeric() || letter == b'_')
            && text.len() <= MAX_NOTE_NAME
            && !RESERVED.contains(&text);
        is_name.then(|| Self::cut(text))
    }

    /// As much of `text` as there is room for.
    fn cut(text: &str) -> Self {
        let mut length = text.len().min(MAX_NOTE_NAME);
        // Never in the middle of a letter: the rest would be no text.
        while !text.is_char_boundary(length) {
            length -= 1;
        }
        let mut bytes = [0; MAX_NOTE_NAME];
        bytes[..length].copy_from_slice(&text.as_bytes()[..length]);
        Self(bytes)
    }

    /// Its text. Another process may have left any bytes, so what is not a text is empty.
    fn text(&self) -> &str {
        let length = self.0.iter().position(|byte| *byte == 0).unwrap_or(MAX_NOTE_NAME);
        str::from_utf8(&self.0[..length]).unwrap_or_default()
    }
}

impl Notes {
    /// Notes `value` under `name`; a second value under the same name replaces the first one.
    ///
    /// The value may be any number, also NaN or infinite. A name has 1 to [`MAX_NOTE_NAME`] letters, digits and underscores of
    /// ASCII, begins with a letter, and is not `tick`, `time_s` or `uav`.
    ///
    /// # Errors
    /// The name is no such name, or [`MAX_NOTES`] others are there already. The note is then left out, and the log says so.
    pub fn set(&mut self, name: &str, value: f64) -> Result<(), NoteRefusal> {
        let Some(parsed) = NoteName::parse(name) else { return Err(self.refuse(name, NoteRefusal::Name)) };
        let count = self.count();
        let place = self.notes[..count].iter().position(|note| note.name == parsed).unwrap_or(count);
        if place == MAX_NOTES {
            return Err(self.refuse(name, NoteRefusal::TooMany));
        }
        self.notes[place] = Note { name: parsed, value };
        self.count = count.max(place + 1) as u32;
        Ok(())
    }

    /// The same notes, made in `tick` for `uav`.
    #[must_use]
    pub fn made_in(self, tick: Tick, uav: UavId) -> Self {
        Self { tick, uav, ..self }
    }

    fn refuse(&mut self, name: &str, why: NoteRefusal) -> NoteRefusal {
        // One refusal tells the user what to mend. Room for all of them would make every message larger.
        if self.refusal == 0 {
            (self.refusal, self.refused) = (why.number(), NoteName::cut(name));
        }
        why
    }

    fn count(&self) -> usize {
        // The count may come from another process.
        (self.count as usize).min(MAX_NOTES)
    }

    /// The notes: names and values, in the order in which the names came.
    pub fn iter(&self) -> impl Iterator<Item = (&str, f64)> {
        self.notes[..self.count()].iter().map(|note| (note.name.text(), note.value))
    }

    /// The first note that was refused in this tick: the beginning of its name, and why.
    pub fn refused(&self) -> Option<(&str, NoteRefusal)> {
        Some((self.refused.text(), NoteRefusal::of_number(self.refusal)?))
    }

    /// Whether there is nothing to say: no note, and none that was refused.
    pub fn is_empty(&self) -> bool {
        self.count == 0 && self.refusal == 0
    }
}

impl Default for Notes {
    /// No notes.
    fn default() -> Self {
        Self::zeroed()
    }
}

impl fmt::Debug for Notes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_map().entries(self.iter()).finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn listed(notes: &Notes) -> Vec<(String, f64)> {
        notes.iter().map(|(name, value)| (name.to_owned(), value)).collect()
    }

    #[test]
    fn notes_keep_their_order_and_the_last_value_of_a_name() {
        let mut notes = Notes::default();
        assert!(notes.is_empty());
        for (name, value) in [("slot_error_m", 1.5), ("gain", 2.0), ("slot_error_m", f64::INFINITY)] {
            notes.set(name, value).unwrap();
        }
        assert_eq!(listed(&notes), [("slot_error_m".into(), f64::INFINITY), ("gain".into(), 2.0)]);
        assert_eq!((notes.refused(), notes.is_empty()), (None, false));
        assert_eq!(format!("{notes:?}"), r#"{"slot_error_m": inf, "gain": 2.0}"#);
    }

    #[test]
    fn a_name_that_a_log_cannot_have_is_refused_and_the_first_one_is_remembered() {
        let long = "a".repeat(MAX_NOTE_NAME + 1);
        for name in ["", "slot error", "1st", "_x", "naïve", "a.b", "tick", "uav", "time_s", &long] {
            let mut notes = Notes::default();
            assert_eq!(notes.set(name, 1.0), Err(NoteRefusal::Name), "{name}");
            notes.set("9", 1.0).unwrap_err();
            assert!(listed(&notes).is_empty() && !notes.is_empty(), "{name}");
            let (refused, why) = notes.refused().unwrap();
            assert!(name.starts_with(refused) && (name.is_empty() || refused.len() > 1), "{name}: {refused}");
            assert_eq!(why, NoteRefusal::Name);
        }
        Notes::default().set(&long[1..], 1.0).unwrap();
        // A cut in the middle of a letter would be no text.
        let mut notes = Notes::default();
        notes.set(&"ä".repeat(40), 1.0).unwrap_err();
        assert_eq!(notes.refused().unwrap().0, "ä".repeat(16));
    }

    #[test]
    fn one_note_too_many_is_refused_but_a_known_name_still_gets_its_value() {
        let mut notes = Notes::default();
        for number in 0..MAX_NOTES {
            notes.set(&format!("n{number}"), 0.0).unwrap();
        }
        assert_eq!(notes.set("one_more", 1.0), Err(NoteRefusal::TooMany));
        notes.set("n15", f64::NAN).unwrap();
        assert_eq!(notes.refused(), Some(("one_more", NoteRefusal::TooMany)));
        let (name, value) = listed(&notes).pop().unwrap();
        assert!(name == "n15" && value.is_nan());
    }

    #[test]
    fn any_bytes_of_another_process_can_be_read() {
        let notes: Notes = bytemuck::pod_read_unaligned(&[0xFF; size_of::<Notes>()]);
        assert_eq!(notes.iter().count(), MAX_NOTES);
        assert!(notes.iter().all(|(name, _)| name.is_empty()));
        assert_eq!((notes.refused(), notes.is_empty()), (None, false));
    }
}
