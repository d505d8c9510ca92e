//! Events as the log keeps them: `/events` with every field, for programs, and `/log` with the sentence, for viewers.
//!
//! Must never read a sentence back: a log that is read again takes its events from the JSON in `/events`.

use crate::clock::Clock;
use foxglove::messages::{Log, log};
use ringwing_flight::{Collider, Event, Level, Part, TimedEvent, UavId};
use ringwing_scenario::Scenario;

/// One event with every field that it has: `/events`.
///
/// The fields before `json` repeat what is in it, so that tables and queries need no JSON.
#[derive(Clone, PartialEq, foxglove::Encode, prost::Message)]
pub struct LoggedEvent {
    /// The tick at which it happened.
    #[prost(sint64, tag = "1")]
    pub tick: i64,
    /// The kind of event: `collision`, `process.lost`, `fault.kill`.
    #[prost(string, tag = "2")]
    pub kind: String,
    /// How much it matters: `info`, `warning` or `error`.
    #[prost(string, tag = "3")]
    pub level: String,
    /// The number of the UAV concerned, from 1; 0 if the event concerns no UAV.
    #[prost(uint32, tag = "4")]
    pub uav: u32,
    /// The number of the second UAV of a collision or a near miss; 0 if only one UAV is involved.
    #[prost(uint32, tag = "5")]
    pub other_uav: u32,
    /// The node name of the process concerned, such as `agent-3`; empty if the event concerns no process.
    #[prost(string, tag = "6")]
    pub process: String,
    /// The name of the obstacle that a UAV collided with; empty if it hit no obstacle.
    #[prost(string, tag = "7")]
    pub obstacle: String,
    /// Where it happened, east, in the local frame.
    #[prost(double, optional, tag = "8")]
    pub x_m: Option<f64>,
    /// Where it happened, north.
    #[prost(double, optional, tag = "9")]
    pub y_m: Option<f64>,
    /// The sentence that asked for the fault; empty if nobody asked for the event.
    #[prost(string, tag = "10")]
    pub sentence: String,
    /// The event in one sentence, as `/log` has it.
    #[prost(string, tag = "11")]
    pub text: String,
    /// The whole event as JSON.
    #[prost(string, tag = "12")]
    pub json: String,
    // A new field takes the next tag, wherever it stands: readers know the fields of earlier logs by their tags.
    /// The number of the intruder concerned, from 1; 0 if the event concerns no intruder.
    #[prost(uint32, tag = "13")]
    pub intruder: u32,
}

impl LoggedEvent {
    /// The event, or `None` if another version wrote it in a form that this one does not know.
    pub fn event(&self) -> Option<TimedEvent> {
        serde_json::from_str(&self.json).ok()
    }
}

/// Makes the log's messages about events.
#[derive(Debug, Clone)]
pub(crate) struct EventWriter {
    clock: Clock,
    /// Names the obstacles that events refer to.
    scenario: Scenario,
}

impl EventWriter {
    /// For the events of a flight of `scenario`.
    pub(crate) fn new(scenario: &Scenario) -> Self {
        Self { clock: Clock::new(scenario.time.rate_hz), scenario: scenario.clone() }
    }

    /// The message for `/events`.
    pub(crate) fn message(&self, timed: &TimedEvent) -> LoggedEvent {
        let event = &timed.event;
        // Absent and not 0 without a place: the origin is a place, too.
        let [x_m, y_m] = position_m(event).map_or([None; 2], |position_m| position_m.map(Some));
        let collider = collider(event);
        LoggedEvent {
            tick: timed.tick.0,
            kind: event.name().into(),
            level: level_name(event.level()).into(),
            uav: uav(event).map_or(0, |uav| uav.0),
            other_uav: match collider {
                Some(Collider::Uav(other)) => other.0,
                _ => 0,
            },
            process: part(event).map_or_else(String::new, Part::node_name),
            obstacle: match collider {
                Some(Collider::Obstacle(index)) => self.scenario.obstacle_name(index),
                _ => String::new(),
            },
            x_m,
            y_m,
            sentence: sentence(event).into(),
            text: self.scenario.event_text(event),
            // Whole, because readers take the event from here: the fields above hold only what tables have columns for.
            json: serde_json::to_string(timed).expect("an event is plain data"),
            intruder: match collider {
                Some(Collider::Intruder(intruder)) => intruder.0,
                _ => 0,
            },
        }
    }

    /// The line for `/log`.
    pub(crate) fn line(&self, timed: &TimedEvent) -> Log {
        let event = &timed.event;
        log_line(self.clock, timed.tick.0, event.level(), event.name(), &self.scenario.event_text(event))
    }
}

