//! The options of `ringwing bench`, and the axes that they ask for.
//!
//! All contradictions are found here, before anything starts.
//!
//! Must never start a process, read a file or write one.

use crate::{
    axes::{Axes, distinct, in_topology},
    case::{Carrier, Load, Topology},
    compare::CompareArgs,
    error::BenchError,
    peer_program::program::PeerProgram,
};
use clap::ValueEnum;
use ringwing_bus::{Cores, Placement};
use ringwing_scenario::{PAYLOAD_MAX_BYTES, UAVS_MAX, Wake};
use std::path::PathBuf;

/// What to measure.
#[derive(Debug, Clone, clap::Args)]
#[command(args_conflicts_with_subcommands = true)]
#[expect(clippy::struct_excessive_bools, reason = "each is a flag of its own")]
pub struct BenchArgs {
    #[command(subcommand)]
    pub(crate) verb: Option<BenchVerb>,
    /// Swarm sizes to measure
    #[arg(long, value_name = "NUMBERS", value_delimiter = ',', value_parser = clap::value_parser!(u32).range(1..=i64::from(UAVS_MAX)))]
    uavs: Vec<u32>,
    /// Tick rates of paced loads, in Hz
    #[arg(long, value_name = "HZ", value_delimiter = ',', value_parser = clap::value_parser!(u32).range(1..=1000))]
    rate: Vec<u32>,
    /// Begin a tick as soon as the last one is answered (closed), or at a fixed rate (paced)
    #[arg(long, value_name = "LOADS", value_delimiter = ',')]
    load: Vec<LoadKind>,
    /// How the swarm's processes wait: at the tick gate, spinning at the gate, or on iceoryx2 events
    #[arg(long, value_name = "WAYS", value_delimiter = ',', default_value = "gate")]
    wake: Vec<WakeKind>,
    /// Extra bytes to send each way in every tick
    #[arg(long, value_name = "BYTES", value_delimiter = ',', default_value = "0", value_parser = clap::value_parser!(u32).range(..=i64::from(PAYLOAD_MAX_BYTES)))]
    payload: Vec<u32>,
    /// Fly the swarm without a recorder (off), with one that writes a log (on), or both; other transports have no recorder
    #[arg(long, value_name = "OFF,ON", value_delimiter = ',', default_value = "off")]
    recorder: Vec<RecorderChoice>,
    /// Transports to compare the swarm with
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    transport: Vec<TransportChoice>,
    /// Connect the processes of pipes and Unix datagrams through a hub that relays everything in one message, or directly
    /// as the swarm is connected (mesh)
    ///
    /// In a mesh, each agent reads from the world, the leader and its two neighbours, and writes to the world and the
    /// neighbours. UDP and TCP have only a hub. The floors (gate, atomic, futex) send no data and have no topology.
    #[arg(long, value_name = "HUB,MESH", value_delimiter = ',', default_value = "hub")]
    topology: Vec<TopologyChoice>,
    /// Also measure a program of your own as world and agents; repeatable. `bench/PEERS.md` says what it has to do
    #[arg(long, value_name = "NAME=COMMAND")]
    peer: Vec<PeerProgram>,
    #[command(flatten)]
    pub(crate) placement: PlacementArgs,
    /// Number of times to measure each case
    #[arg(long, value_name = "NUMBER", value_parser = clap::value_parser!(u32).range(1..=1000))]
    repeat: Option<u32>,
    /// Time that each case runs before it is measured
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true)]
    warm_up: Option<f64>,
    /// Time that each case is measured
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true)]
    seconds: Option<f64>,
    /// Seed of the flights and of the order of the cases
    #[arg(long, value_name = "NUMBER", default_value_t = 1)]
    pub(crate) seed: u64,
    /// Print the results as JSON
    #[arg(long)]
    pub(crate) json: bool,
    /// Write the results to this folder
    #[arg(long, value_name = "FOLDER")]
    pub(crate) out: Option<PathBuf>,
    /// Also write the log of each recorded case's first flight to that folder, with `/timing`
    #[arg(long, requires = "out")]
    pub(crate) mcap: bool,
    /// Measure a few cases briefly, in less than 30 s
    #[arg(long)]
    quick: bool,
    /// Measure nothing; report what on this machine would spoil a measurement
    #[arg(long, exclusive = true)]
    pub(crate) doctor: bool,
}

/// What else to do with results.
#[derive(Debug, Clone, clap::Subcommand)]
pub(crate) enum BenchVerb {
    /// Show two results side by side, and which differences exceed their spread
    Compare(CompareArgs),
}

