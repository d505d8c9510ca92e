//! Puts the flight together again from the messages of its log.
//!
//! Must never open a file: the caller, a new recorder or a tool, reads the log and hands in its messages.

use super::gap::Gaps;
use crate::{
    metrics::{FlownRing, Frame, Metrics, UavFrame},
    schema::{
        LinkCounts, LoggedEvent, Timing, UavControl, UavState,
        topics::{self, UavTopic},
    },
    show::view::Viewer,
};
use foxglove::messages::PoseInFrame;
use nalgebra::Point2;
use prost::Message;
use ringwing_flight::TimedEvent;
use ringwing_scenario::Scenario;

/// Everything that a log holds about one tick.
#[derive(Debug, Clone)]
pub struct Replayed {
    /// The flight. Its leader is absent, because the log records the leader less often.
    pub frame: Frame,
    /// Where the leader is, in ticks in which the log has it.
    pub leader: Option<Point2<f64>>,
    /// How long the tick took, in logs with timing.
    pub timing: Option<Timing>,
    /// The events that the log has in this tick.
    pub events: Vec<TimedEvent>,
    /// Whether the log has sentences for viewers in this tick.
    pub has_lines: bool,
    /// Number of messages of all topics.
    pub messages: u64,
    /// Number of messages that repeat another one of the tick.
    pub doubled: u64,
    /// A topic that has two different messages in this tick, as only the logs of two flights together have it.
    pub conflict: Option<String>,
}

/// Puts the messages of a log together again, tick by tick.
#[derive(Debug)]
pub(crate) struct Replay {
    tick: Replayed,
    /// Whether a message of the tick has come.
    begun: bool,
    ring: FlownRing,
}

impl Replay {
    /// A replay of a flight of `scenario`.
    pub(crate) fn new(scenario: &Scenario) -> Self {
        let ring = FlownRing::new(scenario);
        Self { tick: Replayed::blank(0, &ring), begun: false, ring }
    }

    /// Takes a message of `tick`; the messages of one tick come together. Returns the previous tick when a new one
    /// begins.
    pub(crate) fn take(&mut self, topic: &str, tick: i64, data: &[u8]) -> Option<Replayed> {
        let before = if tick == self.tick.frame.tick { None } else { self.turn_to(tick) };
        self.tick.messages += 1;
        // Only a message that was understood makes a tick: one of an unknown topic must not yield an empty one.
        self.begun |= self.place(topic, data).is_some();
        before
    }

    /// Hands out the tick that is being put together.
    pub(crate) fn end(&mut self) -> Option<Replayed> {
        self.turn_to(0)
    }

    fn turn_to(&mut self, tick: i64) -> Option<Replayed> {
        if !std::mem::take(&mut self.begun) {
            self.tick.frame.tick = tick;
            return None;
        }
        let mut whole = std::mem::replace(&mut self.tick, Replayed::blank(tick, &self.ring));
        // A tick that has only events does not show who flies.
        if whole.has_uavs() {
            self.ring.follow(whole.frame.tick, |number| whole.frame.commanded(number).is_some());
            whole.frame.ring.clone_from(&self.ring);
        }
        Some(whole)
    }

    /// Puts a message into its place in the tick. `None` if its topic is unknown or its data are damaged.
    fn place(&mut self, topic: &str, data: &[u8]) -> Option<()> {
        match topic {
            topics::EVENTS => {
                let event = LoggedEvent::decode(data).ok()?.event()?;
                self.tick.doubled += add_once(&mut self.tick.events, event);
            }
            topics::LOG => self.tick.has_lines = true,
            topics::LINKS => {
                let counts = LinkCounts::decode(data).ok()?.counts();
                self.tick.doubled += add_once(&mut self.tick.frame.links, counts);
            }
            topics::TIMING => self.tick.timing = Some(Timing::decode(data).ok()?),
            topics::LEADER_POSE => {
                // Not the leader of the frame, which would then come and go from tick to tick.
                let position = PoseInFrame::decode(data).ok()?.pose?.position?;
                self.tick.leader = Some(Point2::new(position.x, position.y));
            }
            // Scenes, map, metrics and faults only show what the states and events hold, so they are not read back.
            _ => self.place_uav(topic, data)?,
        }
        Some(())
    }

    fn place_uav(&mut self, topic: &str, data: &[u8]) -> Option<()> {
        let placed = match UavTopic::parse(topic)? {
            // Nothing is measured by them, so they are not read back.
            UavTopic::Notes => return Some(()),
            UavTopic::State => {
                let message = UavState::decode(data).ok()?;
                set_once(&mut self.uav(message.uav)?.state, message.state())
            }
            UavTopic::Control => {
                let message = UavControl::decode(data).ok()?;
                set_once(&mut self.uav(message.uav)?.control, message.terms())
            }
        };
        match placed {
            Placed::New => {}
            Placed::Again => self.tick.doubled += 1,
            Placed::Different => drop(self.tick.conflict.get_or_insert_with(|| topic.to_owned())),
        }
        Some(())
    }

    fn uav(&mut self, number: u32) -> Option<&mut UavFrame> {
        // The number comes from a file that may be damaged: it may be 0, or larger than the swarm.
        self.tick.frame.uavs.get_mut(number.checked_sub(1)? as usize)
    }
}

