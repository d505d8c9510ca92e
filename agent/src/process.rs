//! The process that flies one UAV.

use crate::Pilot;
use ringwing_messages::{
    BusError, Command, DomainId, Gate, LeaderState, Member, Part, Publisher, Sensed, Stamps, Subscriber,
    Tick, UavId, UavState, Wait, channel, gate::Patience, monotonic_ns,
};
use ringwing_scenario::{Scenario, ScenarioError};
use std::{
    thread,
    time::{Duration, Instant},
};

/// How long to sleep before looking again for what is missing.
const LOOK_AGAIN: Duration = Duration::from_micros(200);

/// Which UAV to fly, in which run.
#[derive(Debug, Clone, clap::Args)]
pub struct Args {
    /// The run's domain, as `ringwing run` prints it.
    #[arg(long)]
    pub domain: DomainId,
    /// The UAV to fly, from 1.
    #[arg(long, value_name = "NUMBER", value_parser = clap::value_parser!(u32).range(1..))]
    pub uav: u32,
    /// Process id of the launcher to end with.
    #[arg(long, hide = true)]
    pub launcher: Option<u32>,
}

/// Why a UAV cannot be flown.
#[derive(Debug, thiserror::Error)]
pub enum AgentError {
    /// The rest of the run cannot be reached.
    #[error(transparent)]
    Bus(#[from] BusError),
    /// The run's scenario is not readable.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
    /// There is no such UAV.
    #[error("--uav {uav}: this run has UAVs 1 to {count}")]
    NoSuchUav {
        /// The number given.
        uav: u32,
        /// How many there are.
        count: u32,
    },
}

/// Flies one UAV until the flight ends.
pub fn run(args: &Args) -> Result<(), AgentError> {
    let uav = UavId(args.uav);
    let member = Member::join(&args.domain, Part::Agent(uav), args.launcher)?;
    let scenario = Scenario::resolved(&member.domain().scenario()?)?;
    let count = scenario.formation.uavs;
    if uav.0 > count {
        return Err(AgentError::NoSuchUav { uav: uav.0, count });
    }
    let mut pilot = Pilot::new(&scenario, uav);
    let ports = Ports::open(&member, uav, count)?;
    let mut lead = Lead::new(&member, &scenario)?;
    let mut patience = if scenario.time.real_time { Patience::calm() } else { Patience::eager() };
    let gate = member.attend()?;
    let mut seen = None;
    while let Wait::Tick(tick) = gate.wait(seen, &mut patience, member.stop()) {
        let woke_ns = monotonic_ns();
        ports.receive(&mut pilot, tick)?;
        lead.receive(&mut pilot, &gate, tick)?;
        let read_ns = monotonic_ns();
        if let Some(decision) = pilot.fly(tick) {
            let stamps = Stamps { woke_ns, read_ns, sent_ns: monotonic_ns() };
            ports.state.send(decision.state, stamps)?;
            ports.command.send(decision.command, stamps)?;
        }
        gate.answer();
        seen = Some(tick);
    }
    Ok(())
}

/// All that an agent is connected to beside the leader: its own senses, its two ring neighbours, and what it sends itself.
struct Ports {
    sensed: Subscriber<Sensed>,
    previous: Subscriber<UavState>,
    next: Subscriber<UavState>,
    state: Publisher<UavState>,
    command: Publisher<Command>,
}

impl Ports {
    fn open(member: &Member, uav: UavId, count: u32) -> Result<Self, BusError> {
        let (node, depth) = (member.node(), channel::TICK_DEPTH);
        Ok(Self {
            sensed: channel::sensed(uav).subscriber(node, depth)?,
            previous: channel::state(uav.previous(count)).subscriber(node, depth)?,
            next: channel::state(uav.next(count)).subscriber(node, depth)?,
            state: channel::state(uav).publisher(node)?,
            command: channel::command(uav).publisher(node)?,
        })
    }

    /// Takes in this tick's senses, and what the others sent until the tick before.
    fn receive(&self, pilot: &mut Pilot, now: Tick) -> Result<(), BusError> {
        // A fast sender's sample of this very tick is no sign that the one before has come: a successor's may overtake.
        let newest = |sent: Tick| sent.next() == now;
        self.sensed.drain_until(|sensed, _| {
            pilot.sense(sensed);
            sensed.tick >= now
        })?;
        self.previous.drain_until(|state, _| {
            pilot.hear_previous(state);
            newest(state.tick)
        })?;
        self.next.drain_until(|state, _| {
            pilot.hear_next(state);
            newest(state.tick)
        })
    }
}

/// What comes from the leader.
struct Lead<'a> {
    member: &'a Member,
    states: Subscriber<LeaderState>,
    /// The last tick that was received in.
    received: Option<Tick>,
    /// How long to wait for what was lost with a leader; not at all in real time.
    limit: Duration,
}

impl<'a> Lead<'a> {
    fn new(member: &'a Member, scenario: &Scenario) -> Result<Self, BusError> {
        let channel = channel::leader(scenario.formation.uavs);
        let limit = if scenario.time.real_time { 0.0 } else { 2.0 * scenario.supervision.start_timeout_s };
        Ok(Self {
            member,
            states: channel.subscriber(member.node(), channel::TICK_DEPTH)?,
            received: None,
            limit: Duration::from_secs_f64(limit),
        })
    }

    /// Takes in what the leader sent until the tick before.
    ///
    /// A leader that is killed may take with it what this agent has not fetched, though others have: chance, which has no
    /// part in lockstep. Its successor says it again; until then this agent waits.
    fn receive(&mut self, pilot: &mut Pilot, gate: &Gate, now: Tick) -> Result<(), BusError> {
        let since = Instant::now();
        loop {
            self.states.drain_until(|state, _| {
                pilot.hear_leader(state);
                state.tick.next() == now
            })?;
            let waits = self.was_robbed(pilot, gate, now) && since.elapsed() < self.limit;
            if !waits || self.member.stop().is_set() {
                self.received = Some(now);
                return Ok(());
            }
            thread::sleep(LOOK_AGAIN);
        }
    }

    /// Whether the leader has told everybody of the tick before, this agent listened, and has not heard it.
    fn was_robbed(&self, pilot: &Pilot, gate: &Gate, now: Tick) -> bool {
        let before = Some(Tick(now.0 - 1));
        self.received == before && pilot.led_until(now) < before && gate.led() >= before && !gate.is_closed()
    }
}
