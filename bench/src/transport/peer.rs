//! A peer: the process in an agent's or the leader's place. It answers each tick with as many bytes as an
//! agent or the leader sends, and computes nothing.
//!
//! Keeps its timestamps in memory and writes them to a file after the last tick.
//!
//! Must never decide when a tick begins.

use super::{
    connection::{PeerConnection, duplicated},
    exchange::{END, FIRST, MessageSizes, tick_of},
    links::Links,
    mesh,
    shared_words::SharedWords,
};
use crate::{
    case::{Carrier, Case, Load, Topology},
    error::BenchError,
    trace::{StepRecord, Trace, TraceHead},
};
use ringwing_bus::{Domain, DomainId, Gate, StopFlag, Wait, WaitStrategy, die_with, monotonic_ns};
use ringwing_flight::{Part, Tick, UavId};
use std::{
    io,
    net::{Ipv4Addr, TcpStream, UdpSocket},
    os::unix::net::UnixDatagram,
    path::{Path, PathBuf},
};

/// Ticks that memory is reserved for. After more, an answer may wait for the trace to be copied.
const RESERVED_TICKS: usize = 1 << 20;

/// Which peer to be, in which case.
#[derive(Debug, Clone, clap::Args)]
pub struct PeerArgs {
    /// The case, in JSON.
    #[arg(long)]
    case: Case,
    /// Number of this peer, from 0; without it, the peer is the leader.
    #[arg(long)]
    member: Option<u32>,
    /// The domain of the hub.
    #[arg(long)]
    domain: DomainId,
    /// The port on which the hub listens, for UDP and TCP.
    #[arg(long, default_value_t = 0)]
    port: u16,
    /// The folder for the timestamps.
    #[arg(long)]
    into: PathBuf,
    /// Process id of the hub; the peer ends with it.
    #[arg(long)]
    launcher: u32,
}

impl PeerArgs {
    /// Whose place it takes.
    fn part(&self) -> Part {
        part(self.member)
    }
}

/// Whose place the peer number `member` takes.
pub(super) fn part(member: Option<u32>) -> Part {
    member.map_or(Part::Leader, |member| Part::Agent(UavId(member + 1)))
}

/// The file into which peer `member` writes its timestamps.
pub(super) fn trace_path(folder: &Path, member: u32) -> PathBuf {
    folder.join(format!("peer-{member}.trace"))
}

/// Answers ticks until the hub ends the run.
pub fn run(args: &PeerArgs) -> Result<(), BenchError> {
    die_with(args.launcher)?;
    let stop = StopFlag::on_signals()?;
    let domain = Domain::join(&args.domain)?;
    let mut to_hub = ToHub::open(args, &domain)?;
    let mut trace = Trace { ticks: Vec::new(), steps: Vec::with_capacity(RESERVED_TICKS) };
    domain.gate()?.set_ready_process(args.part(), Some(std::process::id()));
    while let Some((tick, woke_ns)) = to_hub.next_tick(&stop).map_err(BenchError::system("no tick"))? {
        to_hub.read_inputs(tick).map_err(BenchError::system("an input is missing"))?;
        let read_ns = monotonic_ns();
        // Two stamps in a row: a peer computes nothing, so its time to compute is what a stamp costs.
        let sent_ns = monotonic_ns();
        // Stamped before: an answer may be read while this process still sends it, and the way back begins here.
        to_hub.answer(tick).map_err(BenchError::system("a tick cannot be answered"))?;
        let member = args.member.unwrap_or_default();
        trace.steps.push(StepRecord { tick, woke_ns, read_ns, sent_ns, member, ..StepRecord::default() });
    }
    // Only agents' answers are measured.
    let Some(member) = args.member else { return Ok(()) };
    Ok(trace.save(&trace_path(&args.into, member), &TraceHead::default())?)
}

/// How a process of a measurement of `case` waits at `gate`: in a closed loop a wait ends within microseconds, and paced at a
/// time that is known.
pub(super) fn wait_strategy(case: &Case, gate: &Gate) -> WaitStrategy {
    if case.load == Load::Closed {
        WaitStrategy::yielding(case.processes(), gate.cores())
    } else {
        WaitStrategy::timed()
    }
}

/// The peer's end of the transport.
enum ToHub {
    Gate { gate: Gate, part: Part, strategy: WaitStrategy, seen: Option<Tick> },
    Futex { words: SharedWords, seen: u32, peers: u32 },
    Turns { words: SharedWords, seen: u32 },
    Hub(Links),
    MeshAgent { world: Links, leader: Links, neighbours: Links },
    MeshLeader { world: Links, agents: Links },
}

impl ToHub {
    fn open(args: &PeerArgs, domain: &Domain) -> Result<Self, BenchError> {
        let failed = BenchError::system("the hub cannot be reached");
        match args.case.carrier {
            Carrier::Gate | Carrier::Swarm => {
                let gate = domain.gate()?;
                let strategy = wait_strategy(&args.case, &gate);
                Ok(Self::Gate { gate, part: args.part(), strategy, seen: None })
            }
            Carrier::Futex | Carrier::Atomic => Self::open_words(args, domain).map_err(failed),
            _ if args.case.topology == Topology::Mesh => Self::join_mesh(args).map_err(failed),
            _ => Self::connect(args).map_err(failed),
        }
    }

