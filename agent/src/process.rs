//! The process that flies one UAV.

use crate::{Pilot, faults::Faults, ports::Ports};
use ringwing_bus::{Ballast, BusError, DomainId, Member, Stamps, Wait, Waker, monotonic_ns};
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
    let mut pilot = Pilot::new(&scenario, uav);
    let mut ports = Ports::open(&member, uav, &scenario)?;
    let mut waker = Waker::of_answerer(&member, scenario.ipc.wake, scenario.time.real_time)?;
    let ballast = ballast(&member, uav, scenario.ipc.payload_bytes)?;
    let mut faults = Faults::new(scenario, uav);
    let gate = member.attend()?;
    let (mut seen, mut sending_ns) = (gate.missed(), 0);
    while let Wait::Tick(tick) = waker.wait(&gate, seen, member.stop())? {
        let woke_ns = monotonic_ns();
        if let Some(news) = faults.news(&member, &gate)? {
            ports.set_faults(news);
        }
        ports.receive(&mut pilot, tick)?;
        ports.receive_leader(&mut pilot, &member, &gate, tick)?;
        if let Some(ballast) = &ballast {
            ballast.receive()?;
        }
        let read_ns = monotonic_ns();
        faults.dawdle(tick);
        ports.send_counts(&member, tick)?;
        let decision = pilot.fly(tick);
        // Before the command, with which the tick may be over: what the others send in the next is meant to be heard.
        ports.listen_to(&member, pilot.listened())?;
        if let Some(decision) = decision {
            let sent_ns = monotonic_ns();
            let stamps = Stamps { woke_ns, read_ns, sent_ns, sending_ns };
            if let Some(ballast) = &ballast {
                ballast.send(tick)?;
            }
            ports.account.send(decision.account, stamps)?;
            ports.state.send(decision.state, stamps)?;
            ports.command.send(decision.command, stamps)?;
            sending_ns = monotonic_ns() - sent_ns;
        }
        gate.answer();
        waker.answered()?;
        seen = Some(tick);
    }
    Ok(())
}

/// The agent's end of the ballast, where some is carried.
fn ballast(member: &Member, uav: UavId, bytes: u32) -> Result<Option<Ballast>, BusError> {
    (bytes > 0).then(|| Ballast::of_agent(member.node(), uav, bytes)).transpose()
}
