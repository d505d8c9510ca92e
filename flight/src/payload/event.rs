//! An event on its way between processes: JSON in a fixed number of bytes.

use crate::TimedEvent;
use bytemuck::{Pod, Zeroable};

/// Room for the JSON of one event. Less cuts the sentences of long faults; events are rare, so more only costs memory.
const ROOM: usize = 1016;
/// What marks a sentence that was cut to fit.
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
    /// Encodes `event`; a fault's sentence that does not fit is cut, and ends with three dots.
    ///
    /// # Panics
    /// Never: an event without its sentence is far below the room.
    pub fn new(event: &TimedEvent) -> Self {
        let mut text = json(event);
        let mut shorter = event.clone();
        while text.len() > ROOM {
            let excess = text.len() - ROOM;
            let sentence = shorter.event.sentence_mut().expect("only sentences are long");
            cut(sentence, excess);
            text = json(&shorter);
        }
        let mut bytes = [0; ROOM];
        bytes[..text.len()].copy_from_slice(text.as_bytes());
        Self { length: text.len() as u32, reserved: 0, json: bytes }
    }

    /// The event, or `None` if these bytes are not one: another version's, or damaged.
    pub fn event(&self) -> Option<TimedEvent> {
        serde_json::from_slice(self.json.get(..self.length as usize)?).ok()
    }
}

fn json(event: &TimedEvent) -> String {
    serde_json::to_string(event).expect("an event is plain data")
}

/// Shortens `sentence` by at least `excess` bytes, at a character's border.
fn cut(sentence: &mut String, excess: usize) {
    let mut end = sentence.len().saturating_sub(excess + CUT.len());
    while !sentence.is_char_boundary(end) {
        end -= 1;
    }
    sentence.truncate(end);
    sentence.push_str(CUT);
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
    fn bytes_that_are_no_event_are_refused() {
        assert_eq!(EventMessage::zeroed().event(), None);
        assert_eq!(EventMessage { length: u32::MAX, ..EventMessage::zeroed() }.event(), None);
    }
}
