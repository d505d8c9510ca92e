//! An event on its way between processes: JSON in a fixed number of bytes.

use crate::TimedEvent;
use bytemuck::{Pod, Zeroable};

/// Room for the JSON of one event, in bytes. Less cuts the sentences of more faults. More only costs memory, because
/// events are rare.
const ROOM: usize = 1016;
/// Ends a text that was cut to fit.
const CUT: &str = "...";

/// A [`TimedEvent`] as bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct EventMessage {
    length: u32,
    /// Zero; keeps the layout free of padding.
    reserved: u32,
    json: [u8; ROOM],
}

impl EventMessage {
    /// Encodes `event`. Texts that do not fit are cut, the longest first, and then end with three dots.
    ///
    /// # Panics
    /// Never: without its texts every event is far shorter than the room.
    pub fn new(event: &TimedEvent) -> Self {
        let mut text = json(event);
        let mut shorter = event.clone();
        // A cut by the excess may not suffice: escaped characters take more bytes in JSON than in the sentence.
        while text.len() > ROOM {
            let excess = text.len() - ROOM;
            cut(shorter.event.longest_text_mut().expect("only texts are long"), excess);
            text = json(&shorter);
        }
        let mut bytes = [0; ROOM];
        bytes[..text.len()].copy_from_slice(text.as_bytes());
        Self { length: text.len() as u32, reserved: 0, json: bytes }
    }

    /// The event; `None` if the bytes are damaged or come from another version.
    pub fn event(&self) -> Option<TimedEvent> {
        // The length comes from shared memory and may be any number.
        serde_json::from_slice(self.json.get(..self.length as usize)?).ok()
    }
}

fn json(event: &TimedEvent) -> String {
    serde_json::to_string(event).expect("an event is plain data")
}

/// Shortens `text` by at least `excess` bytes, or to the dots alone, at the end of a character.
fn cut(text: &mut String, excess: usize) {
    let mut end = text.len().saturating_sub(excess + CUT.len());
    // `truncate` panics within a character. This loop ends at 0 at the latest.
    while !text.is_char_boundary(end) {
        end -= 1;
    }
    text.truncate(end);
    text.push_str(CUT);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Collider, Event, Tick, UavId};

    #[test]
    fn an_event_arrives_as_it_was_sent() {
        let event = Event::Collision { uav: UavId(3), with: Collider::Obstacle(1), position_m: [1.5, -2.0] };
        let sent = TimedEvent { tick: Tick(7), event };
        assert_eq!(EventMessage::new(&sent).event(), Some(sent));
    }

    #[test]
    fn a_long_sentence_is_cut_and_says_so() {
        let long = "link 2->3 delay trace {\"é\" ms}".repeat(100);
        let event = Event::LinkFault { sentence: long.clone() };
        let message = EventMessage::new(&TimedEvent { tick: Tick(7), event });
        let Some(TimedEvent { event: Event::LinkFault { sentence }, .. }) = message.event() else {
            panic!("{message:?}");
        };
        assert!(sentence.ends_with(CUT) && long.starts_with(sentence.trim_end_matches(CUT)));
        assert!(sentence.len() > ROOM / 2, "cut no more than needed");
    }

    #[test]
    fn an_event_with_two_long_texts_still_fits() {
        let long = |letter: &str| letter.repeat(5000);
        let event = Event::FaultRefused { part: None, why: long("w"), sentence: long("s") };
        let message = EventMessage::new(&TimedEvent { tick: Tick(7), event });
        let Some(TimedEvent { event: Event::FaultRefused { why, sentence, .. }, .. }) = message.event()
        else {
            panic!("{message:?}");
        };
        assert!(why.ends_with(CUT) && sentence.ends_with(CUT), "{why} {sentence}");
    }

    #[test]
    fn bytes_that_are_no_event_are_refused() {
        assert_eq!(EventMessage::zeroed().event(), None);
        assert_eq!(EventMessage { length: u32::MAX, ..EventMessage::zeroed() }.event(), None);
    }
}
