//! The flight again, from the messages of its log.
//!
//! Knows no file: whoever reads one, a new recorder or a tool, hands the messages in.

use crate::{
    events::LoggedEvent,
    frame::{Frame, UavFrame},
    log::{EVENTS_TOPIC, LINKS_TOPIC, LOG_TOPIC, gap::Gaps},
    metrics::Metrics,
    schema::{Timing, UavControl, UavState},
    show::{links::LinkCounts, view::Viewer},
};
use foxglove::messages::PoseInFrame;
use nalgebra::Point2;
use prost::Message;
use ringwing_flight::TimedEvent;
use ringwing_scenario::Scenario;

/// Everything that a log tells of one tick.
#[derive(Debug, Clone, Default)]
pub struct Replayed {
    /// What was flown; its leader is left out, as the log tells it less often.
    pub frame: Frame,
    /// Where the leader is, in ticks in which the log tells it.
    pub leader: Option<Point2<f64>>,
    /// The events that the log has in this tick.
    pub events: Vec<TimedEvent>,
    /// The log has sentences for viewers in this tick.
    pub has_lines: bool,
    /// Messages of all topics.
    pub messages: u64,
}

/// Puts the messages of a log together again, tick by tick.
#[derive(Debug)]
pub(crate) struct Replay {
    tick: Replayed,
    /// A message of the tick has come.
    begun: bool,
    uavs: usize,
}

impl Replay {
    /// Of a swarm of `uavs`.
    pub(crate) fn new(uavs: u32) -> Self {
        let uavs = uavs as usize;
        Self { tick: blank(0, uavs), begun: false, uavs }
    }

    /// Takes a message of `tick`; messages of one tick come together. Hands out the tick before, if this begins another.
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
        Some(std::mem::replace(&mut self.tick, blank(tick, self.uavs)))
    }

    /// Puts a message where it belongs; one that is not known, or no message at all, belongs nowhere.
    fn place(&mut self, topic: &str, data: &[u8]) -> Option<()> {
        match topic {
            EVENTS_TOPIC => self.tick.events.push(LoggedEvent::decode(data).ok()?.event()?),
            LOG_TOPIC => self.tick.has_lines = true,
            LINKS_TOPIC => self.tick.frame.links.push(LinkCounts::decode(data).ok()?),
            "/timing" => self.tick.frame.timing = Some(Timing::decode(data).ok()?),
            "/leader/pose" => {
                let place = PoseInFrame::decode(data).ok()?.pose?.position?;
                self.tick.leader = Some(Point2::new(place.x, place.y));
            }
            _ => self.place_uav(topic, data)?,
        }
        Some(())
    }

    fn place_uav(&mut self, topic: &str, data: &[u8]) -> Option<()> {
        let (_number, kind) = topic.strip_prefix("/uav/")?.split_once('/')?;
        match kind {
            "state" => {
                let state = UavState::decode(data).ok()?;
                let uav = self.uav(state.uav)?;
                uav.state = Some(state);
            }
            "control" => {
                let control = UavControl::decode(data).ok()?;
                let uav = self.uav(control.uav)?;
                uav.control = Some(control);
            }
            _ => return None,
        }
        Some(())
    }

    fn uav(&mut self, number: u32) -> Option<&mut UavFrame> {
        self.tick.frame.uavs.get_mut(number.checked_sub(1)? as usize)
    }
}

fn blank(tick: i64, uavs: usize) -> Replayed {
    let mut blank = Replayed::default();
    blank.frame.tick = tick;
    blank.frame.uavs.resize_with(uavs, UavFrame::default);
    blank
}

impl Replayed {
    /// Whether anything is known of any UAV.
    pub fn has_uavs(&self) -> bool {
        self.frame.uavs.iter().any(|uav| uav.state.is_some() || uav.control.is_some())
    }
}

/// What a recorder learns from the messages of its predecessor: the same as if it had been there.
#[derive(Debug)]
pub(crate) struct Past {
    /// What was measured.
    pub(crate) metrics: Metrics,
    /// What was lost.
    pub(crate) gaps: Gaps,
    /// What viewers were shown.
    pub(crate) viewer: Viewer,
    /// What is in `/events`.
    pub(crate) events: Vec<TimedEvent>,
    /// The log says already what flies: that is the first line of `/log`.
    pub(crate) has_introduction: bool,
    replay: Replay,
}

impl Past {
    /// Nothing has happened yet.
    pub(crate) fn new(scenario: &Scenario) -> Self {
        let replay = Replay::new(scenario.formation.uavs);
        Self {
            metrics: Metrics::new(scenario),
            gaps: Gaps::default(),
            viewer: Viewer::new(scenario),
            events: Vec::new(),
            has_introduction: false,
            replay,
        }
    }

    /// Learns from a message of `tick`.
    pub(crate) fn learn(&mut self, topic: &str, tick: u32, data: &[u8]) {
        if let Some(before) = self.replay.take(topic, tick, data) {
            self.learn_tick(before);
        }
    }

    /// Learns that there are no more messages.
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
