//! Faults that somebody asked for during the flight: which events and messages are about them.
//!
//! A flight that repeats one with requests has their faults in its scenario, so nobody asks for them again. Must never decide
//! whether a flight can be repeated.

use prost_reflect::prost::Message;
use ringwing_flight::Event;
use ringwing_recorder::{
    log::reader::LogMessage,
    schema::{LoggedEvent, topics},
};

/// Whether somebody asked for a fault. The user chose the moment, but the log holds it.
pub(super) fn is_request(event: &Event) -> bool {
    matches!(event, Event::FaultRequested { .. })
}

/// Whether a request was refused as a whole.
pub(super) fn is_refused_request(event: &Event) -> bool {
    matches!(event, Event::FaultRefused { part: None, .. })
}

/// Whether a flight in which nobody asks for the faults has this message as well.
pub(super) fn is_independent(message: &LogMessage) -> bool {
    match message.topic.name.as_str() {
        // `/log` repeats the events in sentences, and `/links` counts from the beginning of the flight.
        topics::LOG | topics::LINKS => false,
        topics::EVENTS => !is_about_request(message),
        _ => true,
    }
}

fn is_about_request(message: &LogMessage) -> bool {
    let logged = LoggedEvent::decode(message.data.as_slice()).ok();
    let event = logged.and_then(|logged| logged.event()).map(|timed| timed.event);
    event.is_some_and(|event| is_request(&event) || is_refused_request(&event))
}
