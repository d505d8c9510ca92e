//! Follows a flight frame by frame: measures it, puts its events in order, and says what viewers are shown.
//!
//! Must never know where frames come from: the same frames and events give the same views.

use crate::{
    metrics::{FlightSummary, Frame, Metrics, Moment},
    show::view::{TickView, Viewer},
};
use ringwing_flight::{Event, Reporter, TickTiming, TimedEvent};
use ringwing_scenario::Scenario;

/// A flight as far as it has come.
pub struct Follower {
    metrics: Metrics,
    viewer: Viewer,
    /// Events whose frame has not come yet.
    waiting: Vec<TimedEvent>,
    /// Events that a predecessor has taken already.
    known: Vec<TimedEvent>,
    /// The events of the scenario's own faults.
    scheduled: Vec<TimedEvent>,
}

impl Follower {
    /// Follows a flight of `scenario` from now on.
    pub fn new(scenario: &Scenario) -> Self {
        Self::resuming(scenario, Metrics::new(scenario), Viewer::new(scenario), Vec::new())
    }

    /// Follows a flight of `scenario` in place of a predecessor that has left its metrics, its viewer and the events that it
    /// knew.
    pub(crate) fn resuming(
        scenario: &Scenario,
        metrics: Metrics,
        viewer: Viewer,
        known: Vec<TimedEvent>,
    ) -> Self {
        let scheduled = scenario.schedule().announcements();
        let mut follower = Self { metrics, viewer, waiting: Vec::new(), known, scheduled };
        follower.schedule_events();
        follower
    }

    /// Announces the events of the scenario's own faults, as far as a live run has not healed them before their time.
    fn schedule_events(&mut self) {
        for event in self.scheduled.clone() {
            self.take_event(event);
        }
        for event in self.known.clone() {
            self.forget_overtaken_healing(&event);
        }
    }

    /// Takes an event. It belongs to the frame of its tick, or to the next one if that has passed.
    pub fn take_event(&mut self, event: TimedEvent) {
        // Skip repetitions: a new recorder may receive events that its predecessor has logged, and every recorder
        // announces the scenario's faults.
        if !self.known.contains(&event) {
            self.forget_overtaken_healing(&event);
            self.waiting.push(event);
        }
    }

    /// Forgets the scheduled end of a fault that `event` says was healed before it: a fault ends once.
    fn forget_overtaken_healing(&mut self, event: &TimedEvent) {
        let Event::FaultHealed { sentence } = &event.event else { return };
        if self.scheduled.contains(event) {
            return;
        }
        let is_later = |timed: &TimedEvent| timed.tick > event.tick;
        let is_same = |timed: &TimedEvent| match &timed.event {
            Event::FaultHealed { sentence: other } | Event::LinkFault { sentence: other } => {
                other == sentence
            }
            _ => false,
        };
        let next = (0..self.waiting.len())
            .filter(|place| is_later(&self.waiting[*place]) && is_same(&self.waiting[*place]))
            .min_by_key(|place| self.waiting[*place].tick);
        // If the same fault begins again before that end, the end belongs to the new one.
        if let Some(place) =
            next.filter(|place| matches!(self.waiting[*place].event, Event::FaultHealed { .. }))
        {
            self.waiting.remove(place);
        }
    }

    /// Measures the next frame; returns the events that belong to it.
    pub fn observe(&mut self, frame: &Frame) -> Vec<TimedEvent> {
        let events = self.take_events(frame.tick);
        for event in &events {
            self.metrics.on_event(event);
            self.viewer.on_event(&event.event);
        }
        self.metrics.observe(frame);
        events
    }

    /// Notes how many ticks are missing so far.
    pub(crate) fn set_lost(&mut self, ticks: u64) {
        self.metrics.set_lost(ticks);
    }

    /// What viewers are shown of `frame`, which was observed before, and of how long its tick took.
    pub fn view(&mut self, frame: &Frame, timing: Option<&TickTiming>) -> TickView {
        self.viewer.observe(frame);
        if let Some(timing) = timing {
            self.viewer.observe_timing(timing);
        }
        self.viewer.view(frame, self.metrics.moment())
    }

    /// The swarm in the last frame.
    pub fn moment(&self) -> &Moment {
        self.metrics.moment()
    }

    /// The flight so far in numbers.
    pub fn summary(&self) -> FlightSummary {
        self.metrics.summary()
    }

    /// Ends the flight, whose last frame was that of `last_tick`; returns the events after it.
    pub(crate) fn finish(&mut self, last_tick: i64) -> Vec<TimedEvent> {
        let mut events = self.take_events(i64::MAX);
        // The schedule announces faults up to any tick. Those of ticks that the flight never reached did not happen.
        events.retain(|timed| timed.tick.0 <= last_tick || timed.event.reporter() != Reporter::Schedule);
        for event in &events {
            self.metrics.on_event(event);
        }
        events
    }

    /// Takes the waiting events up to `tick`, in order of time and reporters.
    fn take_events(&mut self, tick: i64) -> Vec<TimedEvent> {
        if self.waiting.is_empty() {
            return Vec::new();
        }
        self.waiting.sort_by_key(|timed| (timed.tick, timed.event.reporter()));
        let due = self.waiting.partition_point(|event| event.tick.0 <= tick);
        self.waiting.drain(..due).collect()
    }
}
