//! The hub: the process in the world's place, that sends each tick to all peers and waits until all have answered.
//!
//! Never starts a tick before its time, and never makes up for one that it missed.

use super::{END, Exchange, peer::trace_path, wire::Wire, words::Words};
use crate::{
    bench::{
        case,
        result::{Case, Load, Subject},
    },
    placement::Placement,
};
use anyhow::{Context, bail, ensure};
use ringwing_bus::{Domain, Gate, Patience, Trace, monotonic_ns, patience::crowd};
use ringwing_flight::{Part, Tick, UavId};
use ringwing_world::{
    MeasureArgs,
    measure::{Measure, Turn},
    schedule::Schedule,
};
use std::{
    io,
    net::{Ipv4Addr, TcpListener, UdpSocket},
    os::{fd::OwnedFd, unix::net::UnixDatagram},
    path::Path,
    process::{Child, Command, Stdio},
    thread,
    time::{Duration, Instant},
};

/// How long a peer may take to start, and to answer.
const PATIENCE: Duration = Duration::from_secs(10);

/// Measures `case` among processes in `domain`, and leaves the trace in the file of `measure`.
pub(crate) fn run(
    case: &Case,
    domain: &Domain,
    measure: &MeasureArgs,
    placement: &Placement,
) -> anyhow::Result<()> {
    let into = measure.measure_into.as_deref().and_then(Path::parent).context("no file to measure into")?;
    let gate = domain.gate()?;
    let mut peers = Peers::start(case, domain, into, placement)?;
    peers.wait_until_ready(&gate)?;
    gate.set_attendant(Part::World, Some(std::process::id()));
    let mut measure = Measure::new(measure, case.uavs).context("nothing to measure")?;
    let mut hub = Hub { case, gate, patience: patience(case.load), line: peers.take_line(case, domain)? };
    hub.fly(&mut measure)?;
    measure.leave(&hub.gate)?;
    hub.end()?;
    peers.see_out()
}

/// The trace in the file `path`, complete with the stamps that the `peers` left beside it.
pub(crate) fn gather(trace: &mut Trace, path: &Path, peers: u32) -> anyhow::Result<()> {
    let folder = path.parent().context("a trace is in a folder")?;
    let first = trace.ticks.first().map_or(END, |tick| tick.tick);
    for member in 0..peers {
        let (_, theirs) = Trace::load(&trace_path(folder, member))?;
        for mut step in theirs.steps {
            let place = usize::try_from(step.tick - first).ok().filter(|_| step.tick >= first);
            if let Some(tick) = place.and_then(|place| trace.ticks.get(place)) {
                step.seen_ns = tick.collected_ns;
                trace.steps.push(step);
            }
        }
    }
    Ok(())
}

fn patience(load: Load) -> Patience {
    if load == Load::Closed { Patience::eager() } else { Patience::punctual() }
}

struct Hub<'a> {
    case: &'a Case,
    gate: Gate,
    patience: Patience,
    line: Line,
}

/// How it reaches the peers.
enum Line {
    Gate,
    Futex(Words),
    Turns(Words),
    Wires { wires: Vec<Wire>, ask: Vec<u8>, answer: Vec<u8> },
}

