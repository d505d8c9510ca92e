//! The process that flies the virtual leader.
//!
//! Never decides where the leader is: the [path](crate::path) does.

use crate::Path;
use ringwing_bus::{Answerer, BoardWriter, BusError, Member, MemberArgs, Stamps, monotonic_ns, services};
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
    // Open the board first: once the leader is ready, the world may open a tick.
    let leader = Leader::open(&member)?;
    let mut answerer = Answerer::join(&member)?;
    while let Some(tick) = answerer.next_tick(|_| ())? {
        let woke_ns = monotonic_ns();
        leader.post(tick, woke_ns);
        answerer.answer(tick)?;
    }
    Ok(())
}

struct Leader {
    path: Path,
    board: BoardWriter<LeaderState>,
}

impl Leader {
    fn open(member: &Member) -> Result<Self, BusError> {
        let scenario = member.scenario();
        let board = services::leader(scenario.formation.uavs, scenario.pace()).writer(member.boards())?;
        Ok(Self { path: Path::new(scenario), board })
    }

    fn post(&self, tick: Tick, woke_ns: u64) {
        // The leader reads nothing between waking and sending.
        let stamps = Stamps { woke_ns, read_ns: woke_ns, sent_ns: monotonic_ns(), sending_ns: 0 };
        self.board.post(tick, self.path.at(tick), stamps);
    }
}
