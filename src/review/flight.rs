//! Reads a flight from its log: measures it again and collects columns to draw.
//!
//! Never uses anything but the log: the same file gives the same numbers on every machine.

use super::periods::Periods;
use crate::summary::{LogFindings, LoggedWorld, Summary};
use ringwing_flight::{Collision, Event, Latency, LatencyTally, TickTiming, TimedEvent};
use ringwing_recorder::{
    Gap, Metrics,
    log::reader::{ReadError, Reader, Replayed, Shortfalls},
    metrics::{ControlTerms, UavFrame},
    schema::Timing,
};
use ringwing_scenario::Scenario;
use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
    str::FromStr,
};

/// Nanoseconds per microsecond.
const NS_PER_US: f64 = 1e3;

/// One value for each tick of a flight; `None` if it does not exist at that tick.
pub(crate) type Column = Vec<Option<f64>>;

/// The values of one UAV, tick by tick.
#[derive(Debug, Default)]
pub(crate) struct UavColumns {
    pub(crate) x_m: Column,
    pub(crate) y_m: Column,
    pub(crate) next_distance_m: Column,
    pub(crate) leader_distance_m: Column,
    pub(crate) slot_error_m: Column,
    pub(crate) heading_rad: Column,
    pub(crate) speed_m_s: Column,
    pub(crate) turn_rate_rad_s: Column,
    pub(crate) repulsion_m: Column,
    /// Age of the oldest data that its agent used.
    pub(crate) age_s: Column,
    /// Whether its agent flies it, and not its failsafe.
    pub(crate) commanded: Vec<bool>,
}

/// An event of the flight as figures and tables show it.
#[derive(Debug, Clone)]
pub(crate) struct ShownEvent {
    pub(crate) time_s: f64,
    /// The kind, such as `collision`.
    pub(crate) name: String,
    pub(crate) text: String,
    /// Where a collision happened.
    pub(crate) position_m: Option<[f64; 2]>,
}

/// A whole flight. All columns are as long as `times_s`: they hold the ticks in which the log has any UAV.
#[derive(Debug)]
pub(crate) struct LoggedFlight {
    /// The file that was read.
    pub(crate) path: PathBuf,
    pub(crate) scenario: Scenario,
    pub(crate) summary: Summary,
    /// What is unusual about the log, but does not hinder a verdict.
    pub(crate) notes: Vec<String>,
    pub(crate) times_s: Vec<f64>,
    /// UAV 1 first.
    pub(crate) uavs: Vec<UavColumns>,
    pub(crate) leader_x_m: Column,
    pub(crate) leader_y_m: Column,
    pub(crate) closest_adjacent_m: Column,
    pub(crate) closest_other_m: Column,
    pub(crate) lyapunov_m2: Column,
    pub(crate) round_trip_us: Column,
    pub(crate) events: Vec<ShownEvent>,
    /// The distances that the ring flown has: L and R, until it closes after a loss.
    pub(crate) ring_spacing_m: Column,
    pub(crate) ring_radius_m: Column,
    /// When something was wrong, and when UAVs passed obstacles.
    pub(crate) periods: Periods,
}

impl LoggedFlight {
    /// Reads the log at `path`.
    pub(crate) fn read(path: &Path) -> Result<Self, ReadError> {
        let mut reader = Reader::open(path)?;
        let scenario = reader.scenario()?;
        let mut flight = Self::empty(reader.path().to_owned(), scenario);
        let mut meter = FlightMeter::new(&flight.scenario);
        for tick in reader.ticks(&flight.scenario) {
            meter.observe(&tick);
            flight.take(&tick, &meter);
        }
        flight.periods.end();
        let Shortfalls { problems, notes } = reader.shortfalls(&flight.scenario);
        flight.notes = notes.into_iter().chain(meter.note()).collect();
        let findings = meter.findings(&reader, &flight, problems);
        flight.summary = Summary::of_log(&flight.scenario, findings);
        Ok(flight)
    }

    fn empty(path: PathBuf, scenario: Scenario) -> Self {
        let uavs = (0..scenario.formation.uavs).map(|_| UavColumns::default()).collect();
        Self {
            path,
            summary: Summary::of_log(&scenario, LogFindings::default()),
            scenario,
            notes: Vec::new(),
            times_s: Vec::new(),
            uavs,
            leader_x_m: Vec::new(),
            leader_y_m: Vec::new(),
            closest_adjacent_m: Vec::new(),
            closest_other_m: Vec::new(),
            lyapunov_m2: Vec::new(),
            round_trip_us: Vec::new(),
            events: Vec::new(),
            ring_spacing_m: Vec::new(),
            ring_radius_m: Vec::new(),
            periods: Periods::default(),
        }
    }

