//! The process that flies one UAV.

use crate::{Pilot, faults::Faults, impairment::Route, inlet::Inlet};
use ringwing_messages::{
    BusError, Command, DomainId, Gate, LeaderState, LinkCounts, Member, Part, Publisher, Sensed, Stamps,
    Tick, UavId, UavState, Wait, channel, gate::Patience, monotonic_ns,
};
use ringwing_scenario::{
    Scenario, ScenarioError,
    fault::{Source, schedule::LinkFault},
};
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
    let mut ports = Ports::open(&member, uav, &scenario)?;
    let mut patience = if scenario.time.real_time { Patience::calm() } else { Patience::eager() };
    let mut faults = Faults::new(scenario, uav);
    let gate = member.attend()?;
    let mut seen = gate.missed();
    while let Wait::Tick(tick) = gate.wait(seen, &mut patience, member.stop()) {
        let woke_ns = monotonic_ns();
        if let Some(news) = faults.news(&member, &gate)? {
            ports.set_faults(&news);
        }
        ports.receive(&mut pilot, tick)?;
        ports.receive_leader(&mut pilot, &member, &gate, tick)?;
        let read_ns = monotonic_ns();
        faults.dawdle(tick);
        ports.send_counts(&member, tick)?;
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
    sensed: Inlet<Sensed>,
    previous: Inlet<UavState>,
    next: Inlet<UavState>,
    leader: Inlet<LeaderState>,
    state: Publisher<UavState>,
    command: Publisher<Command>,
    /// Opened once there is something to say of links.
    counts: Option<Publisher<LinkCounts>>,
    rate_hz: u32,
    last_tick: Tick,
    uavs: u32,
    /// The last tick that was received in.
    received: Option<Tick>,
    /// How long to wait for what was lost with a leader; not at all in real time.
    robbed_limit: Duration,
}

impl Ports {
    fn open(member: &Member, uav: UavId, scenario: &Scenario) -> Result<Self, BusError> {
        let (node, depth, uavs) = (member.node(), channel::TICK_DEPTH, scenario.formation.uavs);
        let patience_s =
            if scenario.time.real_time { 0.0 } else { 2.0 * scenario.supervision.start_timeout_s };
        let from = |source, ticks| Route { source, to: uav, ticks };
        let neighbour = |other: UavId| {
            let port = channel::state(other).subscriber(node, depth)?;
            Ok::<_, BusError>(Inlet::new(port, from(Source::Uav(other.0), 1), scenario))
        };
        let sensed = channel::sensed(uav).subscriber(node, depth)?;
        let leader = channel::leader(uavs).subscriber(node, depth)?;
        Ok(Self {
            sensed: Inlet::new(sensed, from(Source::Own, 0), scenario),
            previous: neighbour(uav.previous(uavs))?,
            next: neighbour(uav.next(uavs))?,
            leader: Inlet::new(leader, from(Source::Leader, 1), scenario),
            state: channel::state(uav).publisher(node)?,
            command: channel::command(uav).publisher(node)?,
            counts: None,
            rate_hz: scenario.time.rate_hz,
            last_tick: Tick(scenario.last_tick()),
            uavs,
            received: None,
            robbed_limit: Duration::from_secs_f64(patience_s),
        })
    }

    fn set_faults(&mut self, faults: &[LinkFault]) {
        self.sensed.set_faults(faults);
        self.previous.set_faults(faults);
        self.next.set_faults(faults);
        self.leader.set_faults(faults);
    }

    /// Takes in this tick's senses, and what the others sent until the tick before.
    fn receive(&mut self, pilot: &mut Pilot, now: Tick) -> Result<(), BusError> {
        self.sensed.receive(now, |sensed| pilot.sense(sensed))?;
        self.previous.receive(now, |state| pilot.hear_previous(state))?;
        self.next.receive(now, |state| pilot.hear_next(state))
    }

    /// Takes in what the leader sent until the tick before.
    ///
    /// A leader that is killed may take with it what this agent has not fetched, though others have: chance, which has no
    /// part in lockstep. Its successor says it again; until then this agent waits.
    fn receive_leader(
        &mut self,
        pilot: &mut Pilot,
        member: &Member,
        gate: &Gate,
        now: Tick,
    ) -> Result<(), BusError> {
        let before = Tick(now.0 - 1);
        let listened = self.received == Some(before);
        self.received = Some(now);
        let since = Instant::now();
        loop {
            self.leader.receive(now, |state| pilot.hear_leader(state))?;
            let was_sent = gate.led() >= Some(before) && !gate.is_closed();
            let was_robbed = listened && was_sent && self.leader.arrived() < Some(before);
            if !was_robbed || since.elapsed() >= self.robbed_limit || member.stop().is_set() {
                return Ok(());
            }
            thread::sleep(LOOK_AGAIN);
        }
    }

    /// Says what has become of samples on links with faults: once a second, and in the end.
    fn send_counts(&mut self, member: &Member, now: Tick) -> Result<(), BusError> {
        if now.0 % i64::from(self.rate_hz) != 0 && now != self.last_tick {
            return Ok(());
        }
        let all = [
            self.previous.counts(now),
            self.next.counts(now),
            self.leader.counts(now),
            self.sensed.counts(now),
        ];
        for counts in all.into_iter().flatten() {
            if self.counts.is_none() {
                self.counts = Some(channel::links(self.uavs).publisher(member.node())?);
            }
            if let Some(port) = &self.counts {
                port.send(counts, Stamps::now())?;
            }
        }
        Ok(())
    }
}
