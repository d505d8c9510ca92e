//! The hub: the process in the world's place, also where the peers form a mesh. It sends each tick to all peers and waits
//! until all have answered.
//!
//! Must never begin a tick before its time, and must never make up for a tick that it missed.

use super::{
    exchange::{END, FIRST, MessageSizes, round_of, turn_of},
    links::Links,
    peer::{trace_path, wait_strategy},
    peers::{PEER_TIMEOUT, Peers},
    shared_words::SharedWords,
};
use crate::{
    case::{Carrier, Case, Load, Topology},
    error::BenchError,
    measure::{Measure, MeasureArgs},
    trace::Trace,
};
use ringwing_bus::{
    Deadlines, Domain, Gate, PacedTick, Placement, Proceed, TickProbe, WaitStrategy, monotonic_ns,
    processes_per_core,
};
use ringwing_flight::{Part, Tick};
use std::{path::Path, time::Instant};

/// Measures `case` between processes in `domain`, and writes the trace to the file that `measure` names.
pub(crate) fn run(
    case: &Case,
    domain: &Domain,
    measure: &MeasureArgs,
    placement: Placement,
) -> Result<(), BenchError> {
    let no_file = || BenchError::case("a hub needs --measure-into");
    let folder = measure.measure_into.as_deref().and_then(Path::parent).ok_or_else(no_file)?;
    let mut measure = Measure::new(measure).ok_or_else(no_file)?;
    let gate = domain.gate()?;
    let mut peers = Peers::start(case, domain, folder, placement)?;
    peers.wait_until_ready(&gate)?;
    // After the peers have started, because they would inherit the core of the hub.
    placement.take(0).map_err(BenchError::system("the hub cannot be placed"))?;
    gate.set_ready_process(Part::World, Some(std::process::id()));
    let to_peers = ToPeers::open(&mut peers, case, domain)?;
    let strategy = wait_strategy(case, &gate);
    let mut hub = Hub { case, gate, strategy, to_peers };
    hub.run(&mut measure)?;
    measure.run_ended(&hub.gate)?;
    hub.end()?;
    peers.wait_until_ended()
}

/// Adds the timestamps that the `peers` wrote beside `path` to the hub's own trace.
pub(crate) fn add_peers(trace: &mut Trace, path: &Path, peers: u32) -> Result<(), BenchError> {
    let folder = path.parent().unwrap_or(Path::new("."));
    let first = trace.ticks.first().map_or(END, |tick| tick.tick);
    for member in 0..peers {
        let (_, of_peer) = Trace::load(&trace_path(folder, member))?;
        for mut step in of_peer.steps {
            // A peer also keeps the ticks of the warm-up.
            let index = usize::try_from(step.tick.saturating_sub(first)).ok();
            if let Some(tick) = index.and_then(|index| trace.ticks.get(index)) {
                // The hub reads all answers in a row, so each has been read once all have.
                step.seen_ns = tick.collected_ns;
                trace.steps.push(step);
            }
        }
    }
    Ok(())
}

struct Hub<'a> {
    case: &'a Case,
    gate: Gate,
    strategy: WaitStrategy,
    to_peers: ToPeers,
}

/// The hub's ends of the transport.
enum ToPeers {
    Gate,
    Futex(SharedWords),
    Turns(SharedWords),
    /// In a mesh the leader comes first, because it has to send to all agents.
    Links(Vec<Links>),
}

impl ToPeers {
    fn open(peers: &mut Peers, case: &Case, domain: &Domain) -> Result<Self, BenchError> {
        let words = || {
            SharedWords::open(&domain.words_path())
                .map_err(BenchError::system("shared memory cannot be mapped"))
        };
        Ok(match case.carrier {
            Carrier::Swarm | Carrier::Gate => Self::Gate,
            Carrier::Futex => Self::Futex(words()?),
            Carrier::Atomic => Self::Turns(words()?),
            _ => Self::Links(links(peers, case)?),
        })
    }
}

