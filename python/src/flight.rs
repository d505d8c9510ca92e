//! Flies one scenario in this process, as `ringwing run --simulated` does.
//!
//! Must never leave another folder than the command would: `ringwing review`, `verify` and `latest` work on it.

use crate::{
    controller::{FirstFailure, PythonController},
    error::Failure,
    interrupt::SignalWatch,
};
use pyo3::prelude::*;
use ringwing_bus::{DomainId, write_whole};
use ringwing_recorder::{Summary, log::run_folder, summary::RunFindings};
use ringwing_scenario::{AgentSection, Fault, Reading, Scenario, Setting, Source, start};
use ringwing_study::{
    recorded::{MakeController, Places, RecordedEnd, RecordedFlight},
    shell::quoted,
};
use std::{
    path::{Path, PathBuf},
    sync::Arc,
    time::Instant,
};

/// What to fly: a scenario, keys with their values, faults, and controllers.
struct Order {
    scenario: String,
    set: Vec<(String, String)>,
    faults: Vec<String>,
    controllers: Vec<ControllerOrder>,
}

/// What makes a controller in Python, with its name and the UAV that it flies; without a UAV, it flies all.
type ControllerOrder = (Option<u32>, String, Py<PyAny>);

/// A flight that is over: its folder, unless nothing was recorded; its summary as JSON; and what the user has to be warned of.
type Flown = (Option<PathBuf>, String, Vec<String>);

/// Flies `scenario` with the keys of `set` replaced and `faults` added, and with `controllers` for some UAVs. Writes the
/// run's folder below `out`; without `out`, the flight is only measured.
#[pyfunction]
pub(crate) fn fly(
    py: Python<'_>,
    scenario: String,
    set: Vec<(String, String)>,
    faults: Vec<String>,
    controllers: Vec<ControllerOrder>,
    out: Option<PathBuf>,
) -> PyResult<Flown> {
    let order = Order { scenario, set, faults, controllers };
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
        let output = folder.as_deref().map(run_folder::output_in);
        let places = Places { log: log.as_deref(), output: output.as_deref() };
        let failure = Arc::new(FirstFailure::default());
        let mut flight = RecordedFlight::begin_with(scenario, places, self.controllers(scenario, &failure))?;
        // Only now: a flight that cannot begin must not hide the one before.
        if let Some(folder) = &folder {
            run_folder::link_latest(folder);
        }
        let takeoff = Instant::now();
        let raised = fly_to_end(&mut flight, &failure);
        let flight_time = takeoff.elapsed();
        let RecordedEnd { world, recorder, failures, ticks } = flight.finish();
        let mut warnings: Vec<String> = reading.warnings().iter().map(ToString::to_string).collect();
        warnings.extend(recorder.refused_notes);
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
            None => Ok((folder, summary, warnings)),
        }
    }

    fn read(&self) -> Result<Reading, Failure> {
        let faults =
            self.faults.iter().map(|sentence| parsed(sentence)).collect::<Result<Vec<Fault>, _>>()?;
        let settings: Vec<Setting> = self.set.iter().map(|(key, value)| setting(key, value)).collect();
        let reading = Reading::read(&Source::find(&self.scenario)?, &settings)?
            .with_faults(&faults)?
            .with_agents(&self.agents())?;
        // Before a folder is made: UAVs without room to start are a mistake in the scenario.
        start::states(&reading.scenario)?;
        Ok(reading)
    }

    /// The controllers as the scenario in the log names them, so that nobody takes their flight for one of the built-in law.
    fn agents(&self) -> Vec<AgentSection> {
        let section = |(uav, name, _): &ControllerOrder| AgentSection {
            uavs: uav.map_or_else(|| "all".into(), |uav| uav.to_string()),
            command: vec![name.clone()],
            folder: String::new(),
        };
        self.controllers.iter().map(section).collect()
    }

    /// Makes the controllers of the flight; their first exception is kept in `failure`.
    fn controllers(&self, scenario: &Scenario, failure: &Arc<FirstFailure>) -> MakeController {
        let makes: Vec<(Option<u32>, Py<PyAny>)> = Python::attach(|py| {
            self.controllers.iter().map(|(uav, _, make)| (*uav, make.clone_ref(py))).collect()
        });
        let (scenario, failure) = (scenario.clone(), failure.clone());
        Box::new(move |uav| {
            let (_, make) = makes.iter().rev().find(|(named, _)| named.is_none_or(|named| named == uav.0))?;
            Some(PythonController::boxed(make, uav, &scenario, &failure))
        })
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
    Ok(folder)
}

/// Flies until the end, or until a signal handler or a controller raises an exception.
fn fly_to_end(flight: &mut RecordedFlight, failure: &FirstFailure) -> Option<PyErr> {
    let mut signals = SignalWatch::new();
    let mut goes_on = true;
    while goes_on {
        goes_on = flight.step();
        if let Some(error) = failure.take().or_else(|| signals.raised()) {
            flight.interrupt();
            return Some(error);
        }
    }
    None
}
