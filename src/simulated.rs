//! A flight in this process instead of one process per part: `run --simulated`, and what `verify` repeats a flight with.
//!
//! Writes the same log as the processes, without wall-clock times. Must never use shared memory, nor start a process of the run: only the
//! user's own programs have processes.

use crate::launcher::{LaunchError, Outcome, Plan, Progress};
use ringwing_bus::{DomainId, StopFlag};
use ringwing_flight::{FormationError, Tick};
use ringwing_recorder::log::run_folder;
use ringwing_study::recorded::{Places, RecordedEnd, RecordedFlight};
use std::{path::PathBuf, time::Instant};

/// Ticks between two looks at the progress line. More make it jerk; fewer cost time in short ticks.
const PROGRESS_PERIOD: i64 = 100;

/// Flies `plan` to its end in this process, and says how it went.
///
/// # Errors
/// The scenario flies in real time, or the run's folder or its log cannot be written.
pub(crate) fn fly(plan: &Plan) -> anyhow::Result<Outcome> {
    let begin = Instant::now();
    let stop = StopFlag::on_signals()?;
    let folder = make_folder(plan)?;
    let log = plan.record.then(|| run_folder::log_in(&folder));
    let output = run_folder::output_in(&folder);
    let places = Places { log: log.as_deref(), output: Some(&output) };
    let mut flight = RecordedFlight::begin(&plan.scenario, places)?;
    // Only now: a flight that cannot begin must not hide the one before.
    run_folder::link_latest(&folder);
    let progress = Progress::new(&plan.scenario, plan.quiet);
    progress.print(&format!("simulated, folder {}", folder.display()));
    let takeoff = Instant::now();
    fly_to_end(&mut flight, progress, &stop);
    let flight_time = takeoff.elapsed();
    let RecordedEnd { world, recorder, failures, ticks } = flight.finish();
    Ok(Outcome {
        folder,
        world,
        recorder: Some(recorder),
        failures,
        // Nobody can ask for faults while it flies.
        added_faults: Vec::new(),
        ticks,
        flight_time,
        start_time: takeoff - begin,
    })
}

/// Makes the folder of the run, as the launcher does.
fn make_folder(plan: &Plan) -> Result<PathBuf, LaunchError> {
    let id = DomainId::fresh().to_string();
    let folder = run_folder::create(&plan.out, &plan.scenario, &id)
        .map_err(|(path, source)| LaunchError::Folder { path, source })?;
    Ok(folder)
}

/// Flies until the end or until the user asks to `stop`.
fn fly_to_end(flight: &mut RecordedFlight, mut progress: Progress, stop: &StopFlag) {
    let mut goes_on = true;
    while goes_on {
        goes_on = flight.step();
        for event in flight.events() {
            progress.print_event(event);
        }
        show_progress(flight, &mut progress);
        if goes_on && stop.is_set() {
            progress.print_event(&flight.interrupt());
            goes_on = false;
        }
    }
    progress.finish();
}

fn show_progress(flight: &RecordedFlight, progress: &mut Progress) {
    let Some(tick) = flight.simulation().flown().filter(|tick| tick.0 % PROGRESS_PERIOD == 0) else { return };
    if let Some(moment) = flight.moment() {
        progress.set_formation_error(&FormationError {
            tick: Tick(moment.tick),
            slot_error_max_m: moment.slot_error_max_m.unwrap_or_default(),
            commanded: moment.commanded,
            measured: u32::from(moment.slot_error_max_m.is_some()),
        });
    }
    progress.update(Some(tick));
}
