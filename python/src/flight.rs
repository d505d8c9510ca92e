//! Flies one scenario in this process, as `ringwing run --simulated` does.
//!
//! Must never leave another folder than the command would: `ringwing review`, `verify` and `latest` work on it.

use crate::{error::Failure, interrupt::SignalWatch};
use pyo3::prelude::*;
use ringwing_bus::{DomainId, write_whole};
use ringwing_recorder::{Summary, log::run_folder, summary::RunFindings};
use ringwing_scenario::{Fault, Reading, Scenario, Setting, Source, start};
use ringwing_study::{
    recorded::{RecordedEnd, RecordedFlight},
    shell::quoted,
};
use std::{
    path::{Path, PathBuf},
    time::Instant,
};

/// What to fly: a scenario, keys with their values, and faults.
struct Order {
    scenario: String,
    set: Vec<(String, String)>,
    faults: Vec<String>,
}

/// A flight that is over: its folder, unless nothing was recorded; its summary as JSON; and what the scenario's reader warns
/// of.
type Flown = (Option<PathBuf>, String, Vec<String>);

/// Flies `scenario` with the keys of `set` replaced and `faults` added. Writes the run's folder below `out`; without `out`, the
/// flight is only measured.
#[pyfunction]
pub(crate) fn fly(
    py: Python<'_>,
    scenario: String,
    set: Vec<(String, String)>,
    faults: Vec<String>,
    out: Option<PathBuf>,
) -> PyResult<Flown> {
    let order = Order { scenario, set, faults };
    // Release the interpreter's lock, so that other Python threads run during the flight.
    Ok(py.detach(|| order.fly(out.as_deref()))?)
}

impl Order {
    fn fly(&self, out: Option<&Path>) -> Result<Flown, Failure> {
        let begin = Instant::now();
        let reading = self.read()?;
        let scenario = &reading.scenario;
        let folder = out.map(|out| make_folder(out, scenario)).transpose()?;
        let log = folder.as_deref().map(run_folder::log_in);
        let mut flight = RecordedFlight::begin(scenario, log.as_deref())?;
        let takeoff = Instant::now();
        let raised = fly_to_end(&mut flight);
        let flight_time = takeoff.elapsed();
        let RecordedEnd { world, recorder, failures, ticks } = flight.finish();
        let found = RunFindings {
            world: world.as_ref(),
            flight: Some(recorder.summary),
            failures,
            ticks,
            start_time: takeoff - begin,
            flight_time,
            messages: log.as_ref().map(|_| recorder.messages),
            log: log.map(|log| log.display().to_string()),
            command: self.command(scenario.seed),
        };
        let summary = Summary::of_run(scenario, found).to_json();
        if let Some(folder) = &folder {
            let file = folder.join("summary.json");
            write_whole(&file, summary.clone() + "\n").map_err(|error| Failure::unwritable(&file, error))?;
        }
        // Only now: an interrupted flight leaves a whole folder, as with the command.
        match raised {
            Some(error) => Err(error.into()),
            None => Ok((folder, summary, reading.warnings().iter().map(ToString::to_string).collect())),
        }
    }

    fn read(&self) -> Result<Reading, Failure> {
        let faults =
            self.faults.iter().map(|sentence| parsed(sentence)).collect::<Result<Vec<Fault>, _>>()?;
        let settings: Vec<Setting> = self.set.iter().map(|(key, value)| setting(key, value)).collect();
        let reading = Reading::read(&Source::find(&self.scenario)?, &settings)?.with_faults(&faults)?;
        // Before a folder is made: UAVs without room to start are a mistake in the scenario.
        start::states(&reading.scenario)?;
        Ok(reading)
    }

    /// The command that repeats the flight.
    fn command(&self, seed: u64) -> String {
        let mut words = vec!["ringwing".to_owned(), "run".to_owned(), self.scenario.clone()];
        for (key, value) in &self.set {
            words.extend(["--set".to_owned(), format!("{key}={value}")]);
        }
        for fault in &self.faults {
            words.extend(["--fault".to_owned(), fault.clone()]);
        }
        words.extend(["--seed".to_owned(), seed.to_string(), "--simulated".to_owned()]);
        words.iter().map(|word| quoted(word)).collect::<Vec<_>>().join(" ")
    }
}

fn parsed(sentence: &str) -> Result<Fault, Failure> {
    sentence.parse::<Fault>().map_err(|error| Failure::Wrong(format!("fault {sentence:?}: {error}")))
}

/// The setting of `key`; messages name it as Python has it.
fn setting(key: &str, value: &str) -> Setting {
    Setting { written: format!("set[{key:?}] = {value}"), key: key.to_owned(), value: value.to_owned() }
}

fn make_folder(out: &Path, scenario: &Scenario) -> Result<PathBuf, Failure> {
    let folder = run_folder::create(out, scenario, &DomainId::fresh().to_string())
        .map_err(|(path, error)| Failure::unwritable(&path, error))?;
    run_folder::link_latest(&folder);
    Ok(folder)
}

/// Flies until the end, or until a signal handler raises an exception.
fn fly_to_end(flight: &mut RecordedFlight) -> Option<PyErr> {
    let mut signals = SignalWatch::new();
    while flight.step() {
        if let Some(error) = signals.raised() {
            flight.interrupt();
            return Some(error);
        }
    }
    None
}
