//! The flight itself, tick by tick.

use crate::{
    SimulationError, check,
    inputs::{AgentInputs, Air},
    own_program,
    seat_agent::SeatAgent,
};
use ringwing_agent::controller::MakeController;
use ringwing_flight::{
    Account, Event, LeaderState, LinkCounts, Notes, Part, ProcessAction, ProcessState, Reporter, Sensed,
    Tick, TimedEvent, Truth, UavId, WorldReport,
};
use ringwing_leader::Path;
use ringwing_scenario::{
    Scenario,
    fault::schedule::{LinkFault, ScheduledAction},
    start,
};
use ringwing_world::{Airspace, Sensing, Sky};
use std::collections::VecDeque;

/// One UAV's agent, and whether its process runs.
struct Seat {
    agent: SeatAgent,
    state: ProcessState,
    /// The last tick that it answered, or that it has no part in.
    answered: Tick,
}

/// A process that an agent does not fly: whether it runs, and how far it has come.
#[derive(Debug, Clone, Copy)]
struct Station {
    state: ProcessState,
    answered: Tick,
}

/// A flight in one process. It starts at the approach, one tick before tick 0.
pub struct Simulation {
    scenario: Scenario,
    airspace: Airspace,
    path: Path,
    air: Air,
    seats: Vec<Seat>,
    /// Makes the controllers of the user's.
    make_controller: MakeController,
    leader: Station,
    recorder: ProcessState,
    /// A fault has ended the world.
    is_world_ended: bool,
    /// The tick flown last.
    flown: Option<Tick>,
    actions: VecDeque<ScheduledAction>,
    announcements: VecDeque<TimedEvent>,
    link_faults: Vec<LinkFault>,
    /// Each UAV's account of the tick flown last; `None` where no agent answered with a command.
    accounts: Vec<Option<Account>>,
    /// Each UAV's senses in the tick flown last; `None` for one that has left the sky.
    sensed: Vec<Option<Sensed>>,
    /// The velocity of the air at each UAV in the tick flown last.
    truths: Vec<Truth>,
    links: Vec<LinkCounts>,
    /// What controllers noted in the tick flown last.
    notes: Vec<Notes>,
    /// What happened in the last step.
    events: Vec<TimedEvent>,
    /// What was applied by hand since.
    pending: Vec<TimedEvent>,
}

impl Simulation {
    /// The flight of `scenario`, which has been validated, before its first tick, with the built-in law.
    pub fn new(scenario: &Scenario) -> Result<Self, SimulationError> {
        Self::with_controllers(scenario, Box::new(|_| None))
    }

    /// The flight of `scenario`, which has been validated, before its first tick. The UAVs for which `make_controller` returns a
    /// controller fly with it; whether the scenario names a program for them does not matter then.
    pub fn with_controllers(
        scenario: &Scenario,
        make_controller: MakeController,
    ) -> Result<Self, SimulationError> {
        check(scenario)?;
        let starts = start::states(scenario)?;
        let uavs = scenario.formation.uavs;
        let schedule = scenario.schedule();
        let mut simulation = Self {
            airspace: Airspace::new(scenario, &starts),
            path: Path::new(scenario),
            air: Air::new(uavs),
            seats: Vec::with_capacity(uavs as usize),
            make_controller,
            // It has answered nothing yet, so the approach is its first tick.
            leader: Station { state: ProcessState::Running, answered: Tick(Tick::APPROACH.0 - 1) },
            recorder: ProcessState::Running,
            is_world_ended: false,
            flown: None,
            actions: schedule.scheduled_actions().into(),
            announcements: schedule.announcements().into(),
            link_faults: schedule.link_faults(),
            accounts: vec![None; uavs as usize],
            sensed: vec![None; uavs as usize],
            truths: vec![Truth::default(); uavs as usize],
            links: Vec::new(),
            notes: Vec::new(),
            events: Vec::new(),
            pending: Vec::new(),
            scenario: scenario.clone(),
        };
        // A newcomer needs the present tick and the link faults, so the seats are filled last.
        simulation.seats = UavId::all(uavs).map(|uav| simulation.newcomer(uav)).collect();
        simulation.refuse_programs()?;
        Ok(simulation)
    }

    /// Refuses a scenario in which a program of the user's flies a UAV that has no controller here.
    fn refuse_programs(&self) -> Result<(), SimulationError> {
        for (uav, seat) in UavId::all(self.seats.len() as u32).zip(&self.seats) {
            if let Some(agent) = self.scenario.agent_of(uav).filter(|_| seat.agent.is_built_in()) {
                return Err(own_program(&self.scenario, uav, agent));
            }
        }
        Ok(())
    }

