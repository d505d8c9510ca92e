//! Controllers written in Python: as the agent of one UAV in a process of its own, or in a simulated flight.
//!
//! Must never hold the interpreter's lock while an agent waits, and never let an exception pass unnoticed.

use crate::{error::AgentError, situation::Situation};
use pyo3::{
    exceptions::{PySystemExit, PyTypeError, PyValueError},
    prelude::*,
    types::PyDict,
};
use ringwing_controller::{Controller, RunError, Scenario, UavId, run};
use std::{
    ffi::OsString,
    process,
    sync::{Arc, Mutex, PoisonError},
};

/// What a controller wants its UAV to fly.
#[pyclass(frozen, module = "ringwing")]
#[derive(Debug, Clone, Copy)]
pub(crate) struct Wish(ringwing_controller::Wish);

#[pymethods]
impl Wish {
    #[new]
    #[pyo3(signature = (speed_m_s, turn_rate_rad_s, notes=None))]
    fn new(speed_m_s: f64, turn_rate_rad_s: f64, notes: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let mut wish = ringwing_controller::Wish::new(speed_m_s, turn_rate_rad_s);
        for (name, value) in notes.into_iter().flatten() {
            let name: String = name.extract()?;
            let value = value
                .extract()
                .map_err(|_| PyTypeError::new_err(format!("note {name:?} is no number: {value}")))?;
            // Raised here, where the note is made: what is refused later is only a warning after the flight.
            wish.notes
                .set(&name, value)
                .map_err(|why| PyValueError::new_err(format!("note {name:?} cannot be recorded: {why}")))?;
        }
        Ok(Self(wish))
    }

    #[getter]
    fn speed_m_s(&self) -> f64 {
        self.0.speed_m_s
    }

    #[getter]
    fn turn_rate_rad_s(&self) -> f64 {
        self.0.turn_rate_rad_s
    }

    #[getter]
    fn notes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let notes = PyDict::new(py);
        self.0.notes.iter().try_for_each(|(name, value)| notes.set_item(name, value))?;
        Ok(notes)
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let notes = self.notes(py)?;
        let shown = if notes.is_empty() { String::new() } else { format!(", {}", notes.repr()?) };
        Ok(format!("Wish({}, {}{shown})", self.0.speed_m_s, self.0.turn_rate_rad_s))
    }
}

/// The unit vector along a heading, as the built-in law computes it.
#[pyfunction]
pub(crate) fn direction(heading_rad: f64) -> (f64, f64) {
    let along = ringwing_controller::direction(heading_rad);
    (along.x, along.y)
}

/// The wish of a controller that has failed. It is withheld, and the flight ends before anybody misses it.
fn no_wish() -> ringwing_controller::Wish {
    ringwing_controller::Wish::new(f64::NAN, f64::NAN)
}

/// The controller of one UAV, an object with the method `step`.
pub(crate) struct PythonController {
    object: Py<PyAny>,
    on_failure: OnFailure,
}

/// What to do with an exception of a controller.
pub(crate) enum OnFailure {
    /// Print it, and end this process: nobody knows what state the controller is in.
    Exit,
    /// Keep it, for the call that flies.
    Keep(Arc<FirstFailure>),
}

/// The first exception of the controllers of a flight, and the UAV whose controller raised it.
#[derive(Debug, Default)]
pub(crate) struct FirstFailure(Mutex<Option<PyErr>>);

impl FirstFailure {
    /// Takes it, if there is one.
    pub(crate) fn take(&self) -> Option<PyErr> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).take()
    }

    fn keep(&self, failure: PyErr) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(failure);
    }
}

impl PythonController {
    /// What `make(uav, scenario, arguments)` returns, with the scenario as JSON.
    fn made(
        py: Python<'_>,
        make: &Py<PyAny>,
        (uav, scenario, arguments): (UavId, &Scenario, Vec<OsString>),
        on_failure: OnFailure,
    ) -> PyResult<Self> {
        let scenario = serde_json::to_string(scenario).unwrap_or_default();
        Ok(Self { object: make.call1(py, (uav.0, scenario, arguments))?, on_failure })
    }

    /// A controller of `uav` in a simulated flight. If `make` raises, `failure` keeps that, and the flight ends at once.
    pub(crate) fn boxed(
        make: &Py<PyAny>,
        uav: UavId,
        scenario: &Scenario,
        failure: &Arc<FirstFailure>,
    ) -> Box<dyn Controller> {
        let on_failure = OnFailure::Keep(failure.clone());
        Python::attach(|py| match Self::made(py, make, (uav, scenario, Vec::new()), on_failure) {
            Ok(controller) => Box::new(controller) as Box<dyn Controller>,
            Err(error) => {
                failure.keep(error);
                Box::new(Unmade)
            }
        })
    }

    fn ask(&self, py: Python<'_>, situation: Situation) -> PyResult<Wish> {
        let wish = self.object.call_method1(py, "step", (situation,))?;
        let wish = wish.bind(py);
        let Ok(wish) = wish.cast::<Wish>() else {
            let kind = wish.get_type().name()?;
            return Err(PyTypeError::new_err(format!(
                "step returned {kind}: return ringwing.Wish(speed_m_s, turn_rate_rad_s)"
            )));
        };
        Ok(*wish.get())
    }
}

/// Stands in for a controller that could not be made, until the flight ends for that reason.
struct Unmade;

impl Controller for Unmade {
    fn step(&mut self, _: &ringwing_controller::Situation<'_>) -> ringwing_controller::Wish {
        no_wish()
    }
}

impl Controller for PythonController {
    fn step(&mut self, situation: &ringwing_controller::Situation<'_>) -> ringwing_controller::Wish {
        let told = Situation::new(situation);
        Python::attach(|py| match self.ask(py, told) {
            Ok(Wish(wish)) => wish,
            Err(failure) => {
                match &self.on_failure {
                    OnFailure::Exit => exit_with(py, &failure),
                    OnFailure::Keep(first) => first.keep(failure),
                }
                no_wish()
            }
        })
    }
}

/// Prints the traceback, and ends this process as an exception at the top of a script does.
fn exit_with(py: Python<'_>, failure: &PyErr) -> ! {
    failure.print(py);
    process::exit(1)
}

/// Flies one UAV of a run as its agent, with the controller that `make(uav, scenario, arguments)` returns, until the flight ends.
/// `arguments` are those of the program, without its name.
#[pyfunction]
pub(crate) fn run_agent(py: Python<'_>, arguments: Vec<OsString>, make: Py<PyAny>) -> PyResult<()> {
    // An agent mostly waits. Other threads of the interpreter run meanwhile.
    let ended = py.detach(|| {
        run(&arguments, |start| {
            Python::attach(|py| {
                let about = (start.uav, start.scenario, start.arguments.to_vec());
                PythonController::made(py, &make, about, OnFailure::Exit)
                    .unwrap_or_else(|failure| exit_with(py, &failure))
            })
        })
    });
    ended.map_err(|error| match error {
        RunError::Usage(text) => PySystemExit::new_err(text),
        RunError::Agent(error) => AgentError::new_err(error.to_string()),
        RunError::Simulated(error) => AgentError::new_err(error.to_string()),
    })
}
