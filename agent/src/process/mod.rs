//! The process that flies one UAV.

mod fault_watch;
mod ports;

use crate::UavAgent;
use fault_watch::FaultWatch;
use ports::AgentPorts;
use ringwing_bus::{BusError, DomainId, Member, Wait, Waker, monotonic_ns};
use ringwing_flight::{Part, UavId};
use ringwing_scenario::{Scenario, ScenarioError};

/// Which UAV to fly, in which run.
#[derive(Debug, Clone, clap::Args)]
pub struct Args {
    /// The run's domain, as `ringwing run` prints it.
    #[arg(long)]
    pub domain: DomainId,
    /// The UAV to fly, from 1.
    #[arg(long, value_name = "NUMBER", value_parser = clap::value_parser!(u32).range(1..))]
    pub uav: u32,
    /// Process id of the launcher to end with.
    #[arg(long, hide = true)]
    pub launcher: Option<u32>,
}

/// Why a UAV cannot be flown.
#[derive(Debug, thiserror::Error)]
pub enum AgentError {
    /// The rest of the run cannot be reached.
    #[error(transparent)]
    Bus(#[from] BusError),
    /// The run's scenario is not readable.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
    /// There is no such UAV.
    #[error("--uav {uav}: this run has UAVs 1 to {count}")]
    NoSuchUav {
        /// The number given.
        uav: u32,
        /// How many there are.
        count: u32,
    },
}

/// Flies one UAV until the flight ends.
pub fn run(args: &Args) -> Result<(), AgentError> {
    let uav = UavId(args.uav);
    let member = Member::join(&args.domain, Part::Agent(uav), args.launcher)?;
    let scenario = Scenario::resolved(&member.domain().scenario()?)?;
    let count = scenario.formation.uavs;
    if uav.0 > count {
        return Err(AgentError::NoSuchUav { uav: uav.0, count });
    }
    let mut agent = UavAgent::new(&scenario, uav);
    let mut ports = AgentPorts::open(&member, &scenario, uav, &agent)?;
    let mut waker = Waker::of_answerer(&member, scenario.ipc.wake, scenario.time.real_time)?;
    let mut faults = FaultWatch::new(scenario, uav);
    let gate = member.attend()?;
    let mut seen = gate.missed();
    while let Wait::Tick(tick) = waker.wait(&gate, seen, member.stop())? {
        let woke_ns = monotonic_ns();
        if let Some(changed) = faults.changed_link_faults(&member, &gate)? {
            agent.set_faults(&changed);
        }
        ports.receive(&mut agent, &gate, tick)?;
        let read_ns = monotonic_ns();
        faults.delay_answer(tick);
        ports.send_link_counts(agent.link_counts(tick))?;
        let answer = agent.fly(tick);
        ports.update_inputs(&mut agent)?;
        ports.send(&answer, tick, woke_ns, read_ns)?;
        gate.answer();
        waker.answered()?;
        seen = Some(tick);
    }
    Ok(())
}