fn links(peers: &mut Peers, case: &Case) -> Result<Vec<Links>, BenchError> {
    let mut connections = peers.connections(case)?;
    Ok(match case.topology {
        Topology::Hub => vec![Links::new(connections, MessageSizes::hub_to_peer(case))],
        Topology::Mesh => {
            let agents = connections.split_off(1);
            let leader = Links::new(connections, MessageSizes::world_to_leader());
            vec![leader, Links::new(agents, MessageSizes::world_to_agent(case))]
        }
    })
}

impl Hub<'_> {
    /// Opens ticks until `measure` has enough, as the world does.
    fn run(&mut self, measure: &mut Measure) -> Result<(), BenchError> {
        let mut deadlines = self.deadlines();
        for tick in FIRST.. {
            match measure.before_tick(&self.gate) {
                Proceed::Fly => {}
                Proceed::RestartDeadlines => deadlines = self.deadlines(),
                Proceed::End => break,
            }
            if let Some(deadlines) = &deadlines {
                self.gate.set_due(deadlines.due());
            }
            measure.tick_opened(Tick(tick), monotonic_ns());
            self.open(tick)?;
            measure.inputs_published();
            self.collect(tick)?;
            measure.answers_collected();
            let paced = deadlines.as_mut().map(|deadlines| wait_for_deadline(deadlines, &mut self.strategy));
            measure.tick_finished(0, paced);
        }
        Ok(())
    }

    fn deadlines(&self) -> Option<Deadlines> {
        match self.case.load {
            Load::Closed => None,
            Load::Paced(rate_hz) => Some(Deadlines::new(
                rate_hz,
                processes_per_core(self.case.processes(), self.gate.cores()),
                monotonic_ns(),
            )),
        }
    }

    fn open(&mut self, tick: i64) -> Result<(), BenchError> {
        match &mut self.to_peers {
            ToPeers::Gate => self.gate.open_tick(Tick(tick), self.case.answering()),
            ToPeers::Futex(words) => words.broadcast(round_of(tick)),
            ToPeers::Turns(words) => words.pass(turn_of(tick)),
            ToPeers::Links(links) => {
                let sent = links.iter_mut().try_for_each(|links| links.send(tick));
                sent.map_err(BenchError::system("a tick cannot be sent"))?;
            }
        }
        Ok(())
    }

    /// Waits until all peers have answered `tick`.
    fn collect(&mut self, tick: i64) -> Result<(), BenchError> {
        let since = Instant::now();
        let no_answer = || BenchError::case(format!("a peer did not answer tick {tick}"));
        let in_time = || if since.elapsed() < PEER_TIMEOUT { Ok(()) } else { Err(no_answer()) };
        match &mut self.to_peers {
            ToPeers::Gate => {
                // A wait also ends early, for example when somebody nudges the world, so it does not prove an answer.
                while !self.gate.is_answered() {
                    self.gate.wait_for_answers(&mut self.strategy, PEER_TIMEOUT);
                    in_time()?;
                }
            }
            ToPeers::Futex(words) => {
                while !words.wait_for_answers(self.case.answering()) {
                    in_time()?;
                }
            }
            ToPeers::Turns(words) => {
                words.spin_while(turn_of(tick)).ok_or_else(no_answer)?;
            }
            ToPeers::Links(links) => {
                let received = links.iter_mut().try_for_each(|links| links.receive(tick));
                received.map_err(BenchError::system("a peer did not answer"))?;
            }
        }
        Ok(())
    }

    fn end(&mut self) -> Result<(), BenchError> {
        match &mut self.to_peers {
            ToPeers::Gate => self.gate.close(),
            ToPeers::Futex(words) | ToPeers::Turns(words) => words.end(),
            // A connection carries only messages, so the end of the run is the number of a tick that never comes.
            ToPeers::Links(_) => self.open(END)?,
        }
        Ok(())
    }
}

/// Waits for the deadline; returns when the next tick is due.
fn wait_for_deadline(deadlines: &mut Deadlines, strategy: &mut WaitStrategy) -> PacedTick {
    let due = deadlines.due();
    strategy.wait_until(due, || false, || ());
    PacedTick { due_ns: due.at_ns, skipped: deadlines.advance(monotonic_ns()).missed_deadlines }
}
