//! The hidden command `bench-case`, which measures one case once: its arguments, and the cases without a flight.
//!
//! Every measurement runs in its own process, so that no measurement affects the next. The command itself flies the
//! cases of the swarm, because only it can launch one.
//!
//! Must never compute a latency: the process leaves a trace in a file.

use crate::{
    args::PlacementArgs,
    case::Case,
    error::BenchError,
    measure::MeasureArgs,
    peer_program::{processes, program::PeerProgram},
    transport::hub,
};
use ringwing_bus::{Domain, DomainId};

/// Name of the log of a flight, in the folder of its trace; the process that flies the case moves it there.
pub const FLIGHT_LOG: &str = "flight.mcap";

/// What to measure.
#[derive(Debug, Clone, clap::Args)]
pub struct CaseArgs {
    /// The case, in JSON.
    #[arg(long)]
    pub case: Case,
    /// Seed of the flight.
    #[arg(long)]
    pub seed: u64,
    /// Domain of a hub and its peers; a flight creates its own, and a peer program needs none.
    #[arg(long)]
    pub domain: Option<DomainId>,
    /// The program to measure, if the case is of one.
    #[arg(long)]
    pub peer: Option<PeerProgram>,
    /// What to measure, and where to write it.
    #[command(flatten)]
    pub measure: MeasureArgs,
    /// Where the processes of the case run.
    #[command(flatten)]
    pub placement: PlacementArgs,
    /// Process id of the benchmark; the case ends with it.
    #[arg(long)]
    pub launcher: u32,
}

impl CaseArgs {
    /// The arguments as a command line has them.
    pub(crate) fn to_arguments(&self) -> Vec<String> {
        let mut arguments: Vec<String> = ["--case".into(), self.case.to_string()].into();
        arguments.extend(["--seed".into(), self.seed.to_string()]);
        arguments.extend(self.domain.iter().flat_map(|domain| ["--domain".into(), domain.to_string()]));
        arguments.extend(self.peer.iter().flat_map(|peer| ["--peer".into(), peer.to_string()]));
        arguments.extend(self.measure.to_arguments());
        arguments.extend(self.placement.to_arguments());
        arguments.extend(["--launcher".into(), self.launcher.to_string()]);
        arguments
    }

    /// Measures a carrier other than the swarm: as the hub of its peers, or by starting the user's program.
    pub fn measure_transport(&self) -> Result<(), BenchError> {
        let placement = self.placement.placement();
        if let Some(peer) = &self.peer {
            return processes::run(&self.case, peer, &self.measure, placement);
        }
        let id = self.domain.as_ref().ok_or_else(|| BenchError::case("a hub needs a --domain"))?;
        hub::run(&self.case, &Domain::join(id)?, &self.measure, placement)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Debug, Parser)]
    struct TestCase {
        #[command(flatten)]
        args: CaseArgs,
    }

    #[test]
    fn a_case_process_reads_the_arguments_that_the_benchmark_writes() {
        let case = r#"{"subject":"pipe","topology":"mesh","load":"closed","uavs":2,"wake":"gate","payload_bytes":0,"recorder":false}"#;
        let line = [
            "bench-case",
            "--case",
            case,
            "--seed",
            "7",
            "--peer",
            "mine=peer 'a b'",
            "--measure-into",
            "trace",
            "--warm-up-s",
            "0.5",
            "--measure-s",
            "2",
            "--pin",
            "--priority=9",
            "--launcher",
            "42",
        ];
        let parsed = TestCase::parse_from(line).args;
        assert_eq!(parsed.to_arguments(), line[1..]);
    }
}
