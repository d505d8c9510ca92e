//! The services of a run: one per kind of payload and sender. The launcher creates them, everybody else opens them.
//!
//! Each function here is one row of the table: the service's name, its payload, its readers and its depth.

use crate::{
    BusError, Domain, Gate, ballast,
    blackboard::{Board, BoardFactory, kept_at},
    channel::{Channel, Factory, OBSERVERS, SENDERS, SPARE_READERS},
    demand,
    domain::Reserve,
    journal, waker,
};
use iceoryx2::{node::Node, prelude::ipc};
use ringwing_flight::{
    Account, Command, EventMessage, FormationError, LeaderState, LinkCounts, NearObstacles, Notes, OwnSenses,
    Pace, Part, Payload, Roster, Traffic, UavId, UavState,
};
use ringwing_scenario::{Scenario, Wake};
use std::{collections::BTreeMap, marker::PhantomData};

/// Samples of rare messages that the recorder may lag behind. More cost shared memory on each of these services; fewer
/// lose messages in real time when the recorder waits for the disk.
pub const RECORDER_DEPTH: usize = 1024;
/// Samples kept for a reader that works tick by tick. A roster comes at most a few times in a tick, so fewer could
/// lose one, and more would never be filled.
pub const TICK_DEPTH: usize = 4;
/// Counts of links that an observer may lag behind. More cost memory for each link with faults and each observer; fewer lose
/// counts, and the next ones follow within a second.
pub const OBSERVER_DEPTH: usize = 64;
/// Events kept for a recorder that joins late, such as the successor of a killed one: what happened meanwhile counts for
/// the verdict. With fewer, a process that is lost together with the recorder may go uncounted; more cost memory.
const EVENTS_KEPT: usize = 256;
/// Readers of one UAV's state. In a whole ring it has two; while many UAVs take each other for lost, many more listen
/// to one. With fewer places they wait for each other and scheduling decides who listens, so that a flight in lockstep
/// is not repeatable; more cost memory.
const STATE_READERS: usize = 40;
/// Readers of a board beyond those that the swarm needs: room for several generations of readers that were killed and are
/// not cleaned up yet. They cost the sender nothing, unlike the readers of a channel.
const SPARE_BOARD_READERS: usize = 8;
/// First key of a board that shares the service of another board. Any number larger than the count of kept ticks will do; a
/// smaller one makes the two boards use the same entries.
const KEYS_BESIDE: u32 = 0x100;

/// What `uav` senses of itself, from the world, for its agent.
pub(crate) fn own_senses(uav: UavId, pace: Pace) -> Board<OwnSenses> {
    board(format!("uav/{}/sensed", uav.0), Part::World, 1, pace)
}

/// The obstacles that `uav` senses, for its agent: beside what it senses of itself, in the same service.
pub(crate) fn near_obstacles(uav: UavId, pace: Pace) -> Board<NearObstacles> {
    beside(own_senses(uav, pace))
}

/// Which other aircraft `uav` senses, from the world, for its agent.
pub fn traffic(uav: UavId, pace: Pace) -> Board<Traffic> {
    board(format!("uav/{}/traffic", uav.0), Part::World, 1, pace)
}

/// What `uav` tells its ring neighbours.
pub fn state(uav: UavId, pace: Pace) -> Board<UavState> {
    board(format!("uav/{}/state", uav.0), Part::Agent(uav), STATE_READERS, pace)
}

/// What `uav`'s agent asks of its airframe, for the world.
pub fn command(uav: UavId, pace: Pace) -> Board<Command> {
    board(format!("uav/{}/command", uav.0), Part::Agent(uav), 1, pace)
}

/// How `uav`'s commands came about, for the world's journal: beside the command, in the same service.
pub fn account(uav: UavId, pace: Pace) -> Board<Account> {
    beside(command(uav, pace))
}

/// Where the leader is, for the agents of a swarm of `uavs` and the world.
pub fn leader(uavs: u32, pace: Pace) -> Board<LeaderState> {
    board("leader/state".into(), Part::Leader, uavs as usize + 1, pace)
}

/// What happened to the samples on links with faults, from the receiving agents of a swarm of `uavs`, for the recorder and
/// for observers.
///
/// One service for all agents, because most of them never send.
pub fn links(uavs: u32) -> Channel<LinkCounts> {
    let links = with_history(channel("uav/links".into(), 2 + OBSERVERS, RECORDER_DEPTH));
    // Every agent may come to send, and one that was killed keeps its place until it is cleaned up.
    Channel { senders: uavs as usize + SENDERS, ..links }
}

