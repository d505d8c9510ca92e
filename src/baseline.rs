//! What the faults of a flight have cost: its log, compared with the same flight without them.
//!
//! Never measures anything itself; `ringwing_study` flies the undisturbed flight in the simulation and compares.

use crate::WrongUsage;
use ringwing_recorder::{
    log::reader::{Reader, Replayed},
    metrics::Deviation,
};
use ringwing_scenario::Scenario;
use ringwing_study::{Baseline, flight};
use std::path::Path;

/// Compares the flight in the log at `path`.
///
/// # Errors
/// The log cannot be read, or its flight cannot be simulated.
pub(crate) fn of_log(path: &Path) -> anyhow::Result<Deviation> {
    let mut reader = Reader::open(path)?;
    let scenario = reader.scenario()?;
    let mut baseline = begin(&scenario)?;
    for tick in reader.ticks(&scenario).filter(Replayed::has_uavs) {
        baseline.observe(&tick.frame);
    }
    Ok(baseline.finish()?)
}

/// The baseline of a flight of `scenario`, before its first tick.
///
/// # Errors
/// As [`check`].
pub(crate) fn begin(scenario: &Scenario) -> anyhow::Result<Baseline> {
    check(scenario)?;
    Ok(Baseline::new(scenario)?)
}

/// Refuses a flight whose baseline cannot be simulated.
///
/// # Errors
/// The scenario flies in real time, in which two flights differ without a fault, too, or a program that it names is not there.
pub(crate) fn check(scenario: &Scenario) -> Result<(), WrongUsage> {
    let message = |error| format!("--baseline simulates the flight without its faults: {error}");
    flight::check(scenario).map_err(|error| WrongUsage(message(error)))
}
