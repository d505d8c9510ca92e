//! The process that flies the virtual leader.
//!
//! Never decides where the leader is: the [path](crate::path) does.

use crate::Path;
use ringwing_bus::{Answerer, BusError, Member, MemberArgs, Publisher, Stamps, monotonic_ns, services};
use ringwing_flight::{LeaderState, Part, Tick};

/// Which run to lead.
#[derive(Debug, Clone, clap::Args)]
pub struct LeaderArgs {
    /// The run.
    #[command(flatten)]
    pub member: MemberArgs,
}

/// Flies the leader until the flight ends.
pub fn run(args: &LeaderArgs) -> Result<(), BusError> {
    let member = Member::join(&args.member, Part::Leader)?;
    let leader = Leader::open(&member)?;
    let mut answerer = Answerer::join(&member)?;
    while let Some(tick) = answerer.next_tick()? {
        let woke_ns = monotonic_ns();
        if answerer.is_new() {
            leader.repeat_before(tick, woke_ns)?;
        }
        leader.publish(tick, woke_ns)?;
        answerer.answer_as_leader(tick)?;
    }
    Ok(())
}

struct Leader {
    path: Path,
    publisher: Publisher<LeaderState>,
}

impl Leader {
    fn open(member: &Member) -> Result<Self, BusError> {
        let scenario = member.scenario();
        let publisher = services::leader(scenario.formation.uavs).publisher(member.node())?;
        Ok(Self { path: Path::new(scenario), publisher })
    }

    /// Repeats the state of the tick before `tick`: a predecessor may have been killed after it had sent that state to
    /// some of the agents only.
    fn repeat_before(&self, tick: Tick, woke_ns: u64) -> Result<(), BusError> {
        if tick == Tick::APPROACH {
            return Ok(());
        }
        self.publish(Tick(tick.0 - 1), woke_ns)
    }

    fn publish(&self, tick: Tick, woke_ns: u64) -> Result<(), BusError> {
        // The leader reads nothing between waking and sending.
        let stamps = Stamps { woke_ns, read_ns: woke_ns, sent_ns: monotonic_ns(), sending_ns: 0 };
        self.publisher.send(self.path.at(tick), stamps)
    }
}