/// What controllers note for the log, from the agents of a swarm of `uavs`, for the recorder and for observers.
///
/// Apart from the journal, because the built-in law notes nothing: in the journal, notes would cost every flight.
pub fn notes(uavs: u32) -> Channel<Notes> {
    let notes = channel("uav/notes".into(), 2 + OBSERVERS, journal::notes_depth(uavs));
    Channel { senders: uavs as usize + SENDERS, ..notes }
}

/// Whether the run of `scenario` has a service for notes: only programs of the user's make notes.
pub fn has_notes(scenario: &Scenario) -> bool {
    scenario.first_own_agent().is_some()
}

/// Events in the air, from the world, for the recorder, the launcher and observers.
pub fn world_events() -> Channel<EventMessage> {
    with_kept_events(channel("world/events".into(), 2 + OBSERVERS, RECORDER_DEPTH))
}

/// Events of processes, from the launcher, for the recorder and observers.
pub fn launcher_events() -> Channel<EventMessage> {
    with_kept_events(channel("launcher/events".into(), 2 + OBSERVERS, RECORDER_DEPTH))
}

/// Which processes run, from the launcher, for the world.
pub fn roster() -> Channel<Roster> {
    with_history(channel("launcher/roster".into(), 2, TICK_DEPTH))
}

/// How far the swarm is from its formation, from the recorder, for the launcher's progress line.
pub fn formation_error() -> Channel<FormationError> {
    with_history(channel("recorder/formation_error".into(), 2, TICK_DEPTH))
}

fn board<T: Payload>(name: String, sender: Part, readers: usize, pace: Pace) -> Board<T> {
    let readers = readers + SPARE_BOARD_READERS;
    Board { name, sender, readers, kept: kept_at(pace), first_key: 0, payload: PhantomData }
}

/// A second board in the service of the first.
fn beside<T, U>(first: Board<T>) -> Board<U> {
    let Board { name, sender, readers, kept, .. } = first;
    Board { name, sender, readers, kept, first_key: KEYS_BESIDE, payload: PhantomData }
}

fn channel<T: Payload>(name: String, readers: usize, depth: usize) -> Channel<T> {
    let readers = readers + SPARE_READERS;
    Channel { name, senders: SENDERS, readers, depth, history: 0, payload: PhantomData }
}

/// Gives a late subscriber the last sample, for data that is sent rarely and stays valid.
fn with_history<T>(channel: Channel<T>) -> Channel<T> {
    Channel { history: 1, ..channel }
}

/// Gives a late subscriber what has happened before.
fn with_kept_events<T>(channel: Channel<T>) -> Channel<T> {
    Channel { history: EVENTS_KEPT, ..channel }
}

/// All services of a run. They exist as long as this value.
#[derive(Debug)]
#[expect(dead_code, reason = "most fields are only held: dropping a factory removes its service")]
pub struct Services {
    uavs: u32,
    pace: Pace,
    /// Whether UAVs have collision filters, which need to know the traffic.
    has_traffic: bool,
    /// The boards of each part's newest incarnation.
    boards: BTreeMap<Part, Vec<BoardFactory>>,
    journal: journal::Factory,
    links: Factory<LinkCounts>,
    notes: Option<Factory<Notes>>,
    events: [Factory<EventMessage>; 2],
    roster: Factory<Roster>,
    formation_error: Factory<FormationError>,
    wake_ups: Option<waker::Events>,
    ballast: Vec<ballast::Factory>,
}

