//! The process that flies the virtual leader.

use crate::Path;
use ringwing_bus::{BusError, DomainId, Member, Stamps, Wait, Waker, channel, monotonic_ns};
use ringwing_flight::{Part, Tick};
use ringwing_scenario::{Scenario, ScenarioError};

/// Which run to lead.
#[derive(Debug, Clone, clap::Args)]
pub struct Args {
    /// The run's domain, as `ringwing run` prints it.
    #[arg(long)]
    pub domain: DomainId,
    /// Process id of the launcher to end with.
    #[arg(long, hide = true)]
    pub launcher: Option<u32>,
}

/// Why the leader cannot fly.
#[derive(Debug, thiserror::Error)]
pub enum LeaderError {
    /// The rest of the run cannot be reached.
    #[error(transparent)]
    Bus(#[from] BusError),
    /// The run's scenario is not readable.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
}

/// Flies the leader until the flight ends.
pub fn run(args: &Args) -> Result<(), LeaderError> {
    let member = Member::join(&args.domain, Part::Leader, args.launcher)?;
    let scenario = Scenario::resolved(&member.domain().scenario()?)?;
    let path = Path::new(&scenario);
    let publisher = channel::leader(scenario.formation.uavs).publisher(member.node())?;
    let mut waker = Waker::of_answerer(&member, scenario.ipc.wake, scenario.time.real_time)?;
    let gate = member.attend()?;
    let mut seen = gate.missed();
    while let Wait::Tick(tick) = waker.wait(&gate, seen, member.stop())? {
        let woke_ns = monotonic_ns();
        let stamps = || Stamps { woke_ns, read_ns: woke_ns, sent_ns: monotonic_ns(), sending_ns: 0 };
        if seen.is_none() && tick > Tick::APPROACH {
            // A predecessor may have been killed between two of its readers.
            publisher.send(path.at(Tick(tick.0 - 1)), stamps())?;
        }
        publisher.send(path.at(tick), stamps())?;
        gate.answer_as_leader(tick);
        waker.answered()?;
        seen = Some(tick);
    }
    Ok(())
}