    /// The scenario that is flown.
    pub fn scenario(&self) -> &Scenario {
        &self.scenario
    }

    /// The next tick to fly.
    pub fn now(&self) -> Tick {
        self.airspace.now()
    }

    /// The tick flown last; `None` before the first one.
    pub fn flown(&self) -> Option<Tick> {
        self.flown
    }

    /// The airframes and obstacles, at [`now`](Self::now).
    pub fn sky(&self) -> &Sky {
        self.airspace.sky()
    }

    /// Where the leader's path is at [`now`](Self::now), whether or not a leader flies it.
    pub fn leader(&self) -> LeaderState {
        self.path.at(self.now())
    }

    /// Whether UAV `uav`'s agent runs.
    pub fn runs(&self, uav: UavId) -> bool {
        self.seats[uav.index()].state == ProcessState::Running
    }

    /// Whether a fault has ended the world, and the flight with it.
    pub fn is_world_ended(&self) -> bool {
        self.is_world_ended
    }

    /// The account of `uav`'s agent in the tick flown last; `None` if it gave no command.
    pub fn account(&self, uav: UavId) -> Option<&Account> {
        self.accounts[uav.index()].as_ref()
    }

    /// What `uav` sensed in the tick flown last; `None` once it has left the sky.
    pub fn sensed(&self, uav: UavId) -> Option<&Sensed> {
        self.sensed[uav.index()].as_ref()
    }

    /// How `uav` truly flew in the tick flown last; of a UAV that has left the sky, when it was seen last.
    pub fn truth(&self, uav: UavId) -> &Truth {
        &self.truths[uav.index()]
    }

    /// What the leader sent in the tick flown last; `None` if there was none, or it was frozen.
    pub fn led(&self) -> Option<&LeaderState> {
        self.air.leader.newest().filter(|state| Some(state.tick) == self.flown)
    }

    /// What became of the samples on links with faults, as reported in the tick flown last.
    pub fn links(&self) -> &[LinkCounts] {
        &self.links
    }

    /// What controllers noted in the tick flown last, of each UAV with any notes.
    pub fn notes(&self) -> &[Notes] {
        &self.notes
    }

    /// What happened in the last step. First what was [applied](Self::apply) before it; then, of the tick after the one
    /// flown, the faults announced for it, what the world saw on the way to it, and what was done to processes.
    pub fn events(&self) -> &[TimedEvent] {
        &self.events
    }

    /// The world's report of the flight so far; nothing in it depends on a wall clock.
    pub fn report(&self) -> WorldReport {
        self.airspace.report()
    }

    /// Flies the next tick: lets every running process answer it, moves the airframes on unless it was the last one,
    /// and then does to processes what is due before the tick after it. Returns whether there is one.
    ///
    /// The actions come at the end, and not at the beginning, because an agent that is thawed there still answers the
    /// tick just flown: only then is that tick complete.
    pub fn step(&mut self) -> bool {
        self.events.clear();
        self.events.append(&mut self.pending);
        if self.is_world_ended {
            return false;
        }
        let now = self.now();
        self.flown = Some(now);
        self.publish_sensed();
        self.lead(now);
        self.answer_all(now);
        self.airspace.end_tick();
        if self.airspace.is_over() {
            return false;
        }
        let seen = self.airspace.step();
        self.prepare_tick(self.now(), seen);
        !self.is_world_ended
    }

    /// Does what comes before `tick` opens, and collects its events: the faults announced for it, what the world has
    /// `seen` on the way, and what is done to processes.
    fn prepare_tick(&mut self, tick: Tick, seen: Vec<Event>) {
        // In the order of `Reporter`, in which a run of processes logs the events of one tick.
        while self.announcements.front().is_some_and(|announced| announced.tick <= tick) {
            self.events.extend(self.announcements.pop_front());
        }
        self.events.extend(seen.into_iter().map(|event| TimedEvent { tick, event }));
        while self.actions.front().is_some_and(|action| action.tick <= tick) {
            let Some(due) = self.actions.pop_front() else { break };
            let event = self.act(due.part, due.action, due.sentence);
            self.events.push(event);
        }
        if self.is_world_ended {
            // The tick never opens, so the link faults announced for it never begin.
            self.events.retain(|timed| timed.tick < tick || timed.event.reporter() != Reporter::Schedule);
        }
    }

    /// Does `action` to `part` before the next tick, after what the schedule has for that tick.
    ///
    /// A refused action, such as killing a process that is gone, changes nothing but the events. An agent that is thawed
    /// answers the tick flown last, too late for whoever has measured that tick already.
    pub fn apply(&mut self, part: Part, action: ProcessAction) {
        let event = self.act(part, action, format!("{action:?} {part}"));
        self.pending.push(event);
    }