impl Hub<'_> {
    fn fly(&mut self, measure: &mut Measure) -> anyhow::Result<()> {
        let mut schedule = self.schedule();
        for tick in 0.. {
            match measure.turn(&self.gate) {
                Turn::Fly => {}
                Turn::Begin => schedule = self.schedule(),
                Turn::End => break,
            }
            if let Some(schedule) = &schedule {
                self.gate.set_due(schedule.due());
            }
            measure.open(tick, monotonic_ns());
            self.open(tick)?;
            measure.publish();
            self.collect(tick)?;
            measure.collect();
            let paced = schedule.as_mut().map(|schedule| wait_for_deadline(schedule, &mut self.patience));
            measure.finish(0, paced);
        }
        Ok(())
    }

    fn schedule(&self) -> Option<Schedule> {
        match self.case.load {
            Load::Closed => None,
            Load::Paced(rate_hz) => Some(Schedule::new(rate_hz, crowd(self.case.uavs + 1), monotonic_ns())),
        }
    }

    fn open(&mut self, tick: i64) -> io::Result<()> {
        match &mut self.line {
            Line::Gate => self.gate.open_tick(Tick(tick), self.case.uavs),
            Line::Futex(words) => words.broadcast(super::round_of(tick)),
            Line::Turns(words) => words.pass(turn(tick)),
            Line::Wires { wires, ask, .. } => {
                super::put_tick(ask, tick);
                wires.iter_mut().try_for_each(|wire| wire.send(ask))?;
            }
        }
        Ok(())
    }

    fn collect(&mut self, tick: i64) -> anyhow::Result<()> {
        let since = Instant::now();
        let in_time = || -> anyhow::Result<()> {
            ensure!(since.elapsed() < PATIENCE, "a peer did not answer tick {tick}");
            Ok(())
        };
        match &mut self.line {
            Line::Gate => {
                while !self.gate.is_answered() {
                    self.gate.wait_for_answers(&mut self.patience, PATIENCE);
                    in_time()?;
                }
            }
            Line::Futex(words) => {
                while !words.wait_for_answers(self.case.uavs) {
                    in_time()?;
                }
            }
            Line::Turns(words) => {
                words.spin_while(turn(tick)).context("the turns were ended by somebody else")?;
            }
            Line::Wires { wires, answer, .. } => {
                for wire in wires {
                    wire.receive(answer).with_context(|| format!("a peer did not answer tick {tick}"))?;
                    ensure!(super::tick_in(answer) == tick, "a peer answered another tick than {tick}");
                }
            }
        }
        Ok(())
    }

    fn end(&mut self) -> io::Result<()> {
        match &mut self.line {
            Line::Gate => self.gate.close(),
            Line::Futex(words) | Line::Turns(words) => words.end(),
            Line::Wires { .. } => self.open(END)?,
        }
        Ok(())
    }
}

/// Odd: the peer's turn.
fn turn(tick: i64) -> u32 {
    2 * tick as u32 + 1
}

/// Waits; returns when the next tick should begin, and how many after it should have, before it can.
fn wait_for_deadline(schedule: &mut Schedule, patience: &mut Patience) -> (u64, u32) {
    let due = schedule.due();
    patience.wait_until(due, || false);
    (due.at_ns, schedule.meet(monotonic_ns()).missed_deadlines)
}

/// The peers' processes, and what they were started with.
struct Peers {
    children: Vec<Child>,
    sockets: Vec<OwnedFd>,
    listener: Option<TcpListener>,
    udp: Vec<UdpSocket>,
}