    fn open_words(args: &PeerArgs, domain: &Domain) -> io::Result<Self> {
        let words = SharedWords::open(&domain.words_path())?;
        Ok(match args.case.carrier {
            Carrier::Futex => Self::Futex { words, seen: 0, peers: args.case.answering() },
            _ => Self::Turns { words, seen: 0 },
        })
    }

    fn connect(args: &PeerArgs) -> io::Result<Self> {
        // The hub hands pipes and Unix sockets over as stdin and stdout.
        let connection = match args.case.carrier {
            Carrier::Pipe => PeerConnection::pipe(duplicated(io::stdout())?, duplicated(io::stdin())?),
            Carrier::PipePolled => {
                PeerConnection::polled(duplicated(io::stdout())?, duplicated(io::stdin())?)?
            }
            Carrier::UnixDatagram => {
                PeerConnection::UnixDatagram(UnixDatagram::from(duplicated(io::stdin())?))
            }
            Carrier::Udp => PeerConnection::Udp(introduced_udp(args)?),
            _ => PeerConnection::tcp(TcpStream::connect((Ipv4Addr::LOCALHOST, args.port))?)?,
        };
        let sizes = MessageSizes::hub_to_peer(&args.case).reversed();
        Ok(Self::Hub(Links::new(vec![connection], sizes)))
    }

    /// Takes the connections that the world hands over through stdin.
    fn join_mesh(args: &PeerArgs) -> io::Result<Self> {
        let socket = UnixDatagram::from(duplicated(io::stdin())?);
        let mut world = mesh::receive_ends(&socket, &args.case, args.part())?;
        let mut others = world.split_off(1);
        if args.part() == Part::Leader {
            return Ok(Self::MeshLeader {
                world: Links::new(world, MessageSizes::world_to_leader().reversed()),
                agents: Links::new(others, MessageSizes::leader_to_agent()),
            });
        }
        let neighbours = others.split_off(1);
        Ok(Self::MeshAgent {
            world: Links::new(world, MessageSizes::world_to_agent(&args.case).reversed()),
            leader: Links::new(others, MessageSizes::leader_to_agent().reversed()),
            neighbours: Links::new(neighbours, MessageSizes::between_neighbours()),
        })
    }

    /// Waits for the next tick; returns it with the time at which it was seen, or `None` at the end of the run.
    fn next_tick(&mut self, stop: &StopFlag) -> io::Result<Option<(i64, u64)>> {
        let tick = match self {
            Self::Gate { gate, strategy, seen, .. } => match gate.wait(*seen, strategy, stop, || ()) {
                Wait::Tick(tick) => {
                    *seen = Some(tick);
                    Some(tick.0)
                }
                Wait::Closed | Wait::Stopped => None,
            },
            Self::Futex { words, seen, .. } => words.wait(*seen).inspect(|round| *seen = *round).map(tick_of),
            Self::Turns { words, seen } => {
                // The word is 2 tick + 1 in the turn of the peer, so half of it, rounded down, is the tick.
                words.spin_while(*seen).inspect(|round| *seen = *round).map(|round| i64::from(round / 2))
            }
            Self::Hub(world) | Self::MeshAgent { world, .. } | Self::MeshLeader { world, .. } => {
                match world.next_tick() {
                    // A hub that is gone closes its end.
                    Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => None,
                    received => Some(received?).filter(|tick| *tick != END),
                }
            }
        };
        Ok(tick.map(|tick| (tick, monotonic_ns())))
    }

    /// Reads what others sent for `tick`, apart from the message that opened it.
    fn read_inputs(&mut self, tick: i64) -> io::Result<()> {
        // As in the swarm, an agent reads what the others sent in the tick before.
        if let Self::MeshAgent { leader, neighbours, .. } = self
            && tick > FIRST
        {
            leader.receive(tick - 1)?;
            neighbours.receive(tick - 1)?;
        }
        Ok(())
    }

    fn answer(&mut self, tick: i64) -> io::Result<()> {
        match self {
            Self::Gate { gate, part, .. } => gate.answer(*part, Tick(tick)),
            Self::Futex { words, peers, .. } => words.answer(*peers),
            Self::Turns { words, seen } => {
                *seen += 1;
                words.pass(*seen);
            }
            Self::Hub(world) => world.send(tick)?,
            // The world comes last: once it has all answers, all inputs of the next tick are on their way, too.
            Self::MeshAgent { world, neighbours, .. } => {
                neighbours.send(tick)?;
                world.send(tick)?;
            }
            Self::MeshLeader { world, agents } => {
                agents.send(tick)?;
                world.send(tick)?;
            }
        }
        Ok(())
    }
}

/// A UDP socket whose first datagram tells the hub its address.
fn introduced_udp(args: &PeerArgs) -> io::Result<UdpSocket> {
    let socket = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0))?;
    socket.connect((Ipv4Addr::LOCALHOST, args.port))?;
    socket.send(&[0; 4])?;
    Ok(socket)
}