    fn act(&mut self, part: Part, action: ProcessAction, sentence: String) -> TimedEvent {
        let event = match self.try_act(part, action) {
            Ok(()) => Event::ProcessFault { part, action, sentence },
            Err(why) => Event::FaultRefused { part: Some(part), why: why.into(), sentence },
        };
        TimedEvent { tick: self.now(), event }
    }

    fn try_act(&mut self, part: Part, action: ProcessAction) -> Result<(), &'static str> {
        match part {
            // Faults can only kill or stop the world, and either ends the flight.
            Part::World => self.is_world_ended = true,
            Part::Recorder => {
                let after = self.recorder.after(action)?;
                // A recorder that is to stay away is started again by its own fault; any other is replaced at once.
                let is_replaced =
                    matches!(action, ProcessAction::Kill { returns: false } | ProcessAction::Stop);
                self.recorder = if is_replaced { ProcessState::Running } else { after };
            }
            Part::Leader => {
                self.leader.state = self.leader.state.after(action)?;
                match action {
                    // A new leader has no part in the tick that is over. A thawed one still owes its answer to that
                    // tick.
                    ProcessAction::Start => self.leader.answered = before(self.now()),
                    ProcessAction::Thaw => self.lead(before(self.now())),
                    _ => {}
                }
            }
            Part::Agent(uav) => self.act_on_agent(uav, action)?,
        }
        Ok(())
    }

    fn act_on_agent(&mut self, uav: UavId, action: ProcessAction) -> Result<(), &'static str> {
        let seat = &mut self.seats[uav.index()];
        seat.state = seat.state.after(action)?;
        match action {
            // A new agent remembers nothing of the old one. A thawed one still answers the tick just flown.
            ProcessAction::Start => {
                let newcomer = self.newcomer(uav);
                self.seats[uav.index()] = newcomer;
            }
            ProcessAction::Thaw => self.answer(uav, before(self.now())),
            _ => {}
        }
        Ok(())
    }

    /// An agent that starts now: its first tick is the next one.
    fn newcomer(&mut self, uav: UavId) -> Seat {
        let controller = (self.make_controller)(uav);
        let mut agent = SeatAgent::new(&self.scenario, uav, controller);
        agent.set_faults(&self.link_faults);
        Seat { agent, state: ProcessState::Running, answered: before(self.now()) }
    }

    fn publish_sensed(&mut self) {
        self.sensed.fill(None);
        let Self { airspace, air, sensed: last, truths, .. } = self;
        airspace.open_tick(|Sensing { sensed, traffic, truth }| {
            let index = sensed.uav.index();
            if let Some(traffic) = traffic {
                air.traffic[index].push(*traffic);
            }
            air.sensed[index].push(*sensed);
            last[index] = Some(*sensed);
            truths[index] = *truth;
        });
    }

    /// Lets the leader answer `tick`, if it runs and has not answered it yet.
    fn lead(&mut self, tick: Tick) {
        if self.leader.state == ProcessState::Running && self.leader.answered < tick {
            self.leader.answered = tick;
            self.air.leader.push(self.path.at(tick));
        }
    }

    fn answer_all(&mut self, now: Tick) {
        // Cleared here and not in `answer`: an agent that is thawed later in the step adds to the same tick.
        self.links.clear();
        self.notes.clear();
        self.accounts.fill(None);
        for uav in UavId::all(self.seats.len() as u32) {
            self.answer(uav, now);
        }
    }

    /// Lets the agent of `uav` answer `tick`, if it runs and has not answered it yet.
    fn answer(&mut self, uav: UavId, tick: Tick) {
        let Self { seats, air, links, notes, .. } = self;
        let seat = &mut seats[uav.index()];
        if seat.state != ProcessState::Running || seat.answered >= tick {
            return;
        }
        seat.answered = tick;
        let mut inputs = AgentInputs { uav, air };
        let Ok(()) = seat.agent.receive(tick, &mut inputs);
        links.extend(seat.agent.link_counts(tick));
        let answer = seat.agent.fly(tick);
        notes.extend(seat.agent.notes(tick));
        let Ok(()) = seat.agent.update_inputs(&mut inputs);
        seat.agent.plan_ahead();
        if let Some(state) = answer.state {
            // The others use it from the next tick on, so it does not matter in which order the agents answer.
            air.states[uav.index()].push(state);
        }
        self.accounts[uav.index()] = answer.account;
        // The airframe checks for itself what it takes; a refusal is counted.
        let _ = self.airspace.take(uav, &answer.command);
    }
}

fn before(tick: Tick) -> Tick {
    Tick(tick.0 - 1)
}
