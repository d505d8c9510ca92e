//! What the flight of a check showed, read from its log.
//!
//! Never judges; the checks do.

use ringwing_flight::{Event, LatencyTally, Part, Tick, TimedEvent};
use ringwing_recorder::{
    log::reader::{Reader, Replayed},
    metrics::{Frame, UavFrame},
};
use ringwing_scenario::Scenario;
use std::path::{Path, PathBuf};

/// How long before the end of a flight wishes have to be within the limits, seconds. Longer reaches back to when the ring is still
/// forming, and a law may want more than the airframe can do; shorter sees few wishes.
const IN_LIMITS_S: f64 = 10.0;

/// What a flight showed.
#[derive(Debug, Default)]
pub(super) struct Findings {
    /// The folders of the flights.
    pub(super) folders: Vec<PathBuf>,
    /// What controllers did wrong: each as a sentence with its time.
    pub(super) failures: Vec<String>,
    /// The collisions, each as a sentence with its time.
    pub(super) collisions: Vec<String>,
    /// The first wish near the end that was cut to the limits.
    pub(super) cut: Option<String>,
    /// The first difference from the second flight.
    pub(super) difference: Option<String>,
    /// How many UAVs fly on command at the end.
    pub(super) commanded: usize,
    /// The largest distance of a UAV on command from its slot, at the end.
    pub(super) slot_error_max_m: Option<f64>,
    /// For each tick, the longest time that an agent took to decide and to send.
    pub(super) compute: LatencyTally,
    /// Whether the user interrupted the flight.
    pub(super) is_interrupted: bool,
}

impl Findings {
    /// What the log in the `folder` of a flight of `scenario` shows.
    pub(super) fn of(folder: &Path, scenario: &Scenario) -> anyhow::Result<Self> {
        let mut found = Self { folders: vec![folder.to_owned()], ..Self::default() };
        for tick in Reader::open(folder)?.ticks(scenario) {
            found.observe(&tick, scenario);
        }
        Ok(found)
    }

    fn observe(&mut self, tick: &Replayed, scenario: &Scenario) {
        let seconds = |tick: Tick| tick.seconds(scenario.time.rate_hz);
        for TimedEvent { tick, event } in &tick.events {
            let sentence = || format!("at {:.2} s {}", seconds(*tick), scenario.event_text(event));
            match event {
                Event::RunInterrupted => self.is_interrupted = true,
                Event::Collision { .. } => self.collisions.push(sentence()),
                event if is_failure(event) => self.failures.push(sentence()),
                _ => {}
            }
        }
        if let Some(timing) = &tick.timing {
            self.compute.add_ns((timing.compute_us * 1e3) as u64);
        }
        if seconds(Tick(tick.frame.tick)) >= scenario.time.duration_s - IN_LIMITS_S {
            self.cut = self.cut.take().or_else(|| cut(&tick.frame));
        }
        // After the last tick there may be events, without any UAV.
        if tick.frame.uavs.iter().any(|uav| uav.state.is_some()) {
            let commanded = tick.frame.uavs.iter().filter_map(UavFrame::commanded);
            self.commanded = commanded.clone().count();
            self.slot_error_max_m = commanded.filter_map(|state| state.slot_error_m).reduce(f64::max);
        }
    }
}

/// Whether an event is the fault of a controller: none of the checks asks for one of these.
fn is_failure(event: &Event) -> bool {
    match event {
        Event::WishNotFinite { .. } => true,
        Event::ProcessLost { part, .. }
        | Event::ProcessFrozen { part }
        | Event::StartOverdue { part }
        | Event::ProcessSilent { part, .. } => matches!(part, Part::Agent(_)),
        _ => false,
    }
}

/// The first UAV whose wish was cut in this tick.
fn cut(frame: &Frame) -> Option<String> {
    let controls = (1..).zip(&frame.uavs).filter_map(|(uav, flown)| Some((uav, flown.control.as_ref()?)));
    let mut cut = controls.filter(|(_, control)| control.speed_saturated || control.turn_rate_saturated);
    let (uav, control) = cut.next()?;
    let what = if control.speed_saturated { "speed" } else { "turn rate" };
    Some(format!(
        "at tick {}, in formation, the {what} that uav {uav} wishes is beyond its limits",
        frame.tick
    ))
}
