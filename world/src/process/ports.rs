//! Everything that connects the world to the rest of its run: services, the tick gate, stop requests.
//!
//! Never decides when to send or what to wait for.

use ringwing_bus::{
    Ballast, BusError, Due, Gate, Member, Publisher, Stamps, StopFlag, Subscriber, Waker, failed_connections,
    services,
};
use ringwing_flight::{Command, Event, EventMessage, Roster, Sensed, Tick, TickTiming, TimedEvent, UavId};
use std::time::Duration;

/// The world's ends of the services, and its place at the gate.
pub(super) struct Ports {
    /// One of each UAV, UAV 1 first.
    pub(super) sensed: Vec<Publisher<Sensed>>,
    /// One of each UAV, UAV 1 first.
    pub(super) commands: Vec<Subscriber<Command>>,
    pub(super) timing: Publisher<TickTiming>,
    /// One of each UAV in a run that carries ballast, else empty.
    pub(super) ballast: Vec<Ballast>,
    pub(super) gate: Gate,
    waker: Waker,
    stop: StopFlag,
    roster: Subscriber<Roster>,
    events: Publisher<EventMessage>,
    /// How many nudges were noticed so far.
    nudges: u32,
    /// How many failed connections were logged so far.
    failed_connections: u64,
}

impl Ports {
    /// Opens everything, then says that the world is ready.
    pub(super) fn open(member: &Member) -> Result<Self, BusError> {
        let (scenario, node, depth) = (member.scenario(), member.node(), services::TICK_DEPTH);
        let uavs = UavId::all(scenario.formation.uavs);
        let ballast_bytes = scenario.ipc.payload_bytes;
        let loaded = uavs.clone().filter(|_| ballast_bytes > 0);
        Ok(Self {
            sensed: uavs
                .clone()
                .map(|uav| services::sensed(uav).publisher(node))
                .collect::<Result<_, _>>()?,
            commands: uavs
                .map(|uav| services::command(uav).subscriber(node, depth))
                .collect::<Result<_, _>>()?,
            timing: services::timing().publisher(node)?,
            ballast: loaded
                .map(|uav| Ballast::of_world(node, uav, ballast_bytes))
                .collect::<Result<_, _>>()?,
            roster: services::roster().subscriber(node, depth)?,
            events: services::world_events().publisher(node)?,
            stop: member.stop().clone(),
            waker: Waker::of_world(member)?,
            // Last, because the launcher lets the run begin once the world is ready.
            gate: member.announce_ready()?,
            nudges: 0,
            failed_connections: 0,
        })
    }

    /// Whether the run is to end.
    pub(super) fn is_stopped(&self) -> bool {
        is_stopped(&self.gate, &self.stop)
    }

    /// Whether the world's process is asked to leave, even if the flight is over.
    pub(super) fn is_told_to_leave(&self) -> bool {
        self.stop.is_set()
    }

    /// Opens the tick `now`, which `expected` processes will answer, and wakes all that wait for it.
    pub(super) fn open_tick(&self, now: Tick, expected: u32) -> Result<(), BusError> {
        self.gate.open_tick(now, expected);
        self.waker.notify()
    }

    /// Ends the flight for every process.
    pub(super) fn close(&self) -> Result<(), BusError> {
        self.gate.close();
        self.waker.notify()
    }

    /// Waits until all expected answers to the open tick have come, at most for `limit`, or until a nudge.
    pub(super) fn wait_for_answers(&mut self, limit: Duration) -> Result<(), BusError> {
        self.waker.wait_for_answers(&self.gate, limit)
    }

    /// Waits until the tick is `due`, or until the run is to end.
    pub(super) fn wait_until(&mut self, due: Due) -> Result<(), BusError> {
        let (gate, stop) = (&self.gate, &self.stop);
        self.waker.wait_until(due, || is_stopped(gate, stop));
        self.waker.discard_events()
    }

    /// Sleeps until somebody nudges the world, at most for `limit`. Returns at once after a nudge that was not noticed
    /// yet.
    pub(super) fn wait_for_nudge(&self, limit: Duration) {
        self.gate.wait_for_nudge(self.nudges, limit);
    }

    /// Hands over the rosters that came with the latest nudges, oldest first. Without a nudge it only reads a counter.
    pub(super) fn drain_rosters(&mut self, mut take: impl FnMut(&Roster)) -> Result<(), BusError> {
        let nudges = self.gate.nudges();
        if nudges == self.nudges {
            return Ok(());
        }
        self.nudges = nudges;
        self.roster.drain(|roster, _| take(roster))
    }

    /// Logs what happened at `now`.
    pub(super) fn log_event(&self, now: Tick, event: Event) -> Result<(), BusError> {
        self.events.send(EventMessage::new(&TimedEvent { tick: now, event }), Stamps::now())
    }

    /// Logs connections that failed since the last call.
    pub(super) fn log_failed_connections(&mut self, now: Tick) -> Result<(), BusError> {
        let failed = failed_connections();
        if failed == self.failed_connections {
            return Ok(());
        }
        self.failed_connections = failed;
        self.log_event(now, Event::ConnectionsFailed { count: failed })
    }
}

fn is_stopped(gate: &Gate, stop: &StopFlag) -> bool {
    gate.stop_requested() || gate.is_closed() || stop.is_set()
}