/// A line of `/log`: something of the kind `name` happened at `tick`.
pub(crate) fn log_line(clock: Clock, tick: i64, level: Level, name: &str, text: &str) -> Log {
    let level = match level {
        Level::Info => log::Level::Info,
        Level::Warning => log::Level::Warning,
        Level::Error => log::Level::Error,
    };
    Log {
        timestamp: Some(clock.timestamp(tick)),
        level: level.into(),
        message: text.into(),
        name: name.into(),
        ..Log::default()
    }
}

fn level_name(level: Level) -> &'static str {
    match level {
        Level::Info => "info",
        Level::Warning => "warning",
        Level::Error => "error",
    }
}

/// The UAV concerned: the one that an event names, or the one whose agent it names.
fn uav(event: &Event) -> Option<UavId> {
    match event {
        Event::Collision { uav, .. }
        | Event::NearMiss { uav, .. }
        | Event::Failsafe { uav, .. }
        | Event::WishNotFinite { uav }
        | Event::NoteRefused { uav, .. } => Some(*uav),
        // So a search for a UAV also finds what happened to the process of its agent.
        other => match part(other) {
            Some(Part::Agent(uav)) => Some(uav),
            _ => None,
        },
    }
}

/// The process concerned.
fn part(event: &Event) -> Option<Part> {
    match event {
        Event::ProcessLost { part, .. }
        | Event::ProcessReady { part }
        | Event::ProcessFrozen { part }
        | Event::ProcessThawed { part }
        | Event::StartOverdue { part }
        | Event::ThawOverdue { part }
        | Event::ProcessSilent { part, .. }
        | Event::FaultLate { part, .. }
        | Event::ProcessFault { part, .. } => Some(*part),
        // A refused sentence may name no process at all.
        Event::FaultRefused { part, .. } => *part,
        _ => None,
    }
}

/// The sentence that asked for the fault; empty if nobody asked.
fn sentence(event: &Event) -> &str {
    match event {
        Event::ProcessFault { sentence, .. }
        | Event::FaultRefused { sentence, .. }
        | Event::FaultLate { sentence, .. }
        | Event::FaultRequested { sentence }
        | Event::LinkFault { sentence }
        | Event::SlowFault { sentence }
        | Event::AirframeFault { sentence }
        | Event::FaultHealed { sentence } => sentence,
        _ => "",
    }
}

fn collider(event: &Event) -> Option<Collider> {
    match event {
        Event::Collision { with, .. } | Event::NearMiss { with, .. } => Some(*with),
        _ => None,
    }
}

fn position_m(event: &Event) -> Option<[f64; 2]> {
    match event {
        Event::Collision { position_m, .. } | Event::NearMiss { position_m, .. } => Some(*position_m),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing;
    use ringwing_flight::{IntruderId, ProcessAction, Tick};

    fn at(tick: i64, event: Event) -> TimedEvent {
        TimedEvent { tick: Tick(tick), event }
    }

    #[test]
    fn a_message_has_each_field_of_its_event_and_gives_it_back() {
        let mut scenario = testing::ring_of(6, 40.0);
        scenario.obstacles = vec![testing::obstacle([0.0, 0.0])];
        let writer = EventWriter::new(&scenario);
        let hit =
            at(7, Event::Collision { uav: UavId(3), with: Collider::Obstacle(0), position_m: [1.5, -2.0] });
        let message = writer.message(&hit);
        assert_eq!((message.tick, &*message.kind, &*message.level), (7, "collision", "error"));
        assert_eq!((message.uav, message.other_uav, &*message.obstacle), (3, 0, "tower"));
        assert_eq!((message.x_m, message.y_m, &*message.process), (Some(1.5), Some(-2.0), ""));
        assert_eq!(message.text, "uav 3 and tower at (1.5, -2.0) m");
        assert_eq!(message.event(), Some(hit));
        let with = Collider::Intruder(IntruderId(2));
        let message = writer.message(&at(8, Event::Collision { uav: UavId(3), with, position_m: [0.0; 2] }));
        assert_eq!((message.intruder, message.other_uav, &*message.obstacle), (2, 0, ""));
        let part = Part::Agent(UavId(2));
        let kill =
            at(9, Event::ProcessFault { part, action: ProcessAction::Stop, sentence: "stop uav 2".into() });
        let message = writer.message(&kill);
        assert_eq!((message.uav, &*message.process, &*message.sentence), (2, "agent-2", "stop uav 2"));
        assert_eq!((message.x_m, message.event()), (None, Some(kill)));
    }

    #[test]
    fn an_event_of_an_unknown_kind_is_not_read() {
        let message =
            LoggedEvent { json: "{\"tick\":3,\"kind\":\"of_the_future\"}".into(), ..LoggedEvent::default() };
        assert_eq!(message.event(), None);
    }
}