impl Services {
    /// Creates the services of `scenario`'s swarm in `domain`, to which `node` belongs, with the boards of the first
    /// incarnation of every part.
    ///
    /// Events, ballast and the service for notes are created only if the scenario uses them, because each service takes time
    /// and memory.
    /// The journal keeps `journal_depth` ticks for a recorder that lags behind.
    pub fn create(
        node: &Node<ipc::Service>,
        domain: &Domain,
        scenario: &Scenario,
        journal_depth: usize,
    ) -> Result<Self, BusError> {
        let gate = domain.gate()?;
        let uavs = scenario.formation.uavs;
        let has_events = scenario.ipc.wake == Wake::Event;
        let has_ballast = scenario.ipc.payload_bytes > 0;
        let mut services = Self {
            uavs,
            pace: scenario.pace(),
            has_traffic: scenario.control.collision_filter,
            boards: BTreeMap::new(),
            journal: journal::create(node, journal_depth)?,
            links: links(uavs).create(node)?,
            notes: has_notes(scenario).then(|| notes(uavs).create(node)).transpose()?,
            events: [world_events().create(node)?, launcher_events().create(node)?],
            roster: roster().create(node)?,
            formation_error: formation_error().create(node)?,
            wake_ups: has_events
                // Leader and world take two of the spare places. One is left for a successor whose predecessor is not
                // cleaned up yet.
                .then(|| waker::Events::create(node, uavs as usize + SPARE_READERS))
                .transpose()?,
            ballast: if has_ballast { ballast::create(node, uavs)? } else { Vec::new() },
        };
        for part in Part::all(uavs) {
            // Give back only what the next boards take: a run that starts at the same time could use up the rest.
            domain.release_part(Reserve::Swarm, demand::board_bytes(part, uavs));
            services.create_next(node, &gate, part)?;
        }
        Ok(services)
    }

    /// Creates the boards of the next incarnation of `part`, with the values on the ones before, announces it at the gate,
    /// and lets go of the boards before. To be called when a process of that part has ended, before the next one starts.
    /// Fails if shared memory is full.
    ///
    /// The readers of the old boards keep them open until they have moved on.
    pub fn renew(&mut self, node: &Node<ipc::Service>, domain: &Domain, part: Part) -> Result<(), BusError> {
        domain.make_room(demand::successor_bytes())?;
        self.create_next(node, &domain.gate()?, part)
    }

    fn create_next(&mut self, node: &Node<ipc::Service>, gate: &Gate, part: Part) -> Result<(), BusError> {
        let incarnation = gate.incarnation(part) + 1;
        let boards = self.create_boards(node, part, incarnation)?;
        // Announce a number only when its boards exist, so that nobody waits for them.
        gate.set_incarnation(part, incarnation);
        // The old boards are dropped here. Their services stay as long as a reader has them open.
        self.boards.insert(part, boards);
        Ok(())
    }

    fn create_world_boards(
        &self,
        node: &Node<ipc::Service>,
        incarnation: u32,
    ) -> Result<Vec<BoardFactory>, BusError> {
        let old = |index: usize| self.boards.get(&Part::World)?.get(index);
        let (uavs, pace) = (UavId::all(self.uavs), self.pace);
        let sensed = uavs.clone().map(|uav| {
            let obstacles = near_obstacles(uav, pace);
            own_senses(uav, pace).create_with(&obstacles, node, incarnation, old(uav.index()))
        });
        let first = self.uavs as usize;
        let filtering = uavs.filter(|_| self.has_traffic);
        let traffic =
            filtering.map(|uav| traffic(uav, pace).create(node, incarnation, old(first + uav.index())));
        sensed.chain(traffic).collect()
    }

    fn create_boards(
        &self,
        node: &Node<ipc::Service>,
        part: Part,
        incarnation: u32,
    ) -> Result<Vec<BoardFactory>, BusError> {
        let pace = self.pace;
        // A predecessor's board is found by its place in the list, so the order below is the same for every
        // incarnation.
        let old = |index: usize| self.boards.get(&part)?.get(index);
        match part {
            Part::World => self.create_world_boards(node, incarnation),
            Part::Leader => Ok(vec![leader(self.uavs, pace).create(node, incarnation, old(0))?]),
            Part::Agent(uav) => {
                let account = account(uav, pace);
                Ok(vec![
                    state(uav, pace).create(node, incarnation, old(0))?,
                    command(uav, pace).create_with(&account, node, incarnation, old(1))?,
                ])
            }
            Part::Recorder => Ok(Vec::new()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Stamps, create_node, domain::DomainOwner};

    #[test]
    fn a_newcomer_gets_the_last_roster() {
        let (owner, _gate) = DomainOwner::create("").unwrap();
        let node = create_node(owner.domain(), "test").unwrap();
        let mut scenario = Scenario::default();
        scenario.formation.uavs = 3;
        let _services = Services::create(&node, owner.domain(), &scenario, 8).unwrap();
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
