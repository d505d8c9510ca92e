//! What every process of a run does to take part: join the domain, read the scenario, announce that it is ready.
//!
//! Must never know what the process does in the run.

use crate::{
    BoardAccess, BusError, Domain, DomainId, Gate, StopFlag, create_node,
    process::{die_with, is_running, set_process_name},
};
use iceoryx2::{node::Node, prelude::ipc};
use ringwing_flight::Part;
use ringwing_scenario::Scenario;

/// Which run to take part in.
#[derive(Debug, Clone, clap::Args)]
pub struct MemberArgs {
    /// The run's domain, as `ringwing run` prints it.
    #[arg(long)]
    pub domain: DomainId,
    /// Process id of the launcher to end with.
    #[arg(long, value_name = "PID", hide = true)]
    pub launcher: Option<u32>,
}

/// A process that takes part in a run.
#[derive(Debug)]
pub struct Member {
    part: Part,
    domain: Domain,
    scenario: Scenario,
    gate: Gate,
    node: Node<ipc::Service>,
    stop: StopFlag,
}

impl Member {
    /// Joins the run as `part`.
    ///
    /// The kernel ends this process with its launcher. A process that was started by hand has no launcher to end
    /// with; it stops by itself when the run's launcher is gone.
    pub fn join(args: &MemberArgs, part: Part) -> Result<Self, BusError> {
        if let Some(launcher) = args.launcher {
            die_with(launcher)?;
        }
        set_process_name(&part.node_name());
        let domain = Domain::join(&args.domain)?;
        let scenario = Scenario::of_run(&domain.scenario_text()?)?;
        let gate = domain.gate()?;
        // Before any port is opened: the process that has the part already has the ports as well.
        check_vacant(&domain, &gate, part)?;
        let node = create_node(&domain, &part.node_name())?;
        // A child inherits which signals its launcher ignores, as under `nohup`. It has to heed them all the same.
        let stop = if args.launcher.is_some() {
            StopFlag::on_signals_of_launcher()?
        } else {
            let (stop, domain) = (StopFlag::on_signals()?, domain.clone());
            stop.set_unless(move || domain.has_launcher())?;
            stop
        };
        Ok(Self { part, domain, scenario, gate, node, stop })
    }

    /// Which process of the run it is.
    pub fn part(&self) -> Part {
        self.part
    }

    /// The run's place in shared memory.
    pub fn domain(&self) -> &Domain {
        &self.domain
    }

    /// The scenario that the run flies.
    pub fn scenario(&self) -> &Scenario {
        &self.scenario
    }

    /// The node with which this process opens services.
    pub fn node(&self) -> &Node<ipc::Service> {
        &self.node
    }

    /// What this process needs to use boards.
    pub fn boards(&self) -> BoardAccess<'_> {
        BoardAccess { node: &self.node, gate: &self.gate }
    }

    /// How many cores the processes of the run share.
    pub fn cores(&self) -> u32 {
        self.gate.cores()
    }

    /// Set once this process is asked to stop.
    pub fn stop(&self) -> &StopFlag {
        &self.stop
    }

    /// Announces that this process is ready, and returns the gate. All ports that it needs must be open before.
    ///
    /// Fails if another process that still runs is ready as the same part.
    pub fn announce_ready(&self) -> Result<Gate, BusError> {
        let mut gate = self.gate.clone();
        // Check again: opening the ports takes a while, and another process may have become ready as this part
        // meanwhile.
        check_vacant(&self.domain, &gate, self.part)?;
        gate.note_missed(self.part);
        gate.set_ready_process(self.part, Some(std::process::id()));
        Ok(gate)
    }
}

/// Fails if another process that still runs is ready as `part`.
fn check_vacant(domain: &Domain, gate: &Gate, part: Part) -> Result<(), BusError> {
    let Some(other) = gate.ready_process(part).filter(|pid| is_running(*pid)) else { return Ok(()) };
    let problem = format!("process {other} already is the {part} of this run");
    Err(BusError::Domain { id: domain.id().to_string(), problem })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::domain::DomainOwner;

    #[test]
    fn a_part_is_taken_while_its_process_runs_and_free_after_that() {
        let (owner, gate) = DomainOwner::create(&Scenario::default().to_toml()).unwrap();
        let args = MemberArgs { domain: owner.domain().id().clone(), launcher: None };
        let member = Member::join(&args, Part::Leader).unwrap();
        assert_eq!(*member.scenario(), Scenario::default());
        gate.set_ready_process(Part::Leader, Some(u32::MAX));
        assert_eq!(member.announce_ready().unwrap().ready_process(Part::Leader), Some(std::process::id()));
        let error = member.announce_ready().unwrap_err().to_string();
        assert!(error.contains("already is the leader of this run"), "{error}");
    }

    #[test]
    fn nobody_joins_a_run_whose_scenario_is_unreadable() {
        let (owner, _gate) = DomainOwner::create("uavs = 'many'").unwrap();
        let args = MemberArgs { domain: owner.domain().id().clone(), launcher: None };
        let error = Member::join(&args, Part::World).unwrap_err();
        assert!(matches!(error, BusError::Scenario(_)), "{error}");
    }
}
