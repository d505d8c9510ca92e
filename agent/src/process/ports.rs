//! An agent's ends of the run's services.
//!
//! Never decides anything about the flight: it moves samples between the services and the [`UavAgent`].

use crate::{
    UavAgent,
    reception::{Inputs, Take},
    uav_agent::Answer,
};
use ringwing_bus::{Ballast, BusError, Gate, Member, Publisher, Stamps, Subscriber, monotonic_ns, services};
use ringwing_flight::{Account, Command, LeaderState, LinkCounts, Pace, Sensed, Tick, UavId, UavState};
use std::{
    thread,
    time::{Duration, Instant},
};

/// Sleep between two polls for a lost leader state. Longer delays the tick after a leader's restart; shorter burns CPU.
const POLL_INTERVAL: Duration = Duration::from_micros(200);

/// An agent's ends of the services.
pub(super) struct AgentPorts<'m> {
    member: &'m Member,
    inputs: InputPorts<'m>,
    state: Publisher<UavState>,
    command: Publisher<Command>,
    account: Publisher<Account>,
    /// Opened for the first counts: most runs have no link faults.
    link_counts: Option<Publisher<LinkCounts>>,
    /// Bytes that benchmarks carry besides the messages.
    ballast: Option<Ballast>,
    uavs: u32,
    /// The last tick in which samples were received.
    received: Option<Tick>,
    /// How long to wait for a leader state that was lost with its leader.
    lost_with_leader_limit: Duration,
    /// How long it took to send the last answer.
    sending_ns: u64,
}

/// The receiving ends.
struct InputPorts<'m> {
    member: &'m Member,
    sensed: Subscriber<Sensed>,
    /// One for each UAV that is listened to.
    states: Vec<(UavId, Subscriber<UavState>)>,
    leader: Subscriber<LeaderState>,
}

impl<'m> AgentPorts<'m> {
    /// Opens all ports of `agent`, the agent of `uav`.
    pub(super) fn open(member: &'m Member, uav: UavId, agent: &UavAgent) -> Result<Self, BusError> {
        let (node, scenario) = (member.node(), member.scenario());
        let uavs = scenario.formation.uavs;
        // In real time nothing waits. In lockstep a replacement has the start timeout to appear; wait twice as long.
        let limit_s = match scenario.pace() {
            Pace::RealTime => 0.0,
            Pace::Lockstep => 2.0 * scenario.supervision.start_timeout_s,
        };
        let ballast_bytes = scenario.ipc.payload_bytes;
        Ok(Self {
            member,
            inputs: InputPorts::open(member, uav, uavs, agent.listened())?,
            state: services::state(uav).publisher(node)?,
            command: services::command(uav).publisher(node)?,
            account: services::account(uav).publisher(node)?,
            link_counts: None,
            ballast: (ballast_bytes > 0).then(|| Ballast::of_agent(node, uav, ballast_bytes)).transpose()?,
            uavs,
            received: None,
            lost_with_leader_limit: Duration::from_secs_f64(limit_s),
            sending_ns: 0,
        })
    }

    /// Lets `agent` receive what it can use in `now`.
    pub(super) fn receive(&mut self, agent: &mut UavAgent, gate: &Gate, now: Tick) -> Result<(), BusError> {
        agent.receive(now, &mut self.inputs)?;
        self.receive_lost_with_leader(agent, gate, now)?;
        if let Some(ballast) = &self.ballast {
            ballast.receive()?;
        }
        Ok(())
    }

