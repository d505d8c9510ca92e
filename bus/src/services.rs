//! The services of a run: one per kind of payload and sender. The launcher creates them, everybody else opens them.
//!
//! Each function here is one row of the table: the service's name, its payload, its readers and its depth.

use crate::{
    BusError, ballast,
    channel::{Channel, Factory},
    waker,
};
use iceoryx2::{node::Node, prelude::ipc};
use ringwing_flight::{
    Account, Command, EventMessage, FormationError, LeaderState, LinkCounts, Payload, Roster, Sensed,
    TickTiming, UavId, UavState,
};
use ringwing_scenario::{Scenario, Wake};
use std::marker::PhantomData;

/// Samples that the recorder may lag behind. More cost shared memory on every service; fewer lose samples in real time
/// when the recorder waits for the disk.
pub const RECORDER_DEPTH: usize = 1024;
/// Samples kept for a reader that works tick by tick. In lockstep a fast neighbour is one tick ahead at most, so fewer
/// could lose one, and more would never be filled.
pub const TICK_DEPTH: usize = 4;
/// Samples of a UAV's state kept for each reader. More cost memory on every link of the ring; fewer lose more of them
/// to a neighbour that is late in real time.
const STATE_DEPTH: usize = 16;
/// Readers of one UAV's state. In a whole ring it has two; while many UAVs take each other for lost, up to eight and the
/// nearest living on each side listen to one UAV, and one or two more that take turns. With fewer places scheduling
/// decides who gets one, so that a flight in lockstep is not repeatable; more cost memory.
const STATE_READERS: usize = 20;
/// Publishers per service: one sender, and dead ones that are not cleaned up yet. With fewer, a sender that is killed
/// repeatedly cannot restart at once.
const SENDERS: usize = 3;
/// Readers and nodes beyond those that the swarm needs: restarted ones, and people who look into a live run. With
/// fewer, they wait for a place.
const SPARE_READERS: usize = 3;

/// What `uav` senses, from the world, for the agent and the recorder.
pub fn sensed(uav: UavId) -> Channel<Sensed> {
    channel(format!("uav/{}/sensed", uav.0), 2, RECORDER_DEPTH)
}

/// What `uav` tells its ring neighbours.
pub fn state(uav: UavId) -> Channel<UavState> {
    channel(format!("uav/{}/state", uav.0), STATE_READERS, STATE_DEPTH)
}

/// What `uav`'s agent asks of its airframe, for the world.
pub fn command(uav: UavId) -> Channel<Command> {
    channel(format!("uav/{}/command", uav.0), 1, TICK_DEPTH)
}

/// How `uav`'s commands came about, for the recorder.
pub fn account(uav: UavId) -> Channel<Account> {
    channel(format!("uav/{}/account", uav.0), 1, RECORDER_DEPTH)
}

/// Where the leader is, for the agents of a swarm of `uavs` and the recorder.
pub fn leader(uavs: u32) -> Channel<LeaderState> {
    channel("leader/state".into(), uavs as usize + 2, RECORDER_DEPTH)
}

/// What happened to the samples on links with faults, from the receiving agents of a swarm of `uavs`, for the recorder.
///
/// One service for all agents, because most of them never send.
pub fn links(uavs: u32) -> Channel<LinkCounts> {
    let links = with_history(channel("uav/links".into(), 2, RECORDER_DEPTH));
    Channel { senders: uavs as usize + SENDERS, ..links }
}

/// How long each tick took, from the world, for the recorder.
pub fn timing() -> Channel<TickTiming> {
    channel("world/timing".into(), 2, RECORDER_DEPTH)
}

/// Events in the air, from the world, for the recorder and the launcher.
pub fn world_events() -> Channel<EventMessage> {
    with_history(channel("world/events".into(), 2, RECORDER_DEPTH))
}

/// Events of processes, from the launcher, for the recorder.
pub fn launcher_events() -> Channel<EventMessage> {
    with_history(channel("launcher/events".into(), 2, RECORDER_DEPTH))
}

/// Which processes run, from the launcher, for the world.
pub fn roster() -> Channel<Roster> {
    with_history(channel("launcher/roster".into(), 2, TICK_DEPTH))
}

/// How far the swarm is from its formation, from the recorder, for the launcher's progress line.
pub fn formation_error() -> Channel<FormationError> {
    with_history(channel("recorder/formation_error".into(), 2, TICK_DEPTH))
}

fn channel<T: Payload>(name: String, readers: usize, depth: usize) -> Channel<T> {
    let readers = readers + SPARE_READERS;
    Channel { name, senders: SENDERS, readers, depth, history: 0, payload: PhantomData }
}

