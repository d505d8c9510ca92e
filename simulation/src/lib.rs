//! A whole flight in one process: every agent, the leader, the world, every fault, and the measures of it all.
//!
//! [`Simulation`] flies tick by tick, by the very code that the processes run; [`fly`] flies a scenario to its end and
//! measures it. The payload hash, the measures and the verdict are those of the processes in lockstep, to the bit.
//!
//! Never opens a file, starts a thread, reads a clock or waits: a flight is a function of its scenario.
//!
//! # What a process fault does
//!
//! The processes follow the same rules; `tests/simulation.rs` compares both.
//!
//! - The actions of tick k happen after tick k - 1 is complete and before the senses of tick k are published, one after
//!   another in the order of the schedule. Each sees the effect of the one before.
//! - A killed or stopped agent answered tick k - 1 last. What it sent then is still used.
//! - A new process has no part in tick k - 1. It hears nothing that was sent before tick k, so in tick k it knows only
//!   its own senses.
//! - A frozen process keeps its memory. When it is thawed at tick t it first answers the tick that it finds open, t - 1,
//!   unless it already has. It uses the newest samples for that tick and skips everything older that was sent while it
//!   was frozen. Its late command is offered to the airframe, and not hashed. All that it sends in that answer belongs to
//!   tick t - 1, also in the measures.
//! - A leader is a function of the tick alone, so a new one continues where the old one was. Without a running
//!   leader, agents go on by its last state.
//! - The recorder never changes the flight. A killed or stopped world ends it before tick k.
//! - A slow process makes all wait, and changes nothing.

#![cfg_attr(not(test), warn(clippy::disallowed_methods))]

mod inputs;
mod measurement;
pub mod random;
mod seat_agent;
mod simulation;

pub use measurement::{Flown, Frames, Measurement, fly};
pub use ringwing_agent::controller::MakeController;
pub use simulation::Simulation;

use ringwing_flight::UavId;
use ringwing_scenario::{AgentSection, Scenario, ScenarioError};

/// Refuses a flight in real time.
///
/// # Errors
/// `scenario` flies in real time.
pub fn check(scenario: &Scenario) -> Result<(), SimulationError> {
    if scenario.time.real_time { Err(SimulationError::RealTime(scenario.name.clone())) } else { Ok(()) }
}

/// The error that `agent` flies `uav` of `scenario`.
fn own_program(scenario: &Scenario, uav: UavId, agent: &AgentSection) -> SimulationError {
    SimulationError::OwnProgram { scenario: scenario.name.clone(), uav, command: agent.command_line() }
}

/// Why a scenario cannot be flown here.
#[derive(Debug, thiserror::Error)]
pub enum SimulationError {
    /// The UAVs find no room to start.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
    /// A flight in real time depends on the wall clock.
    #[error("scenario {0:?} flies in real time, which cannot be simulated: set time.real_time = false")]
    RealTime(String),
    /// A program of the user's flies a UAV, and nobody has started it.
    #[error(
        "scenario {scenario:?}: {uav} is flown by a program of its own ({command}), which a simulation does not start"
    )]
    OwnProgram {
        /// The scenario's name.
        scenario: String,
        /// The first such UAV.
        uav: UavId,
        /// The program and its arguments.
        command: String,
    },
}
