//! Who has answered the open tick, and who is worth waiting for.
//!
//! The truth is in the samples: an agent has answered a tick when a command of that tick has come from it. The leader has
//! answered when it has told everybody.

use ringwing_bus::Stamps;
use ringwing_flight::{Command, FlightMode, Part, Roster, Tick, TickTiming, UavId};

/// The answers to one tick.
#[derive(Debug)]
pub(crate) struct Answers {
    tick: Tick,
    opened_ns: u64,
    roster: Roster,
    agents: Vec<Agent>,
    leader_answered: bool,
    leader_silent: bool,
    timing: TickTiming,
}

#[derive(Debug, Clone, Copy)]
struct Agent {
    /// The command of this tick, once it is here.
    answer: Option<Command>,
    /// Was given up waiting for, and has not answered since.
    silent: bool,
    /// Was on the roster, and in the sky, when the tick was opened.
    called: bool,
    /// Flies its airframe, which needs a command.
    commanded: bool,
}

impl Answers {
    pub(crate) fn new(uavs: u32) -> Self {
        Self {
            tick: Tick::APPROACH,
            opened_ns: 0,
            roster: Roster::empty(),
            agents: vec![
                Agent { answer: None, silent: false, called: false, commanded: true };
                uavs as usize
            ],
            leader_answered: false,
            leader_silent: false,
            timing: TickTiming::default(),
        }
    }

    pub(crate) fn roster(&self) -> &Roster {
        &self.roster
    }

    /// Takes in who runs. Whoever is new is worth waiting for again.
    pub(crate) fn set_roster(&mut self, roster: &Roster) {
        for (uav, agent) in UavId::all(self.agents.len() as u32).zip(&mut self.agents) {
            agent.silent &= self.roster.has(uav) || !roster.has(uav);
        }
        self.leader_silent &= self.roster.has_leader() || !roster.has_leader();
        self.roster = *roster;
    }

    /// Begins `tick`, opened at `opened_ns`, with the UAVs in the `modes` given, UAV 1 first.
    pub(crate) fn begin(&mut self, tick: Tick, opened_ns: u64, modes: impl Iterator<Item = FlightMode>) {
        (self.tick, self.opened_ns, self.leader_answered) = (tick, opened_ns, false);
        self.timing = TickTiming { tick: tick.0, ..TickTiming::default() };
        for ((uav, agent), mode) in UavId::all(self.agents.len() as u32).zip(&mut self.agents).zip(modes) {
            agent.answer = None;
            agent.called = mode != FlightMode::VANISHED && self.roster.has(uav);
            agent.commanded = mode == FlightMode::COMMANDED;
        }
    }

    /// How many answers to wait for.
    pub(crate) fn expected(&self) -> u32 {
        let agents = UavId::all(self.agents.len() as u32).filter(|uav| self.expects(*uav)).count();
        agents as u32 + u32::from(self.expects_leader())
    }

    fn expects(&self, uav: UavId) -> bool {
        let agent = &self.agents[uav.index()];
        agent.called && !agent.silent && self.roster.has(uav)
    }

    /// A leader that is being replaced is waited for too: the new one answers the tick that the old one left open.
    fn expects_leader(&self) -> bool {
        (self.roster.has_leader() || self.roster.holds()) && !self.leader_silent
    }

    /// Everybody who is waited for.
    pub(crate) fn missing(&self) -> impl Iterator<Item = Part> {
        let agents = UavId::all(self.agents.len() as u32)
            .filter(|uav| self.expects(*uav) && self.agents[uav.index()].answer.is_none())
            .map(Part::Agent);
        agents.chain((self.expects_leader() && !self.leader_answered).then_some(Part::Leader))
    }

    /// Everybody who was thawed and has not answered the tick that was open meanwhile.
    pub(crate) fn owing(&self) -> impl Iterator<Item = Part> {
        let owes = |uav: &UavId| {
            self.roster.has(*uav) && self.roster.is_thawed(*uav) && self.agents[uav.index()].answer.is_none()
        };
        let agents = UavId::all(self.agents.len() as u32).filter(owes).map(Part::Agent);
        let leader = self.roster.has_leader() && self.roster.is_leader_thawed() && !self.leader_answered;
        agents.chain(leader.then_some(Part::Leader))
    }

    /// Notes `command`, which came with `stamps` and was read at `read_ns`.
    ///
    /// A round trip ends where the answer is handed over: when the world reads it is the world's own choice in real time.
    pub(crate) fn note(&mut self, command: &Command, stamps: &Stamps, read_ns: u64) {
        if command.tick != self.tick {
            return;
        }
        let agent = &mut self.agents[command.uav.index()];
        (agent.answer, agent.silent) = (Some(*command), false);
        let longest = |so_far: &mut u64, from: u64, to: u64| *so_far = (*so_far).max(to.saturating_sub(from));
        longest(&mut self.timing.wake_ns, self.opened_ns, stamps.woke_ns);
        longest(&mut self.timing.read_ns, stamps.woke_ns, stamps.read_ns);
        longest(&mut self.timing.compute_ns, stamps.read_ns, stamps.sent_ns);
        longest(&mut self.timing.return_ns, stamps.sent_ns, read_ns);
        longest(&mut self.timing.round_trip_ns, self.opened_ns, stamps.sent_ns);
        self.timing.answered += 1;
    }

    /// Notes that the leader has told everybody where it is at `tick`.
    pub(crate) fn note_leader(&mut self, tick: Option<Tick>) {
        if tick == Some(self.tick) {
            (self.leader_answered, self.leader_silent) = (true, false);
        }
    }