    /// Adds a tick, which `meter` has observed before.
    fn take(&mut self, tick: &Replayed, meter: &FlightMeter) {
        let time_s = tick.frame.tick as f64 / f64::from(self.scenario.time.rate_hz);
        let event = |timed: &TimedEvent| ShownEvent {
            time_s,
            name: timed.event.name().into(),
            text: self.scenario.event_text(&timed.event),
            position_m: match timed.event {
                Event::Collision { position_m, .. } => Some(position_m),
                _ => None,
            },
        };
        // Do this first: a tick without UAVs can have events.
        self.events.extend(tick.events.iter().map(event));
        for timed in &tick.events {
            self.periods.on_event(time_s, &timed.event);
        }
        if !tick.has_uavs() {
            return;
        }
        self.times_s.push(time_s);
        // From here on every column gets one value, so that all stay as long as `times_s`.
        for (columns, uav) in self.uavs.iter_mut().zip(&tick.frame.uavs) {
            columns.take(uav);
        }
        self.periods.observe(time_s, &tick.frame, &self.scenario.obstacles);
        self.ring_spacing_m.push(tick.frame.ring.spacing_m());
        self.ring_radius_m.push(tick.frame.ring.radius_m());
        self.leader_x_m.push(tick.leader.map(|leader| leader.x));
        self.leader_y_m.push(tick.leader.map(|leader| leader.y));
        self.round_trip_us.push(tick.timing.as_ref().map(|timing| timing.round_trip_us));
        let moment = meter.metrics.moment();
        self.closest_adjacent_m.push(moment.closest.adjacent.map(|pair| pair.distance_m));
        self.closest_other_m.push(moment.closest.other.map(|pair| pair.distance_m));
        self.lyapunov_m2.push(moment.lyapunov_m2);
    }
}

impl UavColumns {
    fn take(&mut self, uav: &UavFrame) {
        let (state, control) = (uav.state.as_ref(), uav.control.as_ref());
        // A UAV in its failsafe flies away. Its distance from the formation would flatten the lines of all others.
        let commanded = uav.commanded();
        self.x_m.push(state.map(|state| state.x_m));
        self.y_m.push(state.map(|state| state.y_m));
        self.next_distance_m.push(state.and_then(|state| state.next_distance_m));
        self.leader_distance_m.push(commanded.and_then(|state| state.leader_distance_m));
        self.slot_error_m.push(commanded.and_then(|state| state.slot_error_m));
        self.heading_rad.push(state.map(|state| state.heading_rad));
        self.commanded.push(commanded.is_some());
        self.speed_m_s.push(state.map(|state| state.speed_m_s));
        self.turn_rate_rad_s.push(state.map(|state| state.turn_rate_rad_s));
        self.repulsion_m.push(control.map(ControlTerms::repulsion_length_m));
        let ages = control.map(|control| [control.previous_age_s, control.next_age_s, control.leader_age_s]);
        self.age_s.push(ages.and_then(|ages| ages.into_iter().flatten().reduce(f64::max)));
    }
}

/// Gaps named one by one; the others are only counted. More push the rest of the summary off a terminal.
const NAMED_GAPS: usize = 3;

/// Measures a flight while its log is read.
struct FlightMeter {
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

impl FlightMeter {
    fn new(scenario: &Scenario) -> Self {
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

    fn observe(&mut self, tick: &Replayed) {
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

    /// Takes note of a tick that has UAVs.
    fn pass(&mut self, tick: i64) {
        if tick > self.expected {
            self.gaps.push(Gap { first_tick: self.expected, last_tick: tick - 1 });
            self.lost += (tick - self.expected).cast_unsigned();
        }
        self.expected = tick + 1;
    }

    /// What is unusual, but does not hinder a verdict.
    fn note(&self) -> Option<String> {
        let doubled = self.doubled;
        (doubled > 0).then(|| format!("{doubled} messages are in the file twice, and were read once"))
    }

    fn findings<R: std::io::Read + std::io::Seek>(
        self,
        reader: &Reader<R>,
        flight: &LoggedFlight,
        problems: Vec<String>,
    ) -> LogFindings {
        let log = reader.path().display().to_string();
        let failures = problems.into_iter().chain(self.mixture()).chain(self.missing_ticks(reader));
        let world = reader.result().map(logged_world).unwrap_or_default();
        LogFindings {
            failures: failures.chain(end(reader, flight)).collect(),
            flight: self.metrics.summary(),
            ticks: (self.expected - 1).max(0),
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
    fn missing_ticks<R: std::io::Read + std::io::Seek>(&self, reader: &Reader<R>) -> Vec<String> {
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

/// Why the log does not show the end of the flight.
fn end<R: std::io::Read + std::io::Seek>(reader: &Reader<R>, flight: &LoggedFlight) -> Option<String> {
    let last_s = flight.times_s.last().copied().unwrap_or_default();
    let whole_s = flight.scenario.time.duration_s;
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
