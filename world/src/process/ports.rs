//! Everything that connects the world to the rest of its run: services, the tick gate, stop requests.
//!
//! Never decides when to send or what to wait for.

use super::journal::Journal;
use ringwing_bus::{
    Ballast, BoardAccess, BoardReader, BoardWriter, BusError, Due, Gate, Member, Publisher, SensesWriter,
    Stamps, StopFlag, Subscriber, Waker, failed_connections, services,
};
use ringwing_flight::{
    Account, Command, Event, EventMessage, LeaderState, Pace, Part, Roster, Tick, TimedEvent, Traffic, UavId,
};
use std::time::Duration;

/// The world's ends of the services, and its place at the gate.
pub(super) struct Ports<'m> {
    member: &'m Member,
    /// One of each UAV, UAV 1 first.
    pub(super) sensed: Vec<SensesWriter>,
    /// One of each UAV if they have collision filters, else empty.
    pub(super) traffic: Vec<BoardWriter<Traffic>>,
    /// One of each UAV, UAV 1 first.
    agents: Vec<AgentBoards>,
    leader: LeaderBoard,
    pub(super) journal: Journal,
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

/// What the world reads of one agent.
struct AgentBoards {
    uav: UavId,
    pace: Pace,
    commands: BoardReader<Command>,
    accounts: BoardReader<Account>,
    /// The first tick whose command was not read yet.
    next_command: Tick,
    /// The first tick whose account was not read yet.
    next_account: Tick,
}

/// What the world reads of the leader.
struct LeaderBoard {
    states: BoardReader<LeaderState>,
    /// The first tick whose state was not read yet.
    next: Tick,
}

impl<'m> Ports<'m> {
    /// Opens everything, then says that the world is ready.
    pub(super) fn open(member: &'m Member) -> Result<Self, BusError> {
        let (scenario, node, boards) = (member.scenario(), member.node(), member.boards());
        let (uavs, pace) = (UavId::all(scenario.formation.uavs), scenario.pace());
        let ballast_bytes = scenario.ipc.payload_bytes;
        let loaded = uavs.clone().filter(|_| ballast_bytes > 0);
        let filtering = uavs.clone().filter(|_| scenario.control.collision_filter);
        Ok(Self {
            member,
            sensed: uavs
                .clone()
                .map(|uav| SensesWriter::open(boards, uav, pace))
                .collect::<Result<_, _>>()?,
            traffic: filtering
                .map(|uav| services::traffic(uav, pace).writer(boards))
                .collect::<Result<_, _>>()?,
            agents: uavs.map(|uav| AgentBoards::open(boards, uav, pace)).collect::<Result<_, _>>()?,
            leader: LeaderBoard {
                states: services::leader(scenario.formation.uavs, pace).reader(boards)?,
                next: Tick::APPROACH,
            },
            journal: Journal::open(member)?,
            ballast: loaded
                .map(|uav| Ballast::of_world(node, uav, ballast_bytes))
                .collect::<Result<_, _>>()?,
            roster: services::roster().subscriber(node, services::TICK_DEPTH)?,
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

    /// Begins the journal's page of `tick`, and tells the agents whether they have to account for their commands.
    pub(super) fn begin_journal(&mut self, tick: Tick) {
        // Asked once a tick: a recorder that comes in the middle would get the accounts of only some agents.
        let is_recorded = self.gate.ready_process(Part::Recorder).is_some();
        self.journal.begin(tick, is_recorded);
        self.gate.set_records(is_recorded);
    }

    /// Hands over the commands of `uav`'s agent that were not read yet, up to that of `now`, oldest first, and copies
    /// the account of the newest into the journal.
    pub(super) fn read_commands(
        &mut self,
        uav: UavId,
        now: Tick,
        take: impl FnMut(&Command, &Stamps),
    ) -> Result<(), BusError> {
        let agent = &mut self.agents[uav.index()];
        agent.read_commands(self.member.boards(), now, take)?;
        // Without a recorder the agents write no accounts, and even a look at the empty entries would cost time.
        if self.journal.is_wanted() {
            let journal = &mut self.journal;
            agent.read_accounts(now, |account| journal.note_account(uav, account));
        }
        Ok(())
    }

    /// The leader's newest state up to that of `now`, if it was not read yet. The journal gets a copy.
    pub(super) fn read_leader(&mut self, now: Tick) -> Result<Option<Tick>, BusError> {
        let (LeaderBoard { states, next }, journal) = (&mut self.leader, &mut self.journal);
        let mut newest = None;
        if *next <= now {
            states.read_newest(self.member.boards(), *next..=now, |state, _| {
                journal.note_leader(state);
                newest = Some(state.tick);
            })?;
        }
        if let Some(Tick(tick)) = newest {
            *next = Tick(tick + 1);
        }
        Ok(newest)
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

    /// Waits until the tick is `due`, or until the run is to end. Calls `rehearse` shortly before, while there is time.
    pub(super) fn wait_until(&mut self, due: Due, rehearse: impl FnMut()) -> Result<(), BusError> {
        let (gate, stop) = (&self.gate, &self.stop);
        self.waker.wait_until(due, || is_stopped(gate, stop), rehearse);
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
        // Note the count that was read before the rosters: a nudge that comes meanwhile is then noticed the next time.
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

impl AgentBoards {
    fn open(boards: BoardAccess, uav: UavId, pace: Pace) -> Result<Self, BusError> {
        let commands = services::command(uav, pace).reader(boards)?;
        // Commands and accounts share a service, so one connection serves both.
        let accounts = commands.beside(&services::account(uav, pace))?;
        let first = Tick::APPROACH;
        Ok(Self { uav, pace, commands, accounts, next_command: first, next_account: first })
    }

    fn read_commands(
        &mut self,
        boards: BoardAccess,
        now: Tick,
        mut take: impl FnMut(&Command, &Stamps),
    ) -> Result<(), BusError> {
        let Self { commands, next_command, .. } = self;
        // The command of `now` was read already. Looking again would make the reader search for a newer incarnation.
        if *next_command > now {
            return Ok(());
        }
        let ticks = *next_command..=now;
        let take = |command: &Command, stamps: &Stamps| {
            *next_command = Tick(command.tick.0 + 1);
            take(command, stamps);
        };
        if commands.read_newest(boards, ticks, take)? {
            // The commands have moved on to a new incarnation's service. On the old one no account comes any more.
            self.accounts = self.commands.beside(&services::account(self.uav, self.pace))?;
        }
        Ok(())
    }

    fn read_accounts(&mut self, now: Tick, mut take: impl FnMut(&Account)) {
        let Self { accounts, next_account, .. } = self;
        if *next_account <= now {
            accounts.read(*next_account..=now, |account, _| {
                *next_account = Tick(account.tick.0 + 1);
                take(account);
            });
        }
    }
}

fn is_stopped(gate: &Gate, stop: &StopFlag) -> bool {
    gate.stop_requested() || gate.is_closed() || stop.is_set()
}
