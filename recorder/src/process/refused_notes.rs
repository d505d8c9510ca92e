//! Tells the user of notes that cannot be recorded, once for each UAV and reason.
//!
//! Never decides which notes those are: whoever makes a note does.

use ringwing_flight::{Event, NoteRefusal, Notes, TimedEvent, UavId};
use std::collections::BTreeMap;

/// What was told so far.
#[derive(Debug, Default)]
pub(crate) struct RefusedNotes {
    told: BTreeMap<(UavId, NoteRefusal), Event>,
}

impl RefusedNotes {
    /// What a predecessor has told in these `events`.
    pub(crate) fn after(events: &[TimedEvent]) -> Self {
        let mut known = Self::default();
        for TimedEvent { event, .. } in events {
            if let Event::NoteRefused { uav, why, .. } = event {
                known.told.insert((*uav, *why), event.clone());
            }
        }
        known
    }

    /// What the `notes` of a tick give reason to tell for the first time.
    pub(crate) fn news(&mut self, notes: &[Notes]) -> Vec<Event> {
        let refused = notes.iter().filter_map(|notes| Some((notes.uav, notes.refused()?)));
        let mut news = Vec::new();
        for (uav, (name, why)) in refused {
            self.told.entry((uav, why)).or_insert_with(|| {
                let event = Event::NoteRefused { uav, name: name.to_owned(), why };
                news.push(event.clone());
                event
            });
        }
        news
    }

    /// Everything that was told, as sentences.
    pub(crate) fn sentences(&self) -> Vec<String> {
        // These events name no obstacle.
        self.told.values().map(|event| event.text(|_| String::new())).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ringwing_flight::Tick;

    fn refused(uav: u32, names: &[&str]) -> Notes {
        let mut notes = Notes::default().made_in(Tick(5), UavId(uav));
        for name in names {
            let _ = notes.set(name, 0.0);
        }
        notes
    }

    #[test]
    fn each_uav_and_reason_is_told_once_and_not_again_by_a_successor() {
        let mut first = RefusedNotes::default();
        let news = first.news(&[refused(1, &["fine"]), refused(2, &["not fine", "1"]), refused(3, &[""])]);
        let event = |uav, name: &str| Event::NoteRefused {
            uav: UavId(uav),
            name: name.into(),
            why: NoteRefusal::Name,
        };
        assert_eq!(news, [event(2, "not fine"), event(3, "")]);
        assert_eq!(first.news(&[refused(2, &["again"])]), []);
        let events: Vec<_> = news.into_iter().map(|event| TimedEvent { tick: Tick(5), event }).collect();
        let mut successor = RefusedNotes::after(&events);
        assert_eq!(successor.sentences(), first.sentences());
        assert_eq!(successor.news(&[refused(3, &["2"])]), []);
        let many: Vec<String> = (0..17).map(|number| format!("n{number}")).collect();
        let many: Vec<&str> = many.iter().map(String::as_str).collect();
        let news = successor.news(&[refused(3, &many)]);
        assert!(matches!(&news[..], [Event::NoteRefused { why: NoteRefusal::TooMany, .. }]), "{news:?}");
    }
}
