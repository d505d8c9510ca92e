//! What a recorder learns from the messages that its predecessor recorded: the same as if it had been there.

use crate::{
    frame::{Frame, UavFrame},
    gap::Gaps,
    log::LOG_TOPIC,
    metrics::Metrics,
    schema::{UavControl, UavState},
};
use foxglove::messages::Log as Line;
use prost::Message;
use ringwing_scenario::Scenario;

/// The flight so far.
#[derive(Debug)]
pub(crate) struct Past {
    /// What was measured.
    pub(crate) metrics: Metrics,
    /// What was lost.
    pub(crate) gaps: Gaps,
    /// What was told.
    pub(crate) lines: Vec<Line>,
    /// The tick that is being put together.
    frame: Frame,
}

impl Past {
    /// Nothing has happened yet.
    pub(crate) fn new(scenario: &Scenario) -> Self {
        let mut frame = Frame::default();
        frame.uavs.resize_with(scenario.formation.uavs as usize, Default::default);
        Self { metrics: Metrics::new(scenario), gaps: Gaps::default(), lines: Vec::new(), frame }
    }

    /// Learns from a message; messages of one tick come together.
    pub(crate) fn learn(&mut self, topic: &str, data: &[u8]) {
        if topic == LOG_TOPIC {
            self.lines.extend(Line::decode(data));
        } else if topic.starts_with("/uav/") && topic.ends_with("/state") {
            self.learn_state(data);
        } else if topic.starts_with("/uav/") && topic.ends_with("/control") {
            self.learn_control(data);
        }
    }

    fn learn_state(&mut self, data: &[u8]) {
        let Ok(state) = UavState::decode(data) else { return };
        self.turn_to(state.tick);
        if let Some(uav) = self.frame.uavs.get_mut(state.uav.wrapping_sub(1) as usize) {
            uav.state = Some(state);
        }
    }

    fn learn_control(&mut self, data: &[u8]) {
        let Ok(control) = UavControl::decode(data) else { return };
        self.turn_to(control.tick);
        if let Some(uav) = self.frame.uavs.get_mut(control.uav.wrapping_sub(1) as usize) {
            uav.control = Some(control);
        }
    }

    /// Ends the tick before `tick`, if there is one.
    pub(crate) fn turn_to(&mut self, tick: i64) {
        if tick != self.frame.tick && self.frame.uavs.iter().any(|uav| *uav != UavFrame::default()) {
            self.gaps.pass(self.frame.tick, false);
            self.metrics.observe(&self.frame);
            self.frame.uavs.fill_with(Default::default);
        }
        self.frame.tick = tick;
    }
}
