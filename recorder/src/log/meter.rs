//! Measures the flight in a log again, and says whether the log shows all of it.
//!
//! Never uses anything but the log: the same file gives the same numbers on every machine.

use super::{
    gap::Gap,
    reader::{Reader, Replayed, Shortfalls},
};
use crate::{
    metrics::{Metrics, Moment},
    schema::Timing,
    summary::{LogFindings, LoggedWorld, Summary},
};
use ringwing_flight::{Collision, Event, Latency, LatencyTally, TickTiming, TimedEvent};
use ringwing_scenario::Scenario;
use std::{
    collections::BTreeMap,
    io::{Read, Seek},
    str::FromStr,
};

/// Nanoseconds per microsecond.
const NS_PER_US: f64 = 1e3;
/// Gaps named one by one; the others are only counted. More push the rest of the summary off a terminal.
const NAMED_GAPS: usize = 3;

/// Measures a flight while its log is read.
pub struct LogMeter {
    metrics: Metrics,
    rate_hz: u32,
    /// The tick after the last one that has UAVs.
    expected: i64,
    /// The ticks that are missing between those.
    gaps: Vec<Gap>,
    /// Number of ticks in these gaps.
    lost: u64,
    collisions: Vec<Collision>,
    latency: LatencyTally,
    messages: u64,
    doubled: u64,
    /// The first topic with two different messages in a tick, and the tick.
    conflict: Option<(String, i64)>,
}

/// What a log says of its flight.
#[derive(Debug, Clone)]
pub struct Measured {
    /// The flight in numbers, and the verdict.
    pub summary: Summary,
    /// What is unusual about the log, but does not hinder a verdict.
    pub notes: Vec<String>,
}

impl Measured {
    /// Measures the whole flight of `scenario` in the log that `reader` has just opened.
    pub fn of<R: Read + Seek>(reader: &mut Reader<R>, scenario: &Scenario) -> Self {
        let mut meter = LogMeter::new(scenario);
        for tick in reader.ticks(scenario) {
            meter.observe(&tick);
        }
        meter.finish(reader, scenario)
    }
}

impl LogMeter {
    /// Measures a flight of `scenario`, before its first tick.
    pub fn new(scenario: &Scenario) -> Self {
        Self {
            metrics: Metrics::new(scenario),
            rate_hz: scenario.time.rate_hz,
            expected: 0,
            gaps: Vec::new(),
            lost: 0,
            collisions: Vec::new(),
            latency: LatencyTally::new(),
            messages: 0,
            doubled: 0,
            conflict: None,
        }
    }

    /// Takes the next tick.
    pub fn observe(&mut self, tick: &Replayed) {
        self.messages += tick.messages;
        self.doubled += tick.doubled;
        if let (None, Some(topic)) = (&self.conflict, &tick.conflict) {
            self.conflict = Some((topic.clone(), tick.frame.tick));
        }
        for event in &tick.events {
            self.collisions.extend(collision(event, self.rate_hz));
            self.metrics.on_event(event);
        }
        if let Some(timing) = &tick.timing {
            self.latency.add(&tick_timing(timing));
        }
        if !tick.has_uavs() {
            return;
        }
        self.pass(tick.frame.tick);
        self.metrics.observe(&tick.frame);
        self.metrics.set_lost(self.lost);
    }

    /// The swarm in the tick observed last.
    pub fn moment(&self) -> &Moment {
        self.metrics.moment()
    }

    /// Takes note of a tick that has UAVs.
    fn pass(&mut self, tick: i64) {
        if tick > self.expected {
            self.gaps.push(Gap { first_tick: self.expected, last_tick: tick - 1 });
            self.lost += (tick - self.expected).cast_unsigned();
        }
        self.expected = tick + 1;
    }

    /// What the log says of its flight, once `reader` has handed out all ticks.
    pub fn finish<R: Read + Seek>(self, reader: &Reader<R>, scenario: &Scenario) -> Measured {
        let Shortfalls { problems, notes } = reader.shortfalls(scenario);
        let notes = notes.into_iter().chain(self.note()).collect();
        let findings = self.findings(reader, scenario, problems);
        Measured { summary: Summary::of_log(scenario, findings), notes }
    }

    /// What is unusual, but does not hinder a verdict.
    fn note(&self) -> Option<String> {
        let doubled = self.doubled;
        (doubled > 0).then(|| format!("{doubled} messages are in the file twice, and were read once"))
    }