impl Peers {
    fn start(case: &Case, domain: &Domain, into: &Path, placement: &Placement) -> anyhow::Result<Self> {
        let mut peers = Self { children: Vec::new(), sockets: Vec::new(), listener: None, udp: Vec::new() };
        if case.subject == Subject::Tcp {
            let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0))?;
            // All connect before the first is accepted.
            rustix::net::listen(&listener, case.uavs.cast_signed())?;
            peers.listener = Some(listener);
        }
        for member in 0..case.uavs {
            let mut command = Command::new("/proc/self/exe");
            command.arg("bench-peer").args(["--case", &case::text(case)]);
            command.args(["--member", &member.to_string(), "--domain", &domain.id().to_string()]);
            command.args(["--launcher", &std::process::id().to_string(), "--into"]).arg(into);
            peers.connect(case.subject, &mut command)?;
            // The world's place is the first, its leader's the second.
            let child = placement.around(member as usize + 1, || command.spawn());
            peers.children.push(child.context("a peer cannot be started")?);
        }
        Ok(peers)
    }

    fn connect(&mut self, subject: Subject, command: &mut Command) -> io::Result<()> {
        command.stdin(Stdio::null()).stdout(Stdio::null());
        match subject {
            Subject::Pipe | Subject::PipePolled => {
                command.stdin(Stdio::piped()).stdout(Stdio::piped());
            }
            Subject::UnixDatagram => {
                let (ours, theirs) = UnixDatagram::pair()?;
                self.sockets.push(ours.into());
                command.stdin(OwnedFd::from(theirs));
            }
            Subject::Udp => {
                let socket = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0))?;
                command.args(["--port", &socket.local_addr()?.port().to_string()]);
                self.udp.push(socket);
            }
            Subject::Tcp => {
                let listener = self.listener.as_ref().ok_or_else(|| io::Error::other("nobody listens"))?;
                command.args(["--port", &listener.local_addr()?.port().to_string()]);
            }
            Subject::Swarm | Subject::Gate | Subject::Atomic | Subject::Futex => {}
        }
        Ok(())
    }

    /// Our ends of all connections.
    fn take_line(&mut self, case: &Case, domain: &Domain) -> anyhow::Result<Line> {
        let Exchange { ask, answer } = Exchange::of(case);
        let wires = match case.subject {
            Subject::Swarm | Subject::Gate => return Ok(Line::Gate),
            Subject::Futex => return Ok(Line::Futex(Words::open(&domain.words_path())?)),
            Subject::Atomic => return Ok(Line::Turns(Words::open(&domain.words_path())?)),
            Subject::Pipe | Subject::PipePolled => self.pipes(case.subject == Subject::PipePolled)?,
            Subject::UnixDatagram => {
                self.sockets.drain(..).map(|socket| Wire::UnixDatagram(socket.into())).collect()
            }
            Subject::Udp => self.udp.drain(..).map(greeted).collect::<io::Result<_>>()?,
            Subject::Tcp => self.accepted(case.uavs)?,
        };
        wires.iter().try_for_each(|wire| wire.set_patience(PATIENCE))?;
        Ok(Line::Wires { wires, ask: vec![0; ask], answer: vec![0; answer] })
    }

    fn pipes(&mut self, polled: bool) -> io::Result<Vec<Wire>> {
        let gone = || io::Error::other("a peer has no pipe");
        let pipe = |child: &mut Child| {
            let out = child.stdin.take().ok_or_else(gone)?;
            let back = child.stdout.take().ok_or_else(gone)?;
            if polled { Wire::polled(out, back) } else { Ok(Wire::pipe(out, back)) }
        };
        self.children.iter_mut().map(pipe).collect()
    }

    /// Whoever is ready has connected already.
    fn accepted(&mut self, peers: u32) -> io::Result<Vec<Wire>> {
        let listener = self.listener.take().ok_or_else(|| io::Error::other("nobody listens"))?;
        (0..peers).map(|_| Wire::tcp(listener.accept()?.0)).collect()
    }

    fn wait_until_ready(&mut self, gate: &Gate) -> anyhow::Result<()> {
        let since = Instant::now();
        for (uav, child) in (1..).map(UavId).zip(&mut self.children) {
            while gate.attendant(Part::Agent(uav)).is_none() {
                if let Some(status) = child.try_wait()? {
                    bail!("a peer ended before it was ready: {status}");
                }
                ensure!(since.elapsed() < PATIENCE, "a peer was not ready in time");
                thread::sleep(Duration::from_millis(1));
            }
        }
        Ok(())
    }

    /// Waits until all have left their stamps.
    fn see_out(mut self) -> anyhow::Result<()> {
        let since = Instant::now();
        for child in &mut self.children {
            while child.try_wait()?.is_none() {
                ensure!(since.elapsed() < PATIENCE, "a peer did not leave in time");
                thread::sleep(Duration::from_millis(1));
            }
            let status = child.wait()?;
            ensure!(status.success(), "a peer failed: {status}");
        }
        Ok(())
    }
}

/// A peer's first datagram tells where it is.
fn greeted(socket: UdpSocket) -> io::Result<Wire> {
    socket.set_read_timeout(Some(PATIENCE))?;
    let (_, peer) = socket.recv_from(&mut [0; 4])?;
    socket.connect(peer)?;
    Ok(Wire::Udp(socket))
}
