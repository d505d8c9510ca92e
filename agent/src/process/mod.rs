//! The process that flies one UAV.
//!
//! Never decides anything about the flight: the [`UavAgent`] does.

mod faults;
mod ports;

use crate::{
    UavAgent,
    controller::{Controller, Guest},
    pilot::{BuiltInLaw, Steer},
};
use faults::AgentFaults;
use ports::AgentPorts;
use ringwing_bus::{Answerer, BusError, Member, MemberArgs, monotonic_ns};
use ringwing_flight::{Part, Tick, UavId};
use ringwing_scenario::Scenario;

/// Which UAV to fly, in which run.
#[derive(Debug, Clone, clap::Args)]
pub struct AgentArgs {
    /// The run.
    #[command(flatten)]
    pub member: MemberArgs,
    /// The UAV to fly, from 1.
    #[arg(long, value_name = "NUMBER", value_parser = clap::value_parser!(u32).range(1..))]
    pub uav: u32,
}

/// Why a UAV cannot be flown.
#[derive(Debug, thiserror::Error)]
pub enum AgentError {
    /// The process cannot take part in the run.
    #[error(transparent)]
    Bus(#[from] BusError),
    /// The swarm has no such UAV.
    #[error("--uav {uav}: this run has UAVs 1 to {count}")]
    NoSuchUav {
        /// The number given.
        uav: u32,
        /// The number of UAVs.
        count: u32,
    },
}

/// What a user's controller may know before the flight.
#[derive(Debug, Clone, Copy)]
pub struct Start<'s> {
    /// The UAV that it will fly.
    pub uav: UavId,
    /// The scenario of the run.
    pub scenario: &'s Scenario,
}

/// Flies one UAV with the built-in law until the flight ends.
pub fn run(args: &AgentArgs) -> Result<(), AgentError> {
    fly(args, |start| BuiltInLaw::new(start.scenario))
}

/// Flies one UAV with the controller that `make` makes, until the flight ends.
pub fn run_controller<C: Controller>(
    args: &AgentArgs,
    make: impl FnOnce(&Start<'_>) -> C,
) -> Result<(), AgentError> {
    fly(args, |start| Guest::new(make(start)))
}

fn fly<S: Steer>(args: &AgentArgs, steering: impl FnOnce(&Start<'_>) -> S) -> Result<(), AgentError> {
    let uav = UavId(args.uav);
    let member = Member::join(&args.member, Part::Agent(uav))?;
    let scenario = member.scenario();
    check_uav(uav, scenario)?;
    let mut agent = UavAgent::steered_by(steering(&Start { uav, scenario }), scenario, uav);
    let mut ports = AgentPorts::open(&member, uav, &agent)?;
    let mut faults = AgentFaults::new(&member, uav);
    let mut answerer = Answerer::join(&member)?;
    while let Some(tick) = answerer.next_tick(|last| ports.rehearse(&agent, Tick(last.0 + 1)))? {
        let woke_ns = monotonic_ns();
        // Before anything is received: the faults decide what arrives in this tick.
        if let Some(changed) = faults.changed_link_faults(answerer.gate())? {
            agent.set_faults(&changed);
        }
        ports.receive(&mut agent, tick)?;
        let read_ns = monotonic_ns();
        // After the inputs are read, so that the log shows the delay as time to compute and not as time to read.
        faults.delay_answer(tick);
        ports.send_link_counts(&agent.link_counts(tick))?;
        let answer = agent.fly(tick);
        if let Some(notes) = agent.notes(tick) {
            ports.send_notes(notes, answerer.gate())?;
        }
        // Before the answer, which may end the tick: what the others send in the next one must find the inputs open.
        ports.update_inputs(&mut agent)?;
        ports.send(&answer, answerer.gate(), tick, woke_ns, read_ns)?;
        answerer.answer(tick)?;
        agent.plan_ahead();
    }
    Ok(())
}

fn check_uav(uav: UavId, scenario: &Scenario) -> Result<(), AgentError> {
    let count = scenario.formation.uavs;
    if uav.0 > count {
        return Err(AgentError::NoSuchUav { uav: uav.0, count });
    }
    Ok(())
}