/// Where processes run, and with which priority.
#[derive(Debug, Clone, Default, clap::Args)]
pub struct PlacementArgs {
    /// Pin each process to one core, round robin
    #[arg(long)]
    pin: bool,
    /// Run the processes in the real-time class `SCHED_FIFO` with this priority, if permitted
    #[arg(long, value_name = "1 TO 99", value_parser = clap::value_parser!(u8).range(1..=99))]
    priority: Option<u8>,
}

impl PlacementArgs {
    /// The placement that these arguments ask for.
    pub fn placement(&self) -> Placement {
        let cores = if self.pin { Cores::OneEach } else { Cores::All };
        Placement { cores, priority: self.priority }
    }

    /// The arguments as a command line has them.
    pub fn to_arguments(&self) -> Vec<String> {
        let pin = self.pin.then(|| "--pin".to_owned());
        pin.into_iter().chain(self.priority.map(|priority| format!("--priority={priority}"))).collect()
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum LoadKind {
    Closed,
    Paced,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum WakeKind {
    Gate,
    Spin,
    Event,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum RecorderChoice {
    Off,
    On,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum TopologyChoice {
    Hub,
    Mesh,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum TransportChoice {
    Gate,
    Atomic,
    Futex,
    Pipe,
    PipePolled,
    UnixDatagram,
    Udp,
    Tcp,
    /// Measure the swarm alone
    None,
}

/// Longest warm-up and longest measurement of a case, in seconds. The timestamps of a longer one may not fit into memory.
const LONGEST_S: f64 = 60.0;
/// Shortest measurement, in seconds: one tick at 100 Hz.
const SHORTEST_S: f64 = 0.01;

impl BenchArgs {
    /// What to measure.
    ///
    /// # Errors
    /// [`BenchError::Usage`] if options contradict each other.
    pub(crate) fn axes(&self) -> Result<Axes, BenchError> {
        self.refuse_contradictions()?;
        let quick = self.quick;
        let or_default = |given: &[u32], quick_default: &[u32], default: &[u32]| {
            distinct(if !given.is_empty() {
                given
            } else if quick {
                quick_default
            } else {
                default
            })
        };
        Ok(Axes {
            uavs: or_default(&self.uavs, &[6], &[1, 6, 30, 100, 200]),
            loads: self.loads(&or_default(&self.rate, &[100], &[100])),
            wakes: distinct(&self.wake).into_iter().map(Wake::from).collect(),
            payloads: distinct(&self.payload),
            recorders: distinct(&self.recorder).into_iter().map(|on| on == RecorderChoice::On).collect(),
            baselines: self.baselines(),
            topologies: distinct(&self.topology).into_iter().map(Topology::from).collect(),
            programs: self.peer.clone(),
            repeats: self.repeat.unwrap_or(if quick { 1 } else { 4 }),
            warm_up_s: seconds("--warm-up", self.warm_up, 0.0, if quick { 0.1 } else { 0.3 })?,
            measure_s: seconds("--seconds", self.seconds, SHORTEST_S, if quick { 0.4 } else { 2.0 })?,
        })
    }

    fn loads(&self, rates: &[u32]) -> Vec<Load> {
        let both = [LoadKind::Closed, LoadKind::Paced];
        let kinds = if self.load.is_empty() { both.to_vec() } else { distinct(&self.load) };
        let of_kind = |kind| match kind {
            LoadKind::Closed => vec![Load::Closed],
            LoadKind::Paced => rates.iter().copied().map(Load::Paced).collect(),
        };
        kinds.into_iter().flat_map(of_kind).collect()
    }

    fn baselines(&self) -> Vec<Carrier> {
        // With a real-time priority, a transport that never sleeps would lock up the machine.
        let is_safe = |transport: &TransportChoice| self.placement.priority.is_none() || transport.sleeps();
        let chosen =
            if self.transport.is_empty() { TransportChoice::value_variants() } else { &self.transport };
        let transports = distinct(chosen).into_iter().filter(is_safe).filter_map(TransportChoice::carrier);
        transports.chain(self.peer.iter().map(|peer| Carrier::Peer(peer.name.clone()))).collect()
    }

    /// Whether a transport is named that has none of the topologies asked for.
    fn is_without_topology(&self) -> bool {
        let only_mesh = !self.topology.contains(&TopologyChoice::Hub);
        let named = self.transport.iter().filter_map(|transport| transport.carrier());
        only_mesh && named.into_iter().any(|carrier| in_topology(&carrier, Topology::Mesh).is_none())
    }

    /// Refuses names by which a table could not tell two cases apart.
    fn refuse_ambiguous_peers(&self) -> Result<(), BenchError> {
        let mut taken: Vec<String> = TransportChoice::value_variants()
            .iter()
            .filter_map(|one| one.to_possible_value().map(|value| value.get_name().to_owned()))
            .chain(["swarm".into()])
            .collect();
        for name in self.peer.iter().map(|peer| &peer.name) {
            // Names of files have no capitals.
            let name_in_files = name.to_lowercase();
            if taken.contains(&name_in_files) {
                return Err(BenchError::Usage(format!(
                    "--peer {name}=...: this name is taken: choose another"
                )));
            }
            taken.push(name_in_files);
        }
        Ok(())
    }

    fn refuse_contradictions(&self) -> Result<(), BenchError> {
        self.refuse_ambiguous_peers()?;
        let urgent = self.placement.priority.is_some();
        let refusals = [
            (
                !self.rate.is_empty() && !self.load.is_empty() && !self.load.contains(&LoadKind::Paced),
                "--rate is for paced loads: add --load paced, or leave --rate out",
            ),
            (
                self.transport.len() > 1 && self.transport.contains(&TransportChoice::None),
                "--transport none excludes all others: name the transports to compare with, or none alone",
            ),
            (
                self.is_without_topology(),
                "--transport udp and tcp have only a hub: add --topology hub,mesh, or leave them out",
            ),
            (
                self.mcap && !self.recorder.contains(&RecorderChoice::On),
                "--mcap needs a recorded flight: add --recorder on",
            ),
            (
                urgent && self.wake.contains(&WakeKind::Spin),
                "--priority with --wake spin would block every other process: leave one of them out",
            ),
            (
                urgent && self.transport.iter().any(|one| !one.sleeps()),
                "--priority with a transport that never sleeps (atomic, pipe-polled) would block every other process: \
                 leave one of them out",
            ),
        ];
        let refusal = refusals.iter().find(|(is_wrong, _)| *is_wrong);
        refusal.map_or(Ok(()), |(_, why)| Err(BenchError::Usage((*why).into())))
    }
}

impl TransportChoice {
    fn carrier(self) -> Option<Carrier> {
        Some(match self {
            Self::Gate => Carrier::Gate,
            Self::Atomic => Carrier::Atomic,
            Self::Futex => Carrier::Futex,
            Self::Pipe => Carrier::Pipe,
            Self::PipePolled => Carrier::PipePolled,
            Self::UnixDatagram => Carrier::UnixDatagram,
            Self::Udp => Carrier::Udp,
            Self::Tcp => Carrier::Tcp,
            Self::None => return None,
        })
    }

    /// Whether its processes sleep while they wait.
    fn sleeps(self) -> bool {
        !matches!(self, Self::Atomic | Self::PipePolled)
    }
}

impl From<TopologyChoice> for Topology {
    fn from(choice: TopologyChoice) -> Self {
        match choice {
            TopologyChoice::Hub => Self::Hub,
            TopologyChoice::Mesh => Self::Mesh,
        }
    }
}

impl From<WakeKind> for Wake {
    fn from(kind: WakeKind) -> Self {
        match kind {
            WakeKind::Gate => Self::Gate,
            WakeKind::Spin => Self::Spin,
            WakeKind::Event => Self::Event,
        }
    }
}

fn seconds(flag: &str, given: Option<f64>, shortest: f64, default: f64) -> Result<f64, BenchError> {
    match given {
        Some(seconds) if !(shortest..=LONGEST_S).contains(&seconds) => Err(BenchError::Usage(format!(
            "{flag} {seconds}: give a number of seconds from {shortest} to {LONGEST_S}"
        ))),
        given => Ok(given.unwrap_or(default)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::Case;
    use clap::Parser;

    #[derive(Debug, Parser)]
    struct TestCommand {
        #[command(flatten)]
        args: BenchArgs,
    }

    fn axes(line: &str) -> Result<Axes, String> {
        let words = std::iter::once("bench").chain(line.split_whitespace());
        let command = TestCommand::try_parse_from(words).map_err(|error| error.to_string())?;
        command.args.axes().map_err(|error| error.to_string())
    }

    #[test]
    fn every_combination_becomes_one_case() {
        let axes = axes("--uavs 1,6,6 --load closed,paced --rate 50,200 --wake gate,event --payload 0,64 --transport atomic,pipe")
            .unwrap();
        let cases = axes.cases();
        let count = |carrier| cases.iter().filter(|case| case.carrier == carrier).count();
        // 3 loads, 2 sizes, 2 payloads, 2 ways to wait.
        assert_eq!(count(Carrier::Swarm), 24);
        assert_eq!(count(Carrier::Pipe), 12);
        // One peer, no payload: all sizes and payloads are the same case.
        assert_eq!(count(Carrier::Atomic), 3);
        assert_eq!(cases.len(), 39);
    }

    #[test]
    fn each_transport_is_measured_in_every_topology_that_it_has_and_the_swarm_once() {
        let both = axes("--topology hub,mesh,mesh --uavs 3 --load closed").unwrap().cases();
        let count = |cases: &[Case], topology| cases.iter().filter(|case| case.topology == topology).count();
        // The swarm, three floors and five transports as hubs; pipe, polled pipe and Unix datagram as meshes.
        assert_eq!((count(&both, Topology::Hub), count(&both, Topology::Mesh)), (9, 3));
        let mesh = axes("--topology mesh --uavs 3 --load closed").unwrap().cases();
        assert_eq!((count(&mesh, Topology::Hub), count(&mesh, Topology::Mesh)), (4, 3));
        assert!(!mesh.iter().any(|case| matches!(case.carrier, Carrier::Udp | Carrier::Tcp)));
    }

    #[test]
    fn programs_are_measured_beside_the_chosen_transports() {
        let words = ["bench", "--uavs", "3", "--load", "closed", "--transport", "none"];
        let peers = ["--peer", "a=./peer --fast", "--peer", "b=./peer"];
        let command = TestCommand::try_parse_from(words.into_iter().chain(peers)).unwrap();
        let axes = command.args.axes().unwrap();
        let carriers: Vec<Carrier> = axes.cases().into_iter().map(|case| case.carrier).collect();
        assert_eq!(carriers, [Carrier::Swarm, Carrier::Peer("a".into()), Carrier::Peer("b".into())]);
        assert_eq!(axes.program(&carriers[1]).unwrap().command, ["./peer", "--fast"]);
        assert_eq!(axes.program(&carriers[0]), None);
    }

    #[test]
    fn without_options_the_whole_benchmark_runs() {
        let axes = axes("").unwrap();
        assert_eq!((axes.uavs.as_slice(), axes.repeats), (&[1, 6, 30, 100, 200][..], 4));
        assert_eq!(axes.loads, [Load::Closed, Load::Paced(100)]);
        assert_eq!(axes.baselines.len(), 8);
    }

    #[test]
    fn a_quick_benchmark_takes_less_than_thirty_seconds() {
        let axes = axes("--quick").unwrap();
        let cases = axes.cases().len() as f64;
        // Starting and ending the processes takes about as long again.
        assert!(2.0 * cases * f64::from(axes.repeats) * (axes.warm_up_s + axes.measure_s) < 30.0);
    }

    #[test]
    fn contradictions_are_refused_with_what_to_do_instead() {
        for (line, remedy) in [
            ("--uavs 0", "1..=1024"),
            ("--uavs six", "--uavs"),
            ("--rate 100 --load closed", "add --load paced"),
            ("--rate 0", "1..=1000"),
            ("--payload 65537", "0..=65536"),
            ("--transport none,pipe", "none alone"),
            ("--transport dds", "unix-datagram"),
            ("--topology star", "mesh"),
            ("--peer peer.py", "NAME=COMMAND"),
            ("--peer a=x --peer A=y", "choose another"),
            ("--peer TCP=x", "choose another"),
            ("--topology mesh --transport pipe,tcp", "add --topology hub,mesh"),
            ("--mcap", "--out"),
            ("--mcap --out x", "add --recorder on"),
            ("--priority 0", "1..=99"),
            ("--priority 10 --wake spin", "leave one of them out"),
            ("--priority 10 --transport pipe-polled", "leave one of them out"),
            ("--repeat 0", "1..=1000"),
            ("--seconds 0", "from 0.01 to 60"),
            ("--seconds NaN", "from 0.01 to 60"),
            ("--warm-up -1", "--warm-up"),
            ("--warm-up 61", "from 0 to 60"),
            ("--doctor --quick", "--doctor"),
        ] {
            let error = axes(line).unwrap_err();
            assert!(error.contains(remedy), "{line}: {error}");
        }
    }
}