/// Gives a late subscriber the last sample, for data that is sent rarely and stays valid.
fn with_history<T>(channel: Channel<T>) -> Channel<T> {
    Channel { history: 1, ..channel }
}

/// All services of a run. They exist as long as this value.
#[derive(Debug)]
#[expect(dead_code, reason = "the fields are only held: dropping a factory removes its service")]
pub struct Services {
    leader: Factory<LeaderState>,
    links: Factory<LinkCounts>,
    timing: Factory<TickTiming>,
    events: [Factory<EventMessage>; 2],
    roster: Factory<Roster>,
    formation_error: Factory<FormationError>,
    uavs: Vec<UavServices>,
    wake_ups: Option<waker::Events>,
    ballast: Vec<ballast::Factory>,
}

#[derive(Debug)]
#[expect(dead_code, reason = "the fields are only held: dropping a factory removes its service")]
struct UavServices {
    sensed: Factory<Sensed>,
    state: Factory<UavState>,
    command: Factory<Command>,
    account: Factory<Account>,
}

impl Services {
    /// Creates the services of `scenario`'s swarm in the domain of `node`.
    ///
    /// Events and ballast are created only if the scenario uses them, because each service takes time and memory.
    pub fn create(node: &Node<ipc::Service>, scenario: &Scenario) -> Result<Self, BusError> {
        let uavs = scenario.formation.uavs;
        let has_events = scenario.ipc.wake == Wake::Event;
        let has_ballast = scenario.ipc.payload_bytes > 0;
        Ok(Self {
            leader: leader(uavs).create(node)?,
            links: links(uavs).create(node)?,
            timing: timing().create(node)?,
            events: [world_events().create(node)?, launcher_events().create(node)?],
            roster: roster().create(node)?,
            formation_error: formation_error().create(node)?,
            uavs: UavId::all(uavs).map(|uav| UavServices::create(node, uav)).collect::<Result<_, _>>()?,
            wake_ups: has_events
                .then(|| waker::Events::create(node, uavs as usize + SPARE_READERS))
                .transpose()?,
            ballast: if has_ballast { ballast::create(node, uavs)? } else { Vec::new() },
        })
    }
}

impl UavServices {
    fn create(node: &Node<ipc::Service>, uav: UavId) -> Result<Self, BusError> {
        Ok(Self {
            sensed: sensed(uav).create(node)?,
            state: state(uav).create(node)?,
            command: command(uav).create(node)?,
            account: account(uav).create(node)?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Stamps, create_node, domain::DomainOwner};

    #[test]
    fn a_sample_arrives_unchanged_with_its_stamps() {
        let (owner, _gate) = DomainOwner::create("").unwrap();
        let node = create_node(owner.domain(), "test").unwrap();
        let mut scenario = Scenario::default();
        scenario.formation.uavs = 3;
        let _services = Services::create(&node, &scenario).unwrap();
        let publisher = command(UavId(2)).publisher(&node).unwrap();
        let subscriber = command(UavId(2)).subscriber(&node, TICK_DEPTH).unwrap();
        let sent: Vec<Command> =
            (0..6).map(|tick| Command::withheld(ringwing_flight::Tick(tick), UavId(2))).collect();
        let stamps = Stamps { woke_ns: 1, read_ns: 2, sent_ns: 3, sending_ns: 4 };
        for one in &sent {
            publisher.send(*one, stamps).unwrap();
        }
        let mut received = Vec::new();
        subscriber.drain(|command, with| received.push((*command, *with))).unwrap();
        let newest: Vec<_> = sent[2..].iter().map(|command| (*command, stamps)).collect();
        assert_eq!(received, newest, "the newest {TICK_DEPTH}, oldest first");
    }

    #[test]
    fn a_newcomer_gets_the_last_roster() {
        let (owner, _gate) = DomainOwner::create("").unwrap();
        let node = create_node(owner.domain(), "test").unwrap();
        let mut scenario = Scenario::default();
        scenario.formation.uavs = 3;
        let _services = Services::create(&node, &scenario).unwrap();
        let publisher = roster().publisher(&node).unwrap();
        let send = |revision| {
            let mut roster = Roster::empty();
            roster.revision = revision;
            publisher.send(roster, Stamps::now()).unwrap();
        };
        (1..=3).for_each(send);
        let subscriber = roster().subscriber(&node, TICK_DEPTH).unwrap();
        // iceoryx2 hands the history over when the sender next looks at its connections.
        send(4);
        let mut revisions = Vec::new();
        subscriber.drain(|roster, _| revisions.push(roster.revision)).unwrap();
        assert_eq!(revisions, [3, 4]);
    }
}
