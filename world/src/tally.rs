//! What the world counts over a flight, for its report.

use hdrhistogram::Histogram;
use ringwing_flight::{Collision, Command, Event, Latency, Sensed, TickTiming, WorldReport};
use xxhash_rust::xxh3::Xxh3;

/// The longest latency told apart: a minute.
const LONGEST_NS: u64 = 60_000_000_000;

/// The counts so far.
pub(crate) struct Tally {
    hash: Xxh3,
    latency: Histogram<u64>,
    late_max_ns: u64,
    collisions: Vec<Collision>,
    failsafes: u32,
    pub(crate) refused_commands: u64,
    pub(crate) unanswered_ticks: u64,
    reused_commands: u64,
    missed_deadlines: u64,
}

impl Tally {
    pub(crate) fn new() -> Self {
        Self {
            hash: Xxh3::new(),
            latency: Histogram::new_with_max(LONGEST_NS, 3).expect("these bounds make a histogram"),
            late_max_ns: 0,
            collisions: Vec::new(),
            failsafes: 0,
            refused_commands: 0,
            unanswered_ticks: 0,
            reused_commands: 0,
            missed_deadlines: 0,
        }
    }

    /// Adds what a UAV senses to the payload hash.
    pub(crate) fn hash_sensed(&mut self, sensed: &Sensed) {
        self.hash.update(bytemuck::bytes_of(sensed));
    }

    /// Adds a tick: the commands that answered it, in the order of the UAVs, and how long it took.
    pub(crate) fn add_tick<'a>(&mut self, commands: impl Iterator<Item = &'a Command>, timing: &TickTiming) {
        for command in commands {
            self.hash.update(bytemuck::bytes_of(command));
        }
        if timing.answered > 0 {
            self.latency.saturating_record(timing.round_trip_ns);
        }
        self.late_max_ns = self.late_max_ns.max(timing.late_ns);
        self.reused_commands += u64::from(timing.reused);
        self.missed_deadlines += u64::from(timing.missed_deadlines);
    }

    /// Counts what happened at `time_s`.
    pub(crate) fn count_event(&mut self, time_s: f64, event: &Event) {
        match *event {
            Event::Collision { uav, with, position_m } => {
                self.collisions.push(Collision { time_s, uav, with, position_m });
            }
            Event::Failsafe { .. } => self.failsafes += 1,
            _ => {}
        }
    }

    pub(crate) fn report(&self, last_tick: i64, complete: bool) -> WorldReport {
        WorldReport {
            last_tick,
            complete,
            payload_hash: format!("{:032x}", self.hash.digest128()),
            collisions: self.collisions.clone(),
            failsafes: self.failsafes,
            refused_commands: self.refused_commands,
            reused_commands: self.reused_commands,
            missed_deadlines: self.missed_deadlines,
            unanswered_ticks: self.unanswered_ticks,
            late_max_us: self.late_max_ns as f64 / 1e3,
            latency: (!self.latency.is_empty()).then(|| Latency {
                p50_us: self.latency.value_at_quantile(0.5) as f64 / 1e3,
                p99_us: self.latency.value_at_quantile(0.99) as f64 / 1e3,
                max_us: self.latency.max() as f64 / 1e3,
            }),
        }
    }
}
