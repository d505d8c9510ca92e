//! The programs of one simulated flight.
//!
//! Must never let a flight go on as if a program had answered that did not.

use crate::program::{Program, ProgramError};
use ringwing_agent::{Controller, Situation, Wish};
use ringwing_flight::UavId;
use ringwing_scenario::Scenario;
use std::{
    cell::RefCell,
    path::{Path, PathBuf},
    rc::Rc,
};

/// Makes the controller of a UAV whenever an agent of it starts; `None` leaves the UAV to the built-in law.
pub type MakeController = Box<dyn FnMut(UavId) -> Option<Box<dyn Controller>>>;

/// The programs of one simulated flight, as its scenario names them.
///
/// A process for each agent that starts: what a controller keeps between ticks is gone after a restart, as in a run. The
/// processes end with the simulation that has their controllers.
#[derive(Debug)]
pub struct Programs {
    flight: Rc<Flight>,
}

/// What all programs of a flight share.
#[derive(Debug)]
struct Flight {
    scenario: Scenario,
    text: String,
    /// The folder for what they print; `None` keeps only the end of it.
    output: Option<PathBuf>,
    /// Why the flight cannot go on: the first program that failed.
    failure: RefCell<Option<ProgramError>>,
}

impl Programs {
    /// The programs of `scenario`, before any is started. What they print is kept in `output`, in a file for each UAV.
    pub fn of(scenario: &Scenario, output: Option<&Path>) -> Self {
        let flight = Flight {
            scenario: scenario.clone(),
            text: scenario.to_toml(),
            output: output.map(Path::to_owned),
            failure: RefCell::default(),
        };
        Self { flight: Rc::new(flight) }
    }

    /// Starts a program for each agent that the scenario gives one.
    ///
    /// A program that cannot be started, ends or does not answer wishes nothing more. The caller has to ask for the
    /// [`failure`](Self::failure) after each tick, and to end the flight then.
    pub fn controllers(&self) -> MakeController {
        let flight = self.flight.clone();
        Box::new(move |uav| {
            let section = flight.scenario.agent_of(uav)?;
            let output = flight.output.as_deref();
            let start = || Program::start(&flight.scenario, &flight.text, uav, section, output);
            // After a failure the flight ends before anybody misses this one.
            let program = (!flight.has_failed()).then(start).transpose();
            let program = program.unwrap_or_else(|error| {
                flight.fail(error);
                None
            });
            Some(Box::new(Hosted { program, flight: flight.clone() }) as Box<dyn Controller>)
        })
    }

    /// Fails with why the flight cannot go on, once.
    ///
    /// # Errors
    /// A program could not be started, has ended, or does not answer.
    pub fn failure(&self) -> Result<(), ProgramError> {
        self.flight.failure.take().map_or(Ok(()), Err)
    }
}

impl Flight {
    fn has_failed(&self) -> bool {
        self.failure.borrow().is_some()
    }

    fn fail(&self, error: ProgramError) {
        self.failure.borrow_mut().get_or_insert(error);
    }
}

/// The controller of one UAV: a program, as long as it answers.
struct Hosted {
    program: Option<Program>,
    flight: Rc<Flight>,
}

impl Controller for Hosted {
    fn step(&mut self, situation: &Situation<'_>) -> Wish {
        let asked = self.program.as_mut().map(|program| program.ask(situation));
        match asked {
            Some(Ok(wish)) => return wish,
            Some(Err(error)) => {
                self.flight.fail(error);
                self.program = None;
            }
            None => {}
        }
        // Withheld, and the flight ends before anybody misses it.
        Wish::new(f64::NAN, f64::NAN)
    }
}
