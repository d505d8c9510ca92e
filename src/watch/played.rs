//! A log, played as it was flown: at any speed, with pauses and single ticks.
//!
//! Must never read ahead more than a few ticks: a log may be larger than memory.

use super::{
    model::{Model, Pace},
    prompt::Wish,
};
use ringwing_recorder::{
    Metrics,
    log::reader::{Reader, Replayed},
};
use ringwing_scenario::Scenario;
use std::{
    path::Path,
    sync::mpsc::{Receiver, sync_channel},
    thread,
    time::Instant,
};

/// Ticks that are read ahead. Fewer make fast playback jerk; more take memory.
const READ_AHEAD: usize = 64;
/// How much faster or slower a key makes it.
const FACTOR: f64 = 2.0;
/// The range of speeds. Slower looks like a pause; faster is limited by how fast a log is read.
const SPEEDS: (f64, f64) = (1.0 / 16.0, 64.0);

/// A log that is played.
pub(super) struct PlayedLog {
    ticks: Receiver<Replayed>,
    /// The next tick, until its time comes.
    next: Option<Replayed>,
    metrics: Metrics,
    rate_hz: f64,
    speed: f64,
    /// The tick that is due at a moment, while it plays.
    since: Option<(f64, Instant)>,
    /// The last tick that is due while it does not play.
    due: f64,
}

impl PlayedLog {
    /// Opens the log that `path` names, and begins to play it.
    pub(super) fn open(path: &Path) -> anyhow::Result<(Self, Scenario)> {
        let reader = Reader::open(path)?;
        let (path, scenario) = (reader.path().to_owned(), reader.scenario()?);
        let (sender, ticks) = sync_channel(READ_AHEAD);
        let flown = scenario.clone();
        // Sending waits until the tick is wanted, and fails once nobody watches. A reader stays in its thread, so this one
        // opens the log, which was readable a moment ago, once more.
        thread::spawn(move || {
            let Ok(mut reader) = Reader::open(&path) else { return };
            let all = reader.ticks(&flown).filter(|tick| tick.has_uavs() || !tick.events.is_empty());
            for tick in all {
                if sender.send(tick).is_err() {
                    return;
                }
            }
        });
        let played = Self {
            ticks,
            next: None,
            metrics: Metrics::new(&scenario),
            rate_hz: f64::from(scenario.time.rate_hz),
            speed: 1.0,
            // Tick 0 is due at once, and with it the approach, which is tick -1.
            since: Some((0.0, Instant::now())),
            due: 0.0,
        };
        Ok((played, scenario))
    }

    /// Takes the ticks whose time has come.
    pub(super) fn fetch(&mut self, model: &mut Model) {
        let due = self.due_tick(Instant::now());
        let is_at_end = loop {
            // Wait for the reading thread. With `try_recv`, an empty channel would look like the end of the log.
            let Some(next) = self.next.take().or_else(|| self.ticks.recv().ok()) else { break true };
            if next.frame.tick as f64 > due {
                self.next = Some(next);
                break false;
            }
            next.events.iter().for_each(|event| self.metrics.on_event(event));
            // Every tick is measured, also those that fast playback does not show: recoveries and V depend on the
            // ticks before.
            if next.has_uavs() {
                self.metrics.observe(&next.frame);
            }
            let latency_us = next.timing.map(|timing| timing.round_trip_us);
            if let Some(leader) = next.leader {
                model.set_leader([leader.x, leader.y]);
            }
            model.take(&next.frame, self.metrics.moment(), &next.events, latency_us);
        };
        model.end_batch();
        model.set_pace(match (is_at_end, self.since) {
            (true, _) => Pace::AtEnd,
            (false, Some(_)) => Pace::Played { speed: self.speed },
            (false, None) => Pace::Stopped,
        });
    }

    /// Does what the user wishes.
    pub(super) fn ask(&mut self, wish: &Wish, model: &mut Model) {
        let now = Instant::now();
        // Stop the clock at this moment first: a new speed must not apply to the time before.
        self.due = self.due_tick(now);
        match *wish {
            Wish::Toggle => self.since = if self.since.is_some() { None } else { Some((self.due, now)) },
            Wish::Step(ticks) => {
                // From the tick that is shown: the clock may be between two ticks.
                let shown = model.tick().map_or(0.0, |tick| tick as f64);
                (self.since, self.due) = (None, shown + f64::from(ticks));
            }
            Wish::Faster | Wish::Slower => {
                let factor = if *wish == Wish::Faster { FACTOR } else { 1.0 / FACTOR };
                self.speed = (self.speed * factor).clamp(SPEEDS.0, SPEEDS.1);
                self.since = self.since.map(|_| (self.due, now));
            }
            Wish::Fault(_) => model.set_notice("this is a log: only a live run takes faults"),
        }
    }

    fn due_tick(&self, now: Instant) -> f64 {
        match self.since {
            Some((tick, since)) => tick + now.duration_since(since).as_secs_f64() * self.rate_hz * self.speed,
            None => self.due,
        }
    }
}
