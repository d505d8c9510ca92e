//! The programs of one simulated flight.
//!
//! Must never let a flight go on after a program failed to answer.

use crate::program::{Program, ProgramError};
use ringwing_agent::{Controller, Situation, Wish, controller::MakeController};
use ringwing_bus::raise_open_files_limit;
use ringwing_flight::UavId;
use ringwing_scenario::Scenario;
use std::{
    cell::RefCell,
    collections::BTreeMap,
    path::{Path, PathBuf},
    rc::Rc,
};

/// The programs of one simulated flight, as its scenario names them.
///
/// A process for each agent that starts: what a controller keeps between ticks is gone after a restart, as in a run. The
/// processes end with the flight; that of a UAV which is killed for good waits until then.
#[derive(Debug)]
pub struct Programs {
    flight: Rc<Flight>,
}

/// What all programs of a flight share.
#[derive(Debug)]
struct Flight {
    scenario: Scenario,
    /// The folder for what they print; `None` keeps only the end of it.
    output: Option<PathBuf>,
    /// The running program of each UAV that has one.
    running: RefCell<BTreeMap<UavId, Program>>,
    /// Why the flight cannot go on: the first program that failed.
    failure: RefCell<Option<ProgramError>>,
}

impl Programs {
    /// The programs of `scenario`, before any is started. What they print is kept in `output`, in a file for each UAV.
    pub fn of(scenario: &Scenario, output: Option<&Path>) -> Self {
        let flight = Flight {
            scenario: scenario.clone(),
            output: output.map(Path::to_owned),
            running: RefCell::default(),
            failure: RefCell::default(),
        };
        // Each program takes two or three files, and a sweep flies many flights at once.
        if scenario.first_own_agent().is_some() {
            // If that is not permitted, the few programs of most flights still start.
            let _ = raise_open_files_limit();
        }
        Self { flight: Rc::new(flight) }
    }

    /// Starts a program for each agent for which the scenario names one, and ends the program that the UAV had before.
    ///
    /// If a program cannot be started, ends, or does not answer, its controller gives no more wishes. The caller has to ask for
    /// the [`failure`](Self::failure) after each tick, and to end the flight then.
    pub fn controllers(&self) -> MakeController {
        let flight = self.flight.clone();
        Box::new(move |uav| {
            flight.scenario.agent_of(uav)?;
            flight.restart(uav);
            Some(Box::new(Hosted { uav, flight: flight.clone() }) as Box<dyn Controller>)
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
    /// Starts the program of `uav` in place of the one that runs.
    fn restart(&self, uav: UavId) {
        // First, as after a kill in a run: both may want the same file or port.
        self.running.borrow_mut().remove(&uav);
        // After a failure the flight ends before anybody misses this one.
        if self.failure.borrow().is_some() {
            return;
        }
        let Some(section) = self.scenario.agent_of(uav) else { return };
        match Program::start(&self.scenario, uav, section, self.output.as_deref()) {
            Ok(program) => drop(self.running.borrow_mut().insert(uav, program)),
            Err(error) => self.fail(error),
        }
    }

    fn fail(&self, error: ProgramError) {
        self.failure.borrow_mut().get_or_insert(error);
    }
}

/// The controller of one UAV: its program, as long as it answers.
struct Hosted {
    uav: UavId,
    flight: Rc<Flight>,
}

impl Controller for Hosted {
    fn step(&mut self, situation: &Situation<'_>) -> Wish {
        let mut running = self.flight.running.borrow_mut();
        match running.get_mut(&self.uav).map(|program| program.ask(situation)) {
            Some(Ok(wish)) => return wish,
            Some(Err(error)) => {
                self.flight.fail(error);
                running.remove(&self.uav);
            }
            None => {}
        }
        // Withheld, and the flight ends before anybody misses it.
        Wish::new(f64::NAN, f64::NAN)
    }
}
