//! A peer: the process in an agent's place, that answers each tick with as many bytes, and computes nothing.
//!
//! Never decides when a tick is; notes when it saw it, and leaves that in a file when there are no more.

use super::{END, Exchange, wire::Wire, words::Words};
use crate::bench::result::{Case, Load, Subject};
use ringwing_bus::{
    Domain, DomainId, Gate, Patience, StepRecord, StopFlag, Trace, TraceHead, Wait, member::die_with,
    monotonic_ns,
};
use ringwing_flight::{Part, Tick, UavId};
use std::{
    io,
    net::{Ipv4Addr, TcpStream, UdpSocket},
    os::unix::net::UnixDatagram,
    path::{Path, PathBuf},
};

/// Room for so many ticks from the beginning.
const ROOM: usize = 1 << 20;

/// Which peer, of which benchmark's case.
#[derive(Debug, Clone, clap::Args)]
pub(crate) struct Args {
    /// The case, in JSON.
    #[arg(long, value_parser = super::super::case::parse)]
    case: Case,
    /// Which of the peers, from 0.
    #[arg(long)]
    member: u32,
    /// Where its gate is.
    #[arg(long)]
    domain: DomainId,
    /// The hub's port, where there is one.
    #[arg(long, default_value_t = 0)]
    port: u16,
    /// The folder in which it leaves its stamps.
    #[arg(long)]
    into: PathBuf,
    /// The hub, to end with.
    #[arg(long)]
    launcher: u32,
}

/// Where a peer leaves its stamps.
pub(super) fn trace_path(folder: &Path, member: u32) -> PathBuf {
    folder.join(format!("peer-{member}.trace"))
}

/// Answers until there are no more ticks.
pub(crate) fn run(args: &Args) -> anyhow::Result<()> {
    die_with(args.launcher)?;
    let stop = StopFlag::on_signals()?;
    let domain = Domain::join(&args.domain)?;
    let mut line = Line::open(args, &domain)?;
    let mut trace = Trace { ticks: Vec::new(), steps: Vec::with_capacity(ROOM) };
    domain.gate()?.set_attendant(Part::Agent(UavId(args.member + 1)), Some(std::process::id()));
    while let Some((tick, woke_ns)) = line.next(&stop)? {
        let read_ns = monotonic_ns();
        let sent_ns = monotonic_ns();
        line.answer(tick)?;
        let member = args.member;
        trace.steps.push(StepRecord { tick, woke_ns, read_ns, sent_ns, member, ..StepRecord::default() });
    }
    trace.save(&trace_path(&args.into, args.member), &TraceHead::default())?;
    Ok(())
}

/// How it hears of ticks.
enum Line {
    Gate { gate: Gate, patience: Patience, seen: Option<Tick> },
    Futex { words: Words, seen: u32, peers: u32 },
    Turns { words: Words, seen: u32 },
    Wire { wire: Wire, ask: Vec<u8>, answer: Vec<u8> },
}

impl Line {
    fn open(args: &Args, domain: &Domain) -> anyhow::Result<Self> {
        let Exchange { ask, answer } = Exchange::of(&args.case);
        let wire = |wire| Self::Wire { wire, ask: vec![0; ask], answer: vec![1; answer] };
        let words = || Words::open(&domain.words_path());
        Ok(match args.case.subject {
            Subject::Gate | Subject::Swarm => {
                let closed = args.case.load == Load::Closed;
                let patience = if closed { Patience::eager() } else { Patience::punctual() };
                Self::Gate { gate: domain.gate()?, patience, seen: None }
            }
            Subject::Futex => Self::Futex { words: words()?, seen: 0, peers: args.case.uavs },
            Subject::Atomic => Self::Turns { words: words()?, seen: 0 },
            Subject::Pipe => wire(Wire::pipe(inherited_out()?, inherited_in()?)),
            Subject::PipePolled => wire(Wire::polled(inherited_out()?, inherited_in()?)?),
            Subject::UnixDatagram => wire(Wire::UnixDatagram(UnixDatagram::from(inherited_in()?))),
            Subject::Udp => wire(Wire::Udp(udp(args)?)),
            Subject::Tcp => wire(Wire::tcp(TcpStream::connect((Ipv4Addr::LOCALHOST, args.port))?)?),
        })
    }

    /// The next tick, and when it was seen.
    fn next(&mut self, stop: &StopFlag) -> io::Result<Option<(i64, u64)>> {
        let tick = match self {
            Self::Gate { gate, patience, seen } => match gate.wait(*seen, patience, stop) {
                Wait::Tick(tick) => {
                    *seen = Some(tick);
                    Some(tick.0)
                }
                Wait::Closed | Wait::Stopped => None,
            },
            Self::Futex { words, seen, .. } => {
                words.wait(*seen).inspect(|round| *seen = *round).map(super::tick_of)
            }
            Self::Turns { words, seen } => {
                words.spin_while(*seen).inspect(|round| *seen = *round).map(|round| i64::from(round / 2))
            }
            Self::Wire { wire, ask, .. } => {
                let heard = wire.receive(ask);
                if heard.as_ref().is_err_and(|error| error.kind() == io::ErrorKind::UnexpectedEof) {
                    return Ok(None);
                }
                heard?;
                Some(super::tick_in(ask)).filter(|tick| *tick != END)
            }
        };
        Ok(tick.map(|tick| (tick, monotonic_ns())))
    }

    fn answer(&mut self, tick: i64) -> io::Result<()> {
        match self {
            Self::Gate { gate, .. } => gate.answer(),
            Self::Futex { words, peers, .. } => words.answer(*peers),
            Self::Turns { words, seen } => {
                *seen += 1;
                words.pass(*seen);
            }
            Self::Wire { wire, answer, .. } => {
                super::put_tick(answer, tick);
                wire.send(answer)?;
            }
        }
        Ok(())
    }
}

fn inherited_in() -> io::Result<std::os::fd::OwnedFd> {
    Ok(super::wire::inherited(io::stdin())?)
}

fn inherited_out() -> io::Result<std::os::fd::OwnedFd> {
    Ok(super::wire::inherited(io::stdout())?)
}

/// A socket that the hub knows from the first datagram on.
fn udp(args: &Args) -> io::Result<UdpSocket> {
    let socket = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0))?;
    socket.connect((Ipv4Addr::LOCALHOST, args.port))?;
    socket.send(&args.member.to_le_bytes())?;
    Ok(socket)
}
