//! A flight in this process instead of one process per part: `run --simulated`, and what `verify` repeats a flight with.
//!
//! Writes the same log as the processes, without wall-clock times. Must never use shared memory or start a process.

use crate::launcher::{LaunchError, Outcome, Plan, Progress, link_latest, log_in};
use ringwing_bus::{DomainId, StopFlag};
use ringwing_flight::{Event, FormationError, Reporter, Tick, TimedEvent, WorldReport};
use ringwing_recorder::{Recording, log::Opening};
use ringwing_simulation::{Frames, Simulation};
use std::{
    fs,
    path::PathBuf,
    time::{Duration, Instant},
};

/// Ticks between two looks at the progress line. More make it jerk; fewer cost time in short ticks.
const PROGRESS_PERIOD: i64 = 100;

/// Flies `plan` to its end in this process, and says how it went.
///
/// # Errors
/// The scenario flies in real time, or the run's folder or its log cannot be written.
pub(crate) fn fly(plan: &Plan) -> anyhow::Result<Outcome> {
    let begin = Instant::now();
    let stop = StopFlag::on_signals()?;
    let mut simulation = Simulation::new(&plan.scenario)?;
    let folder = make_folder(plan)?;
    let text = plan.scenario.to_toml();
    let opening = Opening { scenario: &plan.scenario, text: &text, timing: false, started_at: None };
    let log = plan.record.then(|| log_in(&folder));
    let recording = Recording::begin(log.as_deref(), &opening, false)?;
    let progress = Progress::new(&plan.scenario, plan.quiet);
    progress.print(&format!("simulated, folder {}", folder.display()));
    let mut flight = Flight { recording, progress, problem: None, is_interrupted: false };
    let takeoff = Instant::now();
    flight.fly(&mut simulation, &stop);
    let flight_time = takeoff.elapsed();
    let report = (!simulation.is_world_ended()).then(|| flight.report(&simulation));
    flight.finish(report.as_ref());
    Ok(outcome(folder, &simulation, &flight, report, (takeoff - begin, flight_time)))
}

/// Makes `<out>/<name>-<id>/` with the resolved scenario, as the launcher does.
fn make_folder(plan: &Plan) -> anyhow::Result<PathBuf> {
    let folder = plan.out.join(format!("{}-{}", plan.scenario.name, DomainId::fresh()));
    let error = |path: PathBuf| |source| LaunchError::Folder { path, source };
    fs::create_dir_all(&folder).map_err(error(folder.clone()))?;
    let file = folder.join("scenario.toml");
    fs::write(&file, plan.scenario.to_toml()).map_err(error(file))?;
    link_latest(&folder);
    Ok(folder)
}

/// A flight that is recorded while it is simulated.
struct Flight<'a> {
    recording: Recording,
    progress: Progress<'a>,
    /// Why the log is not complete, if it is not.
    problem: Option<String>,
    is_interrupted: bool,
}

impl Flight<'_> {
    /// Flies until the end or until the user asks to `stop`.
    fn fly(&mut self, simulation: &mut Simulation, stop: &StopFlag) {
        let mut frames = Frames::new(simulation.scenario());
        let mut goes_on = true;
        while goes_on {
            goes_on = simulation.step();
            self.take_events(simulation);
            if let Some(frame) = frames.take(simulation) {
                let written = self.recording.observe(frame, None).err().map(|error| error.to_string());
                self.note(written);
            }
            self.show_progress(simulation.flown());
            if goes_on && stop.is_set() {
                self.interrupt(simulation.now());
                goes_on = false;
            }
        }
        self.progress.finish();
    }

    fn take_events(&mut self, simulation: &Simulation) {
        for event in simulation.events() {
            self.progress.print_event(event);
            // The recording announces the faults of the schedule by itself.
            if event.event.reporter() != Reporter::Schedule {
                self.recording.log_event(event.clone());
            }
        }
    }

    /// Keeps the first problem of the log: the flight goes on and is measured, as with a recorder that gave up.
    fn note(&mut self, problem: Option<String>) {
        self.problem = self.problem.take().or(problem);
    }

    fn show_progress(&mut self, flown: Option<Tick>) {
        let Some(tick) = flown.filter(|tick| tick.0 % PROGRESS_PERIOD == 0) else { return };
        if let Some(moment) = self.recording.moment() {
            self.progress.set_formation_error(&FormationError {
                tick: Tick(moment.tick),
                slot_error_max_m: moment.slot_error_max_m.unwrap_or_default(),
                commanded: moment.commanded,
                measured: u32::from(moment.slot_error_max_m.is_some()),
            });
        }
        self.progress.update(Some(tick));
    }

    fn interrupt(&mut self, tick: Tick) {
        self.is_interrupted = true;
        let event = TimedEvent { tick, event: Event::RunInterrupted };
        self.progress.print_event(&event);
        self.recording.log_event(event);
    }

    /// The world's report. An interrupted flight is not complete.
    fn report(&self, simulation: &Simulation) -> WorldReport {
        let report = simulation.report();
        WorldReport { complete: report.complete && !self.is_interrupted, ..report }
    }

    fn finish(&mut self, report: Option<&WorldReport>) {
        let written = self.recording.finish(report).err().map(|error| error.to_string());
        self.note(written);
    }
}

/// What the launcher would say of the same flight, with the times to the first tick and from there to the last.
fn outcome(
    folder: PathBuf,
    simulation: &Simulation,
    flight: &Flight,
    world: Option<WorldReport>,
    (start_time, flight_time): (Duration, Duration),
) -> Outcome {
    let mut failures = Vec::new();
    if simulation.is_world_ended() {
        failures.push("the world was ended as asked: the flight did not come to its end".into());
    } else if flight.is_interrupted {
        failures.push("interrupted before the end".into());
    }
    failures.extend(flight.problem.iter().map(|problem| format!("{problem}: the log is incomplete")));
    let report = flight.recording.report();
    let ticks = simulation.flown().map_or(0, |tick| tick.0.max(0));
    let recorder = Some(report);
    // Nobody can ask for faults while it flies.
    let added_faults = Vec::new();
    Outcome { folder, world, recorder, failures, added_faults, ticks, flight_time, start_time }
}
