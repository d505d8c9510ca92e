//! The process that flies one UAV.

use crate::Pilot;
use ringwing_messages::{
    BusError, Command, DomainId, LeaderState, Member, Part, Publisher, Sensed, Stamps, Subscriber, Tick,
    UavId, UavState, Wait, channel, gate::Patience, monotonic_ns,
};
use ringwing_scenario::{Scenario, ScenarioError};

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
    let mut patience = if scenario.time.real_time { Patience::calm() } else { Patience::eager() };
    let gate = member.attend()?;
    let mut seen = None;
    while let Wait::Tick(tick) = gate.wait(seen, &mut patience, member.stop()) {
        let woke_ns = monotonic_ns();
        ports.receive(&mut pilot, tick)?;
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

/// All that an agent is connected to: its own senses, its two ring neighbours, the leader, and what it sends itself.
struct Ports {
    sensed: Subscriber<Sensed>,
    previous: Subscriber<UavState>,
    next: Subscriber<UavState>,
    leader: Subscriber<LeaderState>,
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
            leader: channel::leader(count).subscriber(node, depth)?,
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
        })?;
        self.leader.drain_until(|state, _| {
            pilot.hear_leader(state);
            newest(state.tick)
        })
    }
}
