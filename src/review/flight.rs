//! Reads a flight from its log: measures it again and collects columns to draw.
//!
//! Never uses anything but the log: the same file gives the same numbers on every machine. Only a baseline also needs the programs
//! of the user's that the log names.

use super::periods::Periods;
use crate::baseline;
use ringwing_flight::{Event, TimedEvent};
use ringwing_recorder::{
    Summary,
    log::{
        meter::{LogMeter, Measured},
        reader::{Reader, Replayed},
    },
    metrics::{ControlTerms, Frame, TrueState, UavFrame, deviation_m},
    summary::LogFindings,
};
use ringwing_scenario::Scenario;
use ringwing_study::Baseline;
use std::path::{Path, PathBuf};

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
    /// Speed of the air; absent while it stands still.
    pub(crate) wind_m_s: Column,
    /// How far the agent's estimate of the wind is off; absent in still air.
    pub(crate) wind_error_m_s: Column,
    /// How far the UAV is from where its agent believes that it is.
    pub(crate) estimate_error_m: Column,
    /// Age of the oldest data that its agent used.
    pub(crate) age_s: Column,
    /// How far it is from where it would be without the faults; empty if nobody asked for it.
    pub(crate) deviation_m: Column,
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
    /// Reads the log at `path`; `with_baseline` compares its flight with the same one without faults.
    pub(crate) fn read(path: &Path, with_baseline: bool) -> anyhow::Result<Self> {
        let mut reader = Reader::open(path)?;
        let scenario = reader.scenario()?;
        let mut baseline = with_baseline.then(|| baseline::begin(&scenario)).transpose()?;
        let mut flight = Self::empty(reader.path().to_owned(), scenario);
        let mut meter = LogMeter::new(&flight.scenario);
        for tick in reader.ticks(&flight.scenario) {
            meter.observe(&tick);
            flight.take(&tick, &meter);
            if let Some(baseline) = baseline.as_mut().filter(|_| tick.has_uavs()) {
                flight.compare(&tick.frame, baseline.observe(&tick.frame));
            }
        }
        flight.periods.end();
        Measured { summary: flight.summary, notes: flight.notes } = meter.finish(&reader, &flight.scenario);
        flight.summary.deviation = baseline.map(Baseline::finish).transpose()?;
        Ok(flight)
    }

    /// Adds how far the UAVs of a tick are from where they would be without the faults.
    fn compare(&mut self, flown: &Frame, undisturbed: Option<&Frame>) {
        for (index, columns) in self.uavs.iter_mut().enumerate() {
            let pair = flown.uavs.get(index).zip(undisturbed.and_then(|frame| frame.uavs.get(index)));
            columns.deviation_m.push(pair.and_then(|(flown, undisturbed)| deviation_m(flown, undisturbed)));
        }
    }

    fn empty(path: PathBuf, scenario: Scenario) -> Self {
        let uavs = (0..scenario.formation.uavs).map(|_| UavColumns::default()).collect();
        Self {
            path,
            // A placeholder: the summary needs the whole log, and `read` puts it here at the end.
            summary: Summary::of_log(&scenario, LogFindings::default()),
            periods: Periods::new(&scenario.all_obstacles()),
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
        }
    }

    /// Adds a tick, which `meter` has observed before.
    fn take(&mut self, tick: &Replayed, meter: &LogMeter) {
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
        self.periods.observe(time_s, &tick.frame);
        self.ring_spacing_m.push(tick.frame.ring.spacing_m());
        self.ring_radius_m.push(tick.frame.ring.radius_m());
        // The log has the leader less often than the UAVs, so a tick may lack these values.
        self.leader_x_m.push(tick.leader.map(|leader| leader.x));
        self.leader_y_m.push(tick.leader.map(|leader| leader.y));
        self.round_trip_us.push(tick.timing.as_ref().map(|timing| timing.round_trip_us));
        let moment = meter.moment();
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
        self.wind_m_s.push(state.and_then(TrueState::wind_speed_m_s));
        self.wind_error_m_s.push(uav.wind_error_m_s());
        self.estimate_error_m.push(commanded.and_then(|_| uav.estimate_error_m()));
        let ages = control.map(|control| [control.previous_age_s, control.next_age_s, control.leader_age_s]);
        self.age_s.push(ages.and_then(|ages| ages.into_iter().flatten().reduce(f64::max)));
    }
}