    /// Waits no longer for those that are missing, until they answer again; returns who they are.
    pub(crate) fn give_up(&mut self) -> Vec<Part> {
        let missing: Vec<Part> = self.missing().collect();
        for part in &missing {
            match part {
                Part::Agent(uav) => self.agents[uav.index()].silent = true,
                _ => self.leader_silent = true,
            }
        }
        missing
    }

    /// The commands that answered this tick, UAV 1's first: an order that chance has no part in.
    pub(crate) fn commands(&self) -> impl Iterator<Item = &Command> {
        self.agents.iter().filter_map(|agent| agent.answer.as_ref())
    }

    /// How long the tick took; commanded airframes without an answer fly on an older command.
    pub(crate) fn timing(&self) -> TickTiming {
        let reused = self.agents.iter().filter(|agent| agent.commanded && agent.answer.is_none()).count();
        TickTiming { reused: reused as u32, ..self.timing }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn command(uav: u32, tick: i64) -> Command {
        Command { tick: Tick(tick), speed_m_s: 15.0, turn_rate_rad_s: 0.0, uav: UavId(uav), withheld: 0 }
    }

    const ALL_COMMANDED: [FlightMode; 3] = [FlightMode::COMMANDED; 3];

    fn with_everybody() -> Answers {
        let mut roster = Roster::empty();
        roster.set_leader(true);
        UavId::all(3).for_each(|uav| roster.set(uav, true));
        let mut answers = Answers::new(3);
        answers.set_roster(&roster);
        answers.begin(Tick(5), 100, ALL_COMMANDED.into_iter());
        answers
    }

    fn missing(answers: &Answers) -> String {
        answers.missing().map(|part| part.to_string()).collect::<Vec<_>>().join(", ")
    }

    #[test]
    fn an_answer_to_another_tick_is_none() {
        let mut answers = with_everybody();
        answers.note(&command(1, 4), &Stamps::default(), 200);
        answers.note(&command(2, 5), &Stamps::default(), 200);
        answers.note_leader(Some(Tick(4)));
        assert_eq!(missing(&answers), "uav 1, uav 3, leader");
        answers.note_leader(Some(Tick(5)));
        assert_eq!(missing(&answers), "uav 1, uav 3");
    }

    #[test]
    fn whoever_is_gone_is_not_waited_for() {
        let mut answers = with_everybody();
        let mut roster = *answers.roster();
        roster.set(UavId(1), false);
        answers.set_roster(&roster);
        let vanished = [FlightMode::COMMANDED, FlightMode::VANISHED, FlightMode::COMMANDED];
        answers.begin(Tick(6), 100, vanished.into_iter());
        assert_eq!(missing(&answers), "uav 3, leader");
        assert_eq!(answers.expected(), 2);
    }

    #[test]
    fn whoever_was_given_up_is_waited_for_again_once_it_answers() {
        let mut answers = with_everybody();
        answers.note_leader(Some(Tick(5)));
        assert_eq!(answers.give_up().len(), 3);
        answers.begin(Tick(6), 100, ALL_COMMANDED.into_iter());
        assert_eq!(missing(&answers), "leader");
        answers.note(&command(2, 6), &Stamps::default(), 200);
        answers.begin(Tick(7), 100, ALL_COMMANDED.into_iter());
        assert_eq!(missing(&answers), "uav 2, leader");
    }

    #[test]
    fn whoever_comes_while_a_tick_is_open_is_waited_for_from_the_next_on() {
        let mut answers = with_everybody();
        let mut roster = *answers.roster();
        roster.set(UavId(1), false);
        answers.set_roster(&roster);
        answers.begin(Tick(6), 100, ALL_COMMANDED.into_iter());
        roster.set(UavId(1), true);
        answers.set_roster(&roster);
        assert_eq!(missing(&answers), "uav 2, uav 3, leader");
        answers.begin(Tick(7), 100, ALL_COMMANDED.into_iter());
        assert_eq!(missing(&answers), "uav 1, uav 2, uav 3, leader");
    }

    #[test]
    fn whoever_was_thawed_owes_the_tick_that_is_open() {
        let mut answers = with_everybody();
        let mut roster = *answers.roster();
        roster.set_thawed(UavId(2), true);
        roster.set_leader_thawed(true);
        answers.set_roster(&roster);
        assert_eq!(answers.owing().collect::<Vec<_>>(), [Part::Agent(UavId(2)), Part::Leader]);
        answers.note(&command(2, 5), &Stamps::default(), 200);
        answers.note_leader(Some(Tick(5)));
        assert_eq!(answers.owing().next(), None);
    }

    #[test]
    fn an_airframe_in_its_failsafe_reuses_no_command() {
        let mut answers = with_everybody();
        let modes = [FlightMode::LOITER, FlightMode::COMMANDED, FlightMode::COMMANDED];
        answers.begin(Tick(6), 100, modes.into_iter());
        answers.note(&command(2, 6), &Stamps::default(), 200);
        assert_eq!(answers.timing().reused, 1);
    }

    fn stamps(woke_ns: u64, read_ns: u64, sent_ns: u64) -> Stamps {
        Stamps { woke_ns, read_ns, sent_ns, ..Stamps::default() }
    }

    #[test]
    fn the_longest_of_each_hop_counts() {
        let mut answers = with_everybody();
        answers.note(&command(1, 5), &stamps(110, 115, 118), 150);
        answers.note(&command(2, 5), &stamps(130, 131, 140), 160);
        let timing = answers.timing();
        assert_eq!((timing.wake_ns, timing.read_ns, timing.compute_ns), (30, 5, 9));
        assert_eq!((timing.return_ns, timing.round_trip_ns), (32, 40));
        assert_eq!((timing.answered, timing.reused), (2, 1));
    }
}