    /// Waits for the leader state of the tick before `now` if the leader sent it and it has not arrived.
    ///
    /// When the leader is killed, iceoryx2 drops the samples that a reader has not fetched yet, though other agents
    /// may have fetched theirs. The leader's replacement sends that state again. Waiting for it keeps lockstep
    /// deterministic.
    fn receive_lost_with_leader(
        &mut self,
        agent: &mut UavAgent,
        gate: &Gate,
        now: Tick,
    ) -> Result<(), BusError> {
        let before = Tick(now.0 - 1);
        // An agent that did not take part in the tick before ignores what was sent in it.
        let was_there = self.received.replace(now) == Some(before);
        let is_missing = |agent: &UavAgent| {
            let was_sent = || gate.led() >= Some(before) && !gate.is_closed();
            was_there && agent.newest_leader_arrived() < Some(before) && was_sent()
        };
        let since = Instant::now();
        while is_missing(agent)
            && since.elapsed() < self.lost_with_leader_limit
            && !self.member.stop().is_set()
        {
            thread::sleep(POLL_INTERVAL);
            agent.receive_leader(now, &mut self.inputs)?;
        }
        Ok(())
    }

    /// Opens and closes inputs, so that exactly the UAVs that `agent` now listens to are open.
    pub(super) fn update_inputs(&mut self, agent: &mut UavAgent) -> Result<(), BusError> {
        agent.update_inputs(&mut self.inputs)
    }

    /// Sends the answer to `now`. The agent woke at `woke_ns` and had read its inputs at `read_ns`.
    pub(super) fn send(
        &mut self,
        answer: &Answer,
        now: Tick,
        woke_ns: u64,
        read_ns: u64,
    ) -> Result<(), BusError> {
        let sent_ns = monotonic_ns();
        let stamps = Stamps { woke_ns, read_ns, sent_ns, sending_ns: self.sending_ns };
        if let Some(ballast) = &self.ballast {
            ballast.send(now)?;
        }
        // Send the command last: it may end the tick.
        if let Some(account) = answer.account {
            self.account.send(account, stamps)?;
        }
        if let Some(state) = answer.state {
            self.state.send(state, stamps)?;
        }
        self.command.send(answer.command, stamps)?;
        self.sending_ns = monotonic_ns() - sent_ns;
        Ok(())
    }

    /// Sends the counts of links with faults.
    pub(super) fn send_link_counts(&mut self, all: impl Iterator<Item = LinkCounts>) -> Result<(), BusError> {
        for counts in all {
            if self.link_counts.is_none() {
                self.link_counts = Some(services::links(self.uavs).publisher(self.member.node())?);
            }
            if let Some(port) = &self.link_counts {
                port.send(counts, Stamps::now())?;
            }
        }
        Ok(())
    }
}

impl<'m> InputPorts<'m> {
    fn open(member: &'m Member, uav: UavId, uavs: u32, listened: &[UavId]) -> Result<Self, BusError> {
        let (node, depth) = (member.node(), services::TICK_DEPTH);
        let state = |other: &UavId| Ok((*other, services::state(*other).subscriber(node, depth)?));
        Ok(Self {
            member,
            sensed: services::sensed(uav).subscriber(node, depth)?,
            states: listened.iter().map(state).collect::<Result<_, BusError>>()?,
            leader: services::leader(uavs).subscriber(node, depth)?,
        })
    }
}

impl Inputs for InputPorts<'_> {
    type Error = BusError;

    fn sensed(&mut self, take: &mut Take<Sensed>) -> Result<(), BusError> {
        self.sensed.drain_until(|sample, _| take(sample))
    }

    fn state(&mut self, from: UavId, take: &mut Take<UavState>) -> Result<(), BusError> {
        let Some((_, port)) = self.states.iter().find(|(uav, _)| *uav == from) else { return Ok(()) };
        port.drain_until(|sample, _| take(sample))
    }

    fn leader(&mut self, take: &mut Take<LeaderState>) -> Result<(), BusError> {
        self.leader.drain_until(|sample, _| take(sample))
    }

    /// A service can be full while UAVs disagree on who is alive and too many listen to the same one. Places become
    /// free as they agree, so a full service is not an error.
    fn open_state(&mut self, from: UavId) -> Result<bool, BusError> {
        let port = services::state(from).subscriber_if_free(self.member.node(), services::TICK_DEPTH)?;
        let is_open = port.is_some();
        self.states.extend(port.map(|port| (from, port)));
        Ok(is_open)
    }

    fn close_state(&mut self, from: UavId) {
        self.states.retain(|(uav, _)| *uav != from);
    }
}
