//! The messages of a flight, tick by tick and in the order of their topics: the same for a log and for a live viewer.
//!
//! Must never know where the messages go: a [`MessageSink`] takes them.

pub(crate) mod channels;

use crate::{
    clock::Clock,
    metrics::{Frame, UavFrame},
    schema::{EventWriter, LinkCounts, Timing, UavControl, UavNotes, UavState, log_line},
    show::view::TickView,
};
use channels::{Channels, UavChannels};
use foxglove::{Encode, Schema, messages::Log};
use ringwing_flight::{Level, Notes, TickTiming, TimedEvent};
use ringwing_scenario::Scenario;
use std::collections::BTreeMap;

/// Takes the messages of a flight.
pub trait MessageSink {
    /// Why a message cannot be taken.
    type Error;

    /// Adds a channel for messages of `schema` on `topic`, encoded as `encoding`; returns its number.
    fn add_channel(&mut self, topic: &str, schema: &Schema, encoding: &str) -> Result<u16, Self::Error>;

    /// Takes an encoded message of `tick` for the channel with this number.
    fn put(&mut self, channel: u16, tick: i64, data: &[u8]) -> Result<(), Self::Error>;
}

/// Makes the messages of one flight.
pub struct MessageStream {
    channels: Channels,
    events: EventWriter,
    /// The first line of `/log`, until it is written.
    introduction: Option<Log>,
    /// Holds one encoded message at a time; kept to reuse its memory.
    buffer: Vec<u8>,
}

impl MessageStream {
    /// Adds all channels of a flight of `scenario` to `sink`, those of wall-clock times if `timing` is wanted.
    pub fn open<S: MessageSink>(sink: &mut S, scenario: &Scenario, timing: bool) -> Result<Self, S::Error> {
        Ok(Self {
            channels: Channels::register(sink, scenario.formation.uavs, timing)?,
            events: EventWriter::new(scenario),
            introduction: Some(introduction(scenario)),
            buffer: Vec::new(),
        })
    }

    /// Leaves the introduction out, because a copied `/log` has it already.
    pub(crate) fn skip_introduction(&mut self) {
        self.introduction = None;
    }

    /// How many messages of each topic that a verdict needs are among these `counts`, which are by channel.
    pub(crate) fn judged_counts(&self, counts: &[u64]) -> BTreeMap<String, String> {
        self.channels.judged_counts(counts)
    }

    /// Hands a tick with its events and its view to `sink`, in the order of topics.
    pub fn write_frame<S: MessageSink>(
        &mut self,
        sink: &mut S,
        frame: &Frame,
        timing: Option<&TickTiming>,
        events: &[TimedEvent],
        view: &TickView,
    ) -> Result<(), S::Error> {
        let tick = frame.tick;
        self.write_events(sink, tick, events)?;
        self.write_some(sink, self.channels.faults, tick, view.faults.as_ref())?;
        self.write_some(sink, self.channels.leader_fix, tick, view.leader_fix.as_ref())?;
        self.write_some(sink, self.channels.map, tick, view.map.as_ref())?;
        self.write_some(sink, self.channels.leader_pose, tick, view.leader_pose.as_ref())?;
        for counts in &frame.links {
            self.write(sink, self.channels.links, tick, &LinkCounts::of(tick, counts))?;
        }
        self.write_lines(sink, tick, events)?;
        self.write_some(sink, self.channels.estimates, tick, view.estimates.as_ref())?;
        self.write_some(sink, self.channels.formation, tick, view.formation.as_ref())?;
        self.write_some(sink, self.channels.obstacles, tick, view.obstacles.as_ref())?;
        self.write_some(sink, self.channels.path, tick, view.path.as_ref())?;
        self.write_some(sink, self.channels.ring, tick, view.ring.as_ref())?;
        self.write_some(sink, self.channels.trails, tick, view.trails.as_ref())?;
        self.write_some(sink, self.channels.uav_scene, tick, view.uavs.as_ref())?;
        self.write_some(sink, self.channels.wind, tick, view.wind.as_ref())?;
        self.write_some(sink, self.channels.metrics, tick, view.metrics.as_ref())?;
        self.write_some(sink, self.channels.state, tick, view.state.as_ref())?;
        self.write_some(sink, self.channels.transforms, tick, view.transforms.as_ref())?;
        if let (Some(channel), Some(timing)) = (self.channels.timing, timing) {
            self.write(sink, channel, tick, &Timing::from(timing))?;
        }
        if let Some(channel) = self.channels.timing_percentiles {
            self.write_some(sink, channel, tick, view.timing.as_ref())?;
        }
        // `/uav/...` sorts after all other topics.
        let mut notes = frame.notes.iter().peekable();
        (1..).zip(&frame.uavs).try_for_each(|(number, uav)| {
            let notes = notes.next_if(|notes| notes.uav.0 == number);
            self.write_uav(sink, tick, number, uav, notes)
        })
    }

