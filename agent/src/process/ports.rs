//! An agent's ends of the run's services.
//!
//! Never decides anything about the flight: it moves samples between the services and the [`UavAgent`].

use crate::{
    UavAgent,
    pilot::Steer,
    reception::{Inputs, Take},
    uav_agent::Answer,
};
use ringwing_bus::{
    Ballast, BoardReader, BoardWriter, BusError, Gate, Member, Publisher, SensesReader, Stamps, monotonic_ns,
    services,
};
use ringwing_flight::{
    Account, Command, LeaderState, LinkCounts, Notes, Pace, Sensed, Tick, Traffic, UavId, UavState,
};
use std::{
    hint::black_box,
    io::{Write, stderr},
    ops::RangeInclusive,
};

/// An agent's ends of the services.
pub(super) struct AgentPorts<'m> {
    member: &'m Member,
    inputs: InputPorts<'m>,
    state: BoardWriter<UavState>,
    command: BoardWriter<Command>,
    account: BoardWriter<Account>,
    /// Opened for the first counts: most runs have no link faults.
    link_counts: Option<Publisher<LinkCounts>>,
    notes: NotesPort,
    /// Bytes that benchmarks carry besides the messages.
    ballast: Option<Ballast>,
    uavs: u32,
    /// How long it took to send the last answer.
    sending_ns: u64,
}

/// Where notes for the log go.
enum NotesPort {
    /// Opened for the first notes: most controllers make none.
    Closed,
    Open(Publisher<Notes>),
    /// The run has no service for them.
    Missing,
}

/// The receiving ends.
struct InputPorts<'m> {
    member: &'m Member,
    pace: Pace,
    sensed: SensesReader,
    /// `None` without a collision filter.
    traffic: Option<BoardReader<Traffic>>,
    /// One for each UAV that is listened to.
    states: Vec<(UavId, BoardReader<UavState>)>,
    leader: BoardReader<LeaderState>,
}

impl<'m> AgentPorts<'m> {
    /// Opens all ports of `agent`, the agent of `uav`.
    pub(super) fn open<S: Steer>(
        member: &'m Member,
        uav: UavId,
        agent: &UavAgent<S>,
    ) -> Result<Self, BusError> {
        let (boards, scenario) = (member.boards(), member.scenario());
        let (uavs, pace) = (scenario.formation.uavs, scenario.pace());
        let ballast_bytes = scenario.ipc.payload_bytes;
        let ballast = || Ballast::of_agent(member.node(), uav, ballast_bytes);
        let command = services::command(uav, pace).writer(boards)?;
        Ok(Self {
            member,
            inputs: InputPorts::open(member, uav, uavs, agent.listened())?,
            state: services::state(uav, pace).writer(boards)?,
            account: command.beside(&services::account(uav, pace))?,
            command,
            link_counts: None,
            notes: NotesPort::Closed,
            ballast: (ballast_bytes > 0).then(ballast).transpose()?,
            uavs,
            sending_ns: 0,
        })
    }

    /// Lets `agent` receive what it can use in `now`.
    pub(super) fn receive<S: Steer>(&mut self, agent: &mut UavAgent<S>, now: Tick) -> Result<(), BusError> {
        agent.receive(now, &mut self.inputs)?;
        if let Some(ballast) = &self.ballast {
            ballast.receive()?;
        }
        Ok(())
    }

    /// Flies `next` with a copy of `agent` and what is there of its inputs, and forgets the outcome. After a wait the
    /// caches are cold: then a first read takes ten times as long, and the law too.
    pub(super) fn rehearse<S: Steer>(&mut self, agent: &UavAgent<S>, next: Tick) {
        let mut rehearsal = agent.rehearsal();
        // An input that cannot be read is an error in the tick itself, and reported there.
        let _ = rehearsal.receive(next, &mut self.inputs);
        black_box(rehearsal.fly(next));
    }

    /// Opens and closes inputs, so that exactly the UAVs that `agent` now listens to are open.
    pub(super) fn update_inputs<S: Steer>(&mut self, agent: &mut UavAgent<S>) -> Result<(), BusError> {
        agent.update_inputs(&mut self.inputs)
    }

