//! A simulated flight with the programs that its scenario names as controllers.
//!
//! Must never go on after a program has failed: a UAV without its controller would fly another flight.

use ringwing_programs::{ProgramError, Programs};
use ringwing_scenario::{Scenario, ScenarioError};
use ringwing_simulation::{MakeController, Simulation, SimulationError};
use std::path::Path;

/// Why a flight cannot be flown here.
#[derive(Debug, thiserror::Error)]
pub enum FlightError {
    /// The scenario cannot be simulated.
    #[error(transparent)]
    Simulation(#[from] SimulationError),
    /// A program of the user's does not fly its UAV.
    #[error(transparent)]
    Program(#[from] ProgramError),
}

impl From<ScenarioError> for FlightError {
    fn from(error: ScenarioError) -> Self {
        Self::Simulation(error.into())
    }
}

/// Whether `scenario` can be simulated: it does not fly in real time, and its programs are there.
///
/// # Errors
/// Why it cannot.
pub fn check(scenario: &Scenario) -> Result<(), FlightError> {
    ringwing_simulation::check(scenario)?;
    Ok(ringwing_programs::check(scenario).map_err(ProgramError::from)?)
}

/// A simulated flight, and the programs that fly in it.
pub(crate) struct CrewedFlight {
    simulation: Simulation,
    programs: Programs,
}

impl CrewedFlight {
    /// The flight of `scenario`, which has been validated, before its first tick.
    pub(crate) fn begin(scenario: &Scenario) -> Result<Self, FlightError> {
        Self::begin_with(scenario, None, Box::new(|_| None))
    }

    /// As [`begin`](Self::begin). A UAV for which `make_controller` returns a controller flies with that, and not with a
    /// program. What programs print is kept in the folder `output`.
    pub(crate) fn begin_with(
        scenario: &Scenario,
        output: Option<&Path>,
        mut make_controller: MakeController,
    ) -> Result<Self, FlightError> {
        let programs = Programs::of(scenario, output);
        let mut controllers = programs.controllers();
        let make: MakeController = Box::new(move |uav| make_controller(uav).or_else(|| controllers(uav)));
        let simulation = Simulation::with_controllers(scenario, make)?;
        // Each agent of the first tick has started its program.
        programs.failure()?;
        Ok(Self { simulation, programs })
    }

    /// Flies the next tick. Returns whether there is one after it.
    pub(crate) fn step(&mut self) -> Result<bool, ProgramError> {
        let goes_on = self.simulation.step();
        self.programs.failure()?;
        Ok(goes_on)
    }

    /// The flight itself.
    pub(crate) fn simulation(&self) -> &Simulation {
        &self.simulation
    }
}