    /// Hands events to `sink` that came after the last frame, the frame of `tick`.
    pub(crate) fn write_last_events<S: MessageSink>(
        &mut self,
        sink: &mut S,
        tick: i64,
        events: &[TimedEvent],
    ) -> Result<(), S::Error> {
        self.write_events(sink, tick, events)?;
        self.write_lines(sink, tick, events)
    }

    fn write_events<S: MessageSink>(
        &mut self,
        sink: &mut S,
        tick: i64,
        events: &[TimedEvent],
    ) -> Result<(), S::Error> {
        for event in events {
            let message = self.events.message(event);
            self.write(sink, self.channels.events, tick, &message)?;
        }
        Ok(())
    }

    fn write_lines<S: MessageSink>(
        &mut self,
        sink: &mut S,
        tick: i64,
        events: &[TimedEvent],
    ) -> Result<(), S::Error> {
        // With the first tick, not at creation: a takeover creates its log before it knows whether the old one holds
        // the introduction.
        if let Some(introduction) = self.introduction.take() {
            self.write(sink, self.channels.log, tick, &introduction)?;
        }
        for event in events {
            let line = self.events.line(event);
            self.write(sink, self.channels.log, tick, &line)?;
        }
        Ok(())
    }

    fn write_uav<S: MessageSink>(
        &mut self,
        sink: &mut S,
        tick: i64,
        number: u32,
        uav: &UavFrame,
        notes: Option<&Notes>,
    ) -> Result<(), S::Error> {
        let UavChannels { control, state } = self.channels.uavs[number as usize - 1];
        if let Some(terms) = &uav.control {
            self.write(sink, control, tick, &UavControl::of(tick, number, terms))?;
        }
        // Between control and state, as the topics sort.
        if let Some(notes) = notes.filter(|notes| notes.iter().next().is_some()) {
            let channel = self.channels.notes_of(sink, notes.uav)?;
            self.write(sink, channel, tick, &UavNotes::of(notes))?;
        }
        if let Some(truth) = &uav.state {
            self.write(sink, state, tick, &UavState::of(tick, truth))?;
        }
        Ok(())
    }

    fn write_some<S: MessageSink>(
        &mut self,
        sink: &mut S,
        channel: u16,
        tick: i64,
        message: Option<&impl Encode>,
    ) -> Result<(), S::Error> {
        message.map_or(Ok(()), |message| self.write(sink, channel, tick, message))
    }

    fn write<S: MessageSink>(
        &mut self,
        sink: &mut S,
        channel: u16,
        tick: i64,
        message: &impl Encode,
    ) -> Result<(), S::Error> {
        self.buffer.clear();
        message.encode(&mut self.buffer).expect("a vector has room for any message");
        sink.put(channel, tick, &self.buffer)
    }
}

/// The first line of `/log`: swarm, law, rate, mode and seed.
fn introduction(scenario: &Scenario) -> Log {
    let text = format!(
        "{} UAVs, {} law, {} Hz, {}, seed {}",
        scenario.formation.uavs,
        scenario.control.law.name(),
        scenario.time.rate_hz,
        mode_name(scenario),
        scenario.seed
    );
    log_line(Clock::new(scenario.time.rate_hz), 0, Level::Info, "run", &text)
}

/// How a flight of `scenario` goes through time.
pub(crate) fn mode_name(scenario: &Scenario) -> &'static str {
    if scenario.time.real_time { "real time" } else { "lockstep" }
}