    /// Sends the answer to `now`. The agent woke at `woke_ns` and had read its inputs at `read_ns`.
    pub(super) fn send(
        &mut self,
        answer: &Answer,
        gate: &Gate,
        now: Tick,
        woke_ns: u64,
        read_ns: u64,
    ) -> Result<(), BusError> {
        let sent_ns = monotonic_ns();
        let stamps = Stamps { woke_ns, read_ns, sent_ns, sending_ns: self.sending_ns };
        if let Some(ballast) = &self.ballast {
            ballast.send(now)?;
        }
        if let Some(state) = answer.state {
            self.state.post(now, state, stamps);
        }
        // The command comes last, because the world takes it for the answer to the tick, and with it the account. An
        // account that nobody records would only cost time.
        if let Some(account) = answer.account.filter(|_| gate.records()) {
            self.account.post(now, account, stamps);
        }
        self.command.post(now, answer.command, stamps);
        self.sending_ns = monotonic_ns() - sent_ns;
        Ok(())
    }

    /// Sends what the controller has noted, if somebody records.
    ///
    /// To be called before the answer: whatever belongs to a tick in the log is sent before the tick can end.
    pub(super) fn send_notes(&mut self, notes: &Notes, gate: &Gate) -> Result<(), BusError> {
        if !gate.records() {
            return Ok(());
        }
        if let NotesPort::Closed = self.notes {
            self.notes = self.open_notes()?;
        }
        match &self.notes {
            NotesPort::Open(port) => port.send(*notes, Stamps::now()),
            NotesPort::Closed | NotesPort::Missing => Ok(()),
        }
    }

    fn open_notes(&self) -> Result<NotesPort, BusError> {
        if services::has_notes(self.member.scenario()) {
            return Ok(NotesPort::Open(services::notes(self.uavs).publisher(self.member.node())?));
        }
        // Only a program that was started by hand in the place of the built-in agent comes here. Nobody may read the message.
        let _ = writeln!(
            stderr(),
            "warning: the notes of this controller are not recorded: name its program with --agent or [[agents]] when the \
             run starts"
        );
        Ok(NotesPort::Missing)
    }

    /// Sends the counts of links with faults.
    pub(super) fn send_link_counts(&mut self, all: &[LinkCounts]) -> Result<(), BusError> {
        for counts in all {
            if self.link_counts.is_none() {
                self.link_counts = Some(services::links(self.uavs).publisher(self.member.node())?);
            }
            if let Some(port) = &self.link_counts {
                port.send(*counts, Stamps::now())?;
            }
        }
        Ok(())
    }
}

impl<'m> InputPorts<'m> {
    fn open(member: &'m Member, uav: UavId, uavs: u32, listened: &[UavId]) -> Result<Self, BusError> {
        let (boards, scenario) = (member.boards(), member.scenario());
        let pace = scenario.pace();
        let traffic = || services::traffic(uav, pace).reader(boards);
        let state = |other: &UavId| Ok((*other, services::state(*other, pace).reader(boards)?));
        Ok(Self {
            member,
            pace,
            sensed: SensesReader::open(boards, uav, pace)?,
            traffic: scenario.control.collision_filter.then(traffic).transpose()?,
            states: listened.iter().map(state).collect::<Result<_, BusError>>()?,
            leader: services::leader(uavs, pace).reader(boards)?,
        })
    }
}

impl Inputs for InputPorts<'_> {
    type Error = BusError;

    fn sensed(&mut self, ticks: RangeInclusive<Tick>, take: &mut Take<Sensed>) -> Result<(), BusError> {
        self.sensed.read(ticks, take);
        Ok(())
    }

    fn traffic(&mut self, ticks: RangeInclusive<Tick>, take: &mut Take<Traffic>) -> Result<(), BusError> {
        let Some(port) = &mut self.traffic else { return Ok(()) };
        port.read_newest(self.member.boards(), ticks, |sample, _| take(sample)).map(drop)
    }

    fn state(
        &mut self,
        from: UavId,
        ticks: RangeInclusive<Tick>,
        take: &mut Take<UavState>,
    ) -> Result<(), BusError> {
        let Some((_, port)) = self.states.iter_mut().find(|(uav, _)| *uav == from) else { return Ok(()) };
        port.read_newest(self.member.boards(), ticks, |sample, _| take(sample)).map(drop)
    }

    fn leader(&mut self, ticks: RangeInclusive<Tick>, take: &mut Take<LeaderState>) -> Result<(), BusError> {
        self.leader.read_newest(self.member.boards(), ticks, |sample, _| take(sample)).map(drop)
    }

    fn open_state(&mut self, from: UavId) -> Result<(), BusError> {
        let port = services::state(from, self.pace).reader(self.member.boards())?;
        self.states.push((from, port));
        Ok(())
    }

    fn close_state(&mut self, from: UavId) {
        self.states.retain(|(uav, _)| *uav != from);
    }
}
