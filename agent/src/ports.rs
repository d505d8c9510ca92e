//! All that an agent is connected to: its own senses, those it listens to, the leader, and what it sends itself.

use crate::{Pilot, impairment::Route, inlet::Inlet};
use ringwing_bus::{BusError, Gate, Member, Publisher, Stamps, channel};
use ringwing_flight::{Account, Command, LeaderState, LinkCounts, Sensed, Tick, UavId, UavState};
use ringwing_scenario::{
    Scenario,
    fault::{Source, schedule::LinkFault},
};
use std::{
    thread,
    time::{Duration, Instant},
};

/// How long to sleep before looking again for what is missing.
const LOOK_AGAIN: Duration = Duration::from_micros(200);

/// An agent's ends of the services.
pub(crate) struct Ports {
    uav: UavId,
    sensed: Inlet<Sensed>,
    ears: Vec<Ear>,
    leader: Inlet<LeaderState>,
    pub(crate) state: Publisher<UavState>,
    pub(crate) command: Publisher<Command>,
    pub(crate) account: Publisher<Account>,
    /// Opened once there is something to say of links.
    counts: Option<Publisher<LinkCounts>>,
    faults: Vec<LinkFault>,
    scenario: Scenario,
    uavs: u32,
    /// The last tick that was received in.
    received: Option<Tick>,
    /// How long to wait for what was lost with a leader; not at all in real time.
    robbed_limit: Duration,
}

/// Where what another UAV says comes in; it is closed, and the link remembered, while nobody listens.
struct Ear {
    uav: UavId,
    inlet: Inlet<UavState>,
}

impl Ports {
    pub(crate) fn open(member: &Member, uav: UavId, scenario: &Scenario) -> Result<Self, BusError> {
        let (node, depth, uavs) = (member.node(), channel::TICK_DEPTH, scenario.formation.uavs);
        let patience_s =
            if scenario.time.real_time { 0.0 } else { 2.0 * scenario.supervision.start_timeout_s };
        let route = |source, ticks| Route { source, to: uav, ticks };
        let sensed = channel::sensed(uav).subscriber(node, depth)?;
        let leader = channel::leader(uavs).subscriber(node, depth)?;
        let mut ports = Self {
            uav,
            sensed: Inlet::new(sensed, route(Source::Own, 0), scenario),
            ears: Vec::new(),
            leader: Inlet::new(leader, route(Source::Leader, 1), scenario),
            state: channel::state(uav).publisher(node)?,
            command: channel::command(uav).publisher(node)?,
            account: channel::account(uav).publisher(node)?,
            counts: None,
            faults: Vec::new(),
            scenario: scenario.clone(),
            uavs,
            received: None,
            robbed_limit: Duration::from_secs_f64(patience_s),
        };
        for other in [uav.previous(uavs), uav.next(uavs)] {
            let inlet = ports.inlet(other, channel::state(other).subscriber(node, depth)?);
            ports.ears.push(Ear { uav: other, inlet });
        }
        Ok(ports)
    }

    fn inlet(&self, from: UavId, port: ringwing_bus::Subscriber<UavState>) -> Inlet<UavState> {
        let route = Route { source: Source::Uav(from.0), to: self.uav, ticks: 1 };
        let mut inlet = Inlet::new(port, route, &self.scenario);
        inlet.set_faults(&self.faults);
        inlet
    }

    /// From now on the faults of all links are `faults`.
    pub(crate) fn set_faults(&mut self, faults: Vec<LinkFault>) {
        self.sensed.set_faults(&faults);
        self.leader.set_faults(&faults);
        self.ears.iter_mut().for_each(|ear| ear.inlet.set_faults(&faults));
        self.faults = faults;
    }

    /// Takes in this tick's senses, and what the others sent until the tick before.
    pub(crate) fn receive(&mut self, pilot: &mut Pilot, now: Tick) -> Result<(), BusError> {
        self.sensed.receive(now, |sensed| pilot.sense(sensed))?;
        self.ears.iter_mut().try_for_each(|ear| ear.inlet.receive(now, |state| pilot.hear(state, now)))
    }

    /// Takes in what the leader sent until the tick before.
    ///
    /// A leader that is killed may take with it what this agent has not fetched, though others have: chance, which has no
    /// part in lockstep. Its successor says it again; until then this agent waits.
    pub(crate) fn receive_leader(
        &mut self,
        pilot: &mut Pilot,
        member: &Member,
        gate: &Gate,
        now: Tick,
    ) -> Result<(), BusError> {
        let before = Tick(now.0 - 1);
        let listened = self.received == Some(before);
        self.received = Some(now);
        let mut robbed_since = None;
        loop {
            self.leader.receive(now, |state| pilot.hear_leader(state))?;
            let was_sent = || gate.led() >= Some(before) && !gate.is_closed();
            if !listened || self.leader.arrived() >= Some(before) || !was_sent() {
                return Ok(());
            }
            let since = *robbed_since.get_or_insert_with(Instant::now);
            if since.elapsed() >= self.robbed_limit || member.stop().is_set() {
                return Ok(());
            }
            thread::sleep(LOOK_AGAIN);
        }
    }

    /// Listens to `uavs` from the next tick on, and to nobody else.
    ///
    /// Where a service has no place left, that of one who listens there in vain, it is tried again in the next tick.
    pub(crate) fn listen_to(&mut self, member: &Member, uavs: &[UavId]) -> Result<(), BusError> {
        let open = self.ears.iter().filter(|ear| ear.inlet.is_open());
        if open.clone().count() == uavs.len() && open.into_iter().all(|ear| uavs.contains(&ear.uav)) {
            return Ok(());
        }
        for ear in self.ears.iter_mut().filter(|ear| !uavs.contains(&ear.uav)) {
            ear.inlet.close();
        }
        for uav in uavs {
            self.listen(member, *uav)?;
        }
        Ok(())
    }

    fn listen(&mut self, member: &Member, uav: UavId) -> Result<(), BusError> {
        let known = self.ears.iter().position(|ear| ear.uav == uav);
        if known.is_some_and(|place| self.ears[place].inlet.is_open()) {
            return Ok(());
        }
        let free = channel::state(uav).subscriber_if_free(member.node(), channel::TICK_DEPTH)?;
        match (known, free) {
            (Some(place), Some(port)) => self.ears[place].inlet.open(port),
            (None, Some(port)) => {
                let inlet = self.inlet(uav, port);
                self.ears.push(Ear { uav, inlet });
            }
            (_, None) => {}
        }
        Ok(())
    }

    /// Says what has become of samples on links with faults: once a second, and in the end.
    pub(crate) fn send_counts(&mut self, member: &Member, now: Tick) -> Result<(), BusError> {
        if now.0 % i64::from(self.scenario.time.rate_hz) != 0 && now.0 != self.scenario.last_tick() {
            return Ok(());
        }
        let ears = self.ears.iter().map(|ear| ear.inlet.counts(now));
        for counts in ears.chain([self.leader.counts(now), self.sensed.counts(now)]).flatten() {
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