/// What a message meant for a place that holds one message a tick.
enum Placed {
    New,
    /// The place holds an equal one already.
    Again,
    /// The place holds another one.
    Different,
}

/// Puts `found` into `place` unless something is there already.
fn set_once<T: PartialEq>(place: &mut Option<T>, found: T) -> Placed {
    match place {
        None => {
            *place = Some(found);
            Placed::New
        }
        Some(known) if *known == found => Placed::Again,
        Some(_) => Placed::Different,
    }
}

/// Adds `found` to the list unless it has an equal one; returns how many were left out. Programs that join parts of a log
/// may copy a message twice.
fn add_once<T: PartialEq>(list: &mut Vec<T>, found: T) -> u64 {
    let is_known = list.contains(&found);
    if !is_known {
        list.push(found);
    }
    is_known.into()
}

impl Replayed {
    fn blank(tick: i64, ring: &FlownRing) -> Self {
        Self {
            frame: Frame::blank(tick, ring.clone()),
            leader: None,
            timing: None,
            events: Vec::new(),
            has_lines: false,
            messages: 0,
            doubled: 0,
            conflict: None,
        }
    }

    /// Whether the log has anything of any UAV.
    pub fn has_uavs(&self) -> bool {
        self.frame.uavs.iter().any(|uav| uav.state.is_some() || uav.control.is_some())
    }
}

/// What a recorder knows from the messages of its predecessor: the same as if it had recorded them itself.
#[derive(Debug)]
pub(crate) struct Past {
    /// The flight measured.
    pub(crate) metrics: Metrics,
    /// The ticks that are missing.
    pub(crate) gaps: Gaps,
    /// What viewers were shown.
    pub(crate) viewer: Viewer,
    /// The events in the log.
    pub(crate) events: Vec<TimedEvent>,
    /// Whether `/log` has its first line, the introduction.
    pub(crate) has_introduction: bool,
    replay: Replay,
}

impl Past {
    /// What is known before the first message.
    pub(crate) fn new(scenario: &Scenario) -> Self {
        Self {
            metrics: Metrics::new(scenario),
            gaps: Gaps::default(),
            viewer: Viewer::new(scenario),
            events: Vec::new(),
            has_introduction: false,
            replay: Replay::new(scenario),
        }
    }

    /// Takes a message of `tick`.
    pub(crate) fn learn(&mut self, topic: &str, tick: u32, data: &[u8]) {
        if let Some(before) = self.replay.take(topic, tick.into(), data) {
            self.learn_tick(before);
        }
    }

    /// Takes in the last tick, once there are no more messages.
    pub(crate) fn end(&mut self) {
        if let Some(last) = self.replay.end() {
            self.learn_tick(last);
        }
    }

    fn learn_tick(&mut self, tick: Replayed) {
        // In the order in which a recorder takes events and frames, so that a successor is in the state of its
        // predecessor.
        for event in &tick.events {
            self.viewer.on_event(&event.event);
            self.metrics.on_event(event);
        }
        if tick.has_uavs() {
            self.gaps.pass(tick.frame.tick);
            self.metrics.observe(&tick.frame);
            self.viewer.observe(&tick.frame);
        }
        self.events.extend(tick.events);
        self.has_introduction |= tick.has_lines;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        log::reader::Reader,
        testing::{flight, place, recording, ring_of},
    };
    use ringwing_flight::{AfterLoss, Event, FlightMode, Part, ProcessEnd, Tick, UavId};

    fn lost(tick: i64, uav: u32) -> TimedEvent {
        let (end, then) = (ProcessEnd::Killed(9), AfterLoss::Failsafe { before_flight: false });
        TimedEvent {
            tick: Tick(tick),
            event: Event::ProcessLost { part: Part::Agent(UavId(uav)), end, then },
        }
    }

    #[test]
    fn a_log_that_is_read_again_gives_the_same_metrics_to_the_bit() {
        let (_folder, path) = place();
        let mut scenario = ring_of(6, 40.0);
        scenario.control.ring_closes = true;
        let mut recording = recording(&path, &scenario);
        // One loss in time, one that is reported late, one after the last frame, and one after the end of the flight.
        recording.log_event(lost(40, 2));
        for mut frame in flight(&scenario, 0..150) {
            if frame.tick == 100 {
                recording.log_event(lost(90, 3));
            }
            if frame.tick >= 60 {
                frame.uavs[1].state.as_mut().unwrap().mode = FlightMode::LOITER;
                frame.ring.follow(frame.tick, |number| number != 2);
            }
            recording.observe(&frame, None).unwrap();
        }
        recording.log_event(lost(149, 5));
        recording.log_event(lost(170, 6));
        recording.finish(None).unwrap();

        let mut metrics = Metrics::new(&scenario);
        for tick in Reader::open(&path).unwrap().ticks(&scenario) {
            tick.events.iter().for_each(|event| metrics.on_event(event));
            if tick.has_uavs() {
                metrics.observe(&tick.frame);
            }
        }
        let summary = metrics.summary();
        assert_eq!(summary, recording.report().summary);
        assert_eq!((summary.faults, summary.recoveries.len()), (3, 3));
    }
}