    fn findings<R: Read + Seek>(
        self,
        reader: &Reader<R>,
        scenario: &Scenario,
        problems: Vec<String>,
    ) -> LogFindings {
        let log = reader.path().display().to_string();
        let failures = problems.into_iter().chain(self.mixture()).chain(self.missing_ticks(reader));
        let world = reader.result().map(logged_world).unwrap_or_default();
        let ticks = (self.expected - 1).max(0);
        LogFindings {
            failures: failures.chain(end(reader, scenario, ticks)).collect(),
            flight: self.metrics.summary(),
            ticks,
            collisions: self.collisions,
            // The world has measured every tick; of a log without its account, the ticks in the log count.
            latency: world.latency.or_else(|| self.latency.latency()),
            world,
            command: format!("ringwing verify {log}"),
            log,
            messages: self.messages,
        }
    }

    /// Whether messages of two flights are mixed, which gives no figures of either.
    fn mixture(&self) -> Option<String> {
        let (topic, tick) = self.conflict.as_ref()?;
        Some(format!("the log mixes two flights: {topic} has two different messages at tick {tick}"))
    }

    /// The ticks that the recorder has written, but that are not in the log any more.
    fn missing_ticks<R: Read + Seek>(&self, reader: &Reader<R>) -> Vec<String> {
        let stated = |key: &str| reader.result().and_then(|result| result.get(key)?.parse::<i64>().ok());
        let mut gaps = Vec::new();
        // The recorder itself may have lost ticks. Then the run has reported that already.
        if stated("ticks_lost").is_some_and(|lost| self.lost > lost.cast_unsigned()) {
            gaps.extend(&self.gaps);
        }
        let last_tick = stated("last_tick").filter(|last| *last >= self.expected);
        gaps.extend(last_tick.map(|last_tick| Gap { first_tick: self.expected, last_tick }));
        let mut sentences: Vec<String> = gaps.iter().take(NAMED_GAPS).map(missing).collect();
        let more = gaps.len().saturating_sub(NAMED_GAPS);
        sentences.extend((more > 0).then(|| format!("and {more} more such gaps")));
        sentences
    }
}

fn missing(Gap { first_tick, last_tick }: &Gap) -> String {
    format!("ticks {first_tick} to {last_tick} are missing from the log")
}

/// Why the log, whose last tick is `last_tick`, does not show the end of the flight.
fn end<R: Read + Seek>(reader: &Reader<R>, scenario: &Scenario, last_tick: i64) -> Option<String> {
    let last_s = last_tick as f64 / f64::from(scenario.time.rate_hz);
    let whole_s = scenario.time.duration_s;
    match reader.result().and_then(|result| result.get("verdict")).map(String::as_str) {
        None => Some(format!("the log breaks off at {last_s:.2} s of {whole_s:.2} s")),
        Some("failed") => Some(format!("the flight was ended at {last_s:.2} s of {whole_s:.2} s")),
        // Whether a whole flight met its requirements is judged again, from the measures.
        Some(_) => None,
    }
}

/// The collision that an event tells of.
fn collision(TimedEvent { tick, event }: &TimedEvent, rate_hz: u32) -> Option<Collision> {
    let Event::Collision { uav, with, position_m } = *event else { return None };
    Some(Collision { time_s: tick.seconds(rate_hz), uav, with, position_m })
}

/// What a latency needs of a logged tick.
fn tick_timing(timing: &Timing) -> TickTiming {
    let round_trip_ns = (timing.round_trip_us * NS_PER_US).round() as u64;
    TickTiming { tick: timing.tick, answered: timing.answered, round_trip_ns, ..TickTiming::default() }
}

/// The world's account in the `result` of a log.
fn logged_world(result: &BTreeMap<String, String>) -> LoggedWorld {
    let latency = || {
        Some(Latency {
            p50_us: logged(result, "latency.p50_us")?,
            p99_us: logged(result, "latency.p99_us")?,
            max_us: logged(result, "latency.max_us")?,
        })
    };
    LoggedWorld {
        payload_hash: logged(result, "payload_hash"),
        // Without any collision, the account does not name them.
        collisions: result.contains_key("world.payload_hash").then(|| {
            (0..u32::MAX)
                .take_while(|index| result.contains_key(&format!("world.collisions.{index}.time_s")))
                .count()
        }),
        failsafes: logged(result, "failsafes"),
        refused_commands: logged(result, "refused_commands"),
        reused_commands: logged(result, "reused_commands"),
        missed_deadlines: logged(result, "missed_deadlines"),
        unanswered_ticks: logged(result, "unanswered_ticks"),
        late_max_us: logged(result, "late_max_us"),
        latency: latency(),
    }
}

/// The world's `quantity` in the `result` of a log.
fn logged<T: FromStr>(result: &BTreeMap<String, String>, quantity: &str) -> Option<T> {
    result.get(&format!("world.{quantity}"))?.parse().ok()
}
