//! Puts the flight together again from the messages of its log.
//!
//! Must never know a file: whoever reads one, a new recorder or a tool, hands the messages in.

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

/// Everything that a log has of one tick.
#[derive(Debug, Clone)]
pub struct Replayed {
    /// The flight. Its leader is absent, because the log has the leader less often.
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
}

/// Puts the messages of a log together again, tick by tick.
#[derive(Debug)]
pub(crate) struct Replay {
    tick: Replayed,
    /// A message of the tick has come.
    begun: bool,
    ring: FlownRing,
}

impl Replay {
    /// Of a flight of `scenario`.
    pub(crate) fn new(scenario: &Scenario) -> Self {
        let ring = FlownRing::new(scenario);
        Self { tick: Replayed::blank(0, &ring), begun: false, ring }
    }

    /// Takes a message of `tick`; the messages of one tick come together. Hands out the tick before, if this begins another.
    pub(crate) fn take(&mut self, topic: &str, tick: u32, data: &[u8]) -> Option<Replayed> {
        let before = if i64::from(tick) == self.tick.frame.tick { None } else { self.turn_to(tick.into()) };
        self.tick.messages += 1;
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
            self.ring.follow(|number| whole.frame.commanded(number).is_some());
            whole.frame.ring.clone_from(&self.ring);
        }
        Some(whole)
    }

    /// Puts a message into its place in the tick. `None` if its topic is unknown or its data are damaged.
    fn place(&mut self, topic: &str, data: &[u8]) -> Option<()> {
        match topic {
            topics::EVENTS => self.tick.events.push(LoggedEvent::decode(data).ok()?.event()?),
            topics::LOG => self.tick.has_lines = true,
            topics::LINKS => self.tick.frame.links.push(LinkCounts::decode(data).ok()?.counts()),
            topics::TIMING => self.tick.timing = Some(Timing::decode(data).ok()?),
            topics::LEADER_POSE => {
                let position = PoseInFrame::decode(data).ok()?.pose?.position?;
                self.tick.leader = Some(Point2::new(position.x, position.y));
            }
            _ => self.place_uav(UavTopic::parse(topic)?, data)?,
        }
        Some(())
    }

    fn place_uav(&mut self, topic: UavTopic, data: &[u8]) -> Option<()> {
        match topic {
            UavTopic::State => {
                let message = UavState::decode(data).ok()?;
                self.uav(message.uav)?.state = Some(message.state());
            }
            UavTopic::Control => {
                let message = UavControl::decode(data).ok()?;
                self.uav(message.uav)?.control = Some(message.terms());
            }
        }
        Some(())
    }

    fn uav(&mut self, number: u32) -> Option<&mut UavFrame> {
        self.tick.frame.uavs.get_mut(number.checked_sub(1)? as usize)
    }
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
    /// Before any message.
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
        if let Some(before) = self.replay.take(topic, tick, data) {
            self.learn_tick(before);
        }
    }

    /// There are no more messages.
    pub(crate) fn end(&mut self) {
        if let Some(last) = self.replay.end() {
            self.learn_tick(last);
        }
    }

    fn learn_tick(&mut self, tick: Replayed) {
        for event in &tick.events {
            self.viewer.on_event(&event.event);
            self.metrics.on_event(event);
        }
        if tick.has_uavs() {
            self.gaps.pass(tick.frame.tick, false);
            self.metrics.observe(&tick.frame);
            self.viewer.observe(&tick.frame);
        }
        self.events.extend(tick.events);
        self.has_introduction |= tick.has_lines;
    }
}
