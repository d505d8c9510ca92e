//! Events: things that happen once and that a person wants to read about.

use crate::Tick;
use iceoryx2::prelude::ZeroCopySend;
use iceoryx2_bb_container::string::{StaticString, String as _};

/// How much an event matters; the names are those of the log's viewers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, ZeroCopySend)]
#[type_name("ringwing.Level.v1")]
#[repr(C)]
pub enum Level {
    /// As planned.
    Info = 0,
    /// Survived.
    Warning = 1,
    /// Something that should not happen did: a collision, a lost process.
    Error = 2,
}

/// Something that happened.
#[derive(Debug, Clone, Copy, ZeroCopySend)]
#[type_name("ringwing.Event.v1")]
#[repr(C)]
pub struct Event {
    /// When, in simulated time.
    pub tick: Tick,
    /// How much it matters.
    pub level: Level,
    name: StaticString<32>,
    text: StaticString<224>,
}

impl Event {
    /// An event of the kind `name` (`collision`, `process.lost`, ...), told in `text`.
    ///
    /// Text that does not fit, or that is not ASCII, is cut there.
    pub fn new(tick: Tick, level: Level, name: &str, text: &str) -> Self {
        Self { tick, level, name: fitting(name), text: fitting(text) }
    }

    /// The kind of event, with dots between its words.
    pub fn name(&self) -> &str {
        self.name.as_str()
    }

    /// What happened, for people.
    pub fn text(&self) -> &str {
        self.text.as_str()
    }
}

fn fitting<const CAPACITY: usize>(text: &str) -> StaticString<CAPACITY> {
    let ascii: String = text.chars().map(|c| if c.is_ascii() { c } else { '?' }).collect();
    StaticString::from_str_truncated(&ascii).unwrap_or_else(|_| StaticString::new())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_event_keeps_what_fits_of_its_text() {
        let event = Event::new(Tick(7), Level::Error, "collision", &"é123456789".repeat(40));
        assert_eq!(event.name(), "collision");
        assert_eq!(event.text().len(), 224);
        assert!(event.text().starts_with("?123456789?"));
    }
}
