//! What a process does to look at a live run from outside: join the domain, read the scenario, ask the launcher for a place.
//!
//! Must never take a part of the run: nobody waits for an observer, and the run ends without it.

use crate::{
    BusError, BusNode, Domain, DomainId, Gate, MemberArgs, StopFlag, create_node, demand,
    process::{die_with, set_process_name},
};
use ringwing_scenario::Scenario;

/// The request with which an observer asks the launcher for a place at the services.
pub const OBSERVE: &str = "observe";

/// A process that looks at a live run.
#[derive(Debug)]
pub struct Observer {
    domain: Domain,
    scenario: Scenario,
    gate: Gate,
    node: BusNode,
    stop: StopFlag,
}

impl Observer {
    /// Joins the run as the run's own viewer, called `name`; the kernel ends this process with its launcher.
    pub fn of_run(args: &MemberArgs, name: &str) -> Result<Self, BusError> {
        let Some(launcher) = args.launcher else { return Self::join(&args.domain, name) };
        die_with(launcher)?;
        set_process_name(name);
        Self::open(&args.domain, name, StopFlag::on_signals_of_launcher()?)
    }

    /// Joins the run `id` as `name`, for a process that lives longer than the run.
    pub fn join(id: &DomainId, name: &str) -> Result<Self, BusError> {
        let stop = StopFlag::on_signals()?;
        Self::open(id, name, stop)
    }

    fn open(id: &DomainId, name: &str, stop: StopFlag) -> Result<Self, BusError> {
        let domain = Domain::join(id)?;
        // An observer that was killed keeps its place until somebody cleans up, and only the launcher does that.
        let answer = domain.ask(OBSERVE)?;
        if answer.is_refusal() {
            return Err(BusError::NoAnswer { id: id.to_string(), problem: answer.to_string() });
        }
        let scenario = Scenario::of_run(&domain.scenario_text()?)?;
        let (gate, node) = (domain.gate()?, create_node(&domain, name)?);
        Ok(Self { domain, scenario, gate, node, stop })
    }

    /// The run's place in shared memory.
    pub fn domain(&self) -> &Domain {
        &self.domain
    }

    /// The scenario that the run flies.
    pub fn scenario(&self) -> &Scenario {
        &self.scenario
    }

    /// The run's tick gate, to look at.
    pub fn gate(&self) -> &Gate {
        &self.gate
    }

    /// The node with which this process opens services.
    pub fn node(&self) -> &BusNode {
        &self.node
    }

    /// Set once this process is asked to stop.
    pub fn stop(&self) -> &StopFlag {
        &self.stop
    }

    /// Whether the run is over, in whatever way.
    pub fn is_run_over(&self) -> bool {
        self.gate.is_closed() || !self.domain.has_launcher()
    }
}

impl Domain {
    /// Makes sure that there is room for one more observer of a swarm of `uavs`.
    pub fn make_room_for_observer(&self, uavs: u32) -> Result<(), BusError> {
        self.make_room(demand::observer_bytes(uavs))
    }
}
