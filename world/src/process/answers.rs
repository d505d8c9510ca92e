//! Which processes have answered the open tick, and which ones the world waits for.
//!
//! An agent has answered a tick when a command of that tick has arrived from it, even a withheld one, and the leader when
//! its state of that tick has.
//!
//! Never decides anything about the flight: that is the airspace's part.

use ringwing_bus::Stamps;
use ringwing_flight::{Command, Part, Roster, Tick, TickTiming, UavId};

/// The answers to one tick, and how long they took.
#[derive(Debug)]
pub(super) struct Answers {
    tick: Tick,
    opened_ns: u64,
    roster: Roster,
    /// UAV 1 first.
    agents: Vec<AgentAnswer>,
    leader_answered: bool,
    /// The leader was given up and has not answered since.
    leader_silent: bool,
    timing: TickTiming,
}

#[derive(Debug, Clone, Copy, Default)]
struct AgentAnswer {
    answered: bool,
    /// The agent was given up and has not answered since.
    silent: bool,
    /// The agent was on the roster when the tick opened.
    on_roster: bool,
}

impl Answers {
    /// The answers before the first tick, with an empty roster.
    pub(super) fn new(uavs: u32) -> Self {
        Self {
            tick: Tick::APPROACH,
            opened_ns: 0,
            roster: Roster::empty(),
            agents: vec![AgentAnswer::default(); uavs as usize],
            leader_answered: false,
            leader_silent: false,
            timing: TickTiming::default(),
        }
    }

    /// The newest roster.
    pub(super) fn roster(&self) -> &Roster {
        &self.roster
    }

    /// All UAVs of the swarm.
    pub(super) fn uavs(&self) -> impl Iterator<Item = UavId> + use<> {
        UavId::all(self.agents.len() as u32)
    }

    /// Takes over a new roster. The world waits again for a given-up process that has been replaced.
    pub(super) fn set_roster(&mut self, roster: &Roster) {
        for (uav, agent) in self.uavs().zip(&mut self.agents) {
            // Only an agent that is new on the roster is a successor. One that was there before is the silent one
            // itself.
            agent.silent &= self.roster.has(uav) || !roster.has(uav);
        }
        self.leader_silent &= self.roster.has_leader() || !roster.has_leader();
        self.roster = *roster;
    }

    /// Begins `tick`, opened at `opened_ns`. An agent that joins the roster later is waited for from the next tick on.
    pub(super) fn begin(&mut self, tick: Tick, opened_ns: u64) {
        (self.tick, self.opened_ns, self.leader_answered) = (tick, opened_ns, false);
        self.timing = TickTiming { tick: tick.0, ..TickTiming::default() };
        for (uav, agent) in self.uavs().zip(&mut self.agents) {
            (agent.answered, agent.on_roster) = (false, self.roster.has(uav));
        }
    }

    /// How many answers to wait for.
    pub(super) fn expected(&self) -> u32 {
        let agents = self.uavs().filter(|uav| self.expects(*uav)).count();
        agents as u32 + u32::from(self.expects_leader())
    }

    fn expects(&self, uav: UavId) -> bool {
        let agent = &self.agents[uav.index()];
        // Both rosters count: an agent that came later has no part in the tick, and one that has left cannot answer it.
        agent.on_roster && !agent.silent && self.roster.has(uav)
    }

    /// A leader that is being replaced is waited for too: the new one answers the tick that the old one left open.
    fn expects_leader(&self) -> bool {
        (self.roster.has_leader() || self.roster.holds()) && !self.leader_silent
    }

    /// The processes whose answer is expected and has not arrived.
    pub(super) fn missing(&self) -> impl Iterator<Item = Part> {
        let agents = self
            .uavs()
            .filter(|uav| self.expects(*uav) && !self.agents[uav.index()].answered)
            .map(Part::Agent);
        agents.chain((self.expects_leader() && !self.leader_answered).then_some(Part::Leader))
    }

    /// Notes a command that arrived with `stamps` and was read at `read_ns`.
    ///
    /// The round trip ends when the agent sends, not when the world reads: in real time the world reads late on purpose.
    pub(super) fn note(&mut self, command: &Command, stamps: &Stamps, read_ns: u64) {
        // A thawed agent may send the answer to an earlier tick first. It still owes the one to this tick.
        if command.tick != self.tick {
            return;
        }
        let agent = &mut self.agents[command.uav.index()];
        (agent.answered, agent.silent) = (true, false);
        // The stamps come from another process. One that is out of order must not overflow here.
        let longest = |so_far: &mut u64, from: u64, to: u64| *so_far = (*so_far).max(to.saturating_sub(from));
        longest(&mut self.timing.wake_ns, self.opened_ns, stamps.woke_ns);
        longest(&mut self.timing.read_ns, stamps.woke_ns, stamps.read_ns);
        longest(&mut self.timing.compute_ns, stamps.read_ns, stamps.sent_ns);
        longest(&mut self.timing.return_ns, stamps.sent_ns, read_ns);
        longest(&mut self.timing.round_trip_ns, self.opened_ns, stamps.sent_ns);
    }

    /// Notes the tick of a leader state that has arrived.
    pub(super) fn note_leader(&mut self, tick: Option<Tick>) {
        if tick == Some(self.tick) {
            (self.leader_answered, self.leader_silent) = (true, false);
        }
    }

    /// Gives up the missing processes: the world does not wait for them until they answer again. Returns them.
    pub(super) fn give_up(&mut self) -> Vec<Part> {
        let missing: Vec<Part> = self.missing().collect();
        for part in &missing {
            match part {
                Part::Agent(uav) => self.agents[uav.index()].silent = true,
                // The world and the recorder answer no ticks, so they are never missing.
                _ => self.leader_silent = true,
            }
        }
        missing
    }

    /// How long the tick's answers took. The airspace fills in the counts of commands.
    pub(super) fn timing(&self) -> TickTiming {
        self.timing
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn command(uav: u32, tick: i64) -> Command {
        Command::new(Tick(tick), UavId(uav), 15.0, 0.0)
    }

    /// Tick 5 is open, and the leader and three agents are on the roster.
    fn answers() -> Answers {
        let mut roster = Roster::empty();
        roster.set_leader(true);
        UavId::all(3).for_each(|uav| roster.set(uav, true));
        let mut answers = Answers::new(3);
        answers.set_roster(&roster);
        answers.begin(Tick(5), 100);
        answers
    }

    fn change_roster(answers: &mut Answers, change: impl FnOnce(&mut Roster)) {
        let mut roster = *answers.roster();
        change(&mut roster);
        answers.set_roster(&roster);
    }

    fn missing(answers: &Answers) -> String {
        answers.missing().map(|part| part.to_string()).collect::<Vec<_>>().join(", ")
    }

    #[test]
    fn a_late_answer_to_another_tick_does_not_count() {
        let mut answers = answers();
        answers.note(&command(1, 4), &Stamps::default(), 200);
        answers.note(&command(2, 5), &Stamps::default(), 200);
        answers.note_leader(Some(Tick(4)));
        assert_eq!(missing(&answers), "uav 1, uav 3, leader");
        answers.note_leader(Some(Tick(5)));
        assert_eq!(missing(&answers), "uav 1, uav 3");
    }

    #[test]
    fn a_withheld_command_is_an_answer() {
        let mut answers = answers();
        answers.note(&Command::withheld(Tick(5), UavId(2)), &Stamps::default(), 200);
        assert_eq!(missing(&answers), "uav 1, uav 3, leader");
    }

    #[test]
    fn a_process_that_has_left_the_roster_is_not_waited_for() {
        let mut answers = answers();
        change_roster(&mut answers, |roster| roster.set(UavId(1), false));
        assert_eq!(missing(&answers), "uav 2, uav 3, leader");
        assert_eq!(answers.expected(), 3);
    }

    #[test]
    fn a_leader_that_is_being_replaced_is_waited_for() {
        let mut answers = answers();
        change_roster(&mut answers, |roster| roster.set_leader(false));
        assert_eq!(missing(&answers), "uav 1, uav 2, uav 3");
        change_roster(&mut answers, |roster| roster.set_hold(true));
        assert_eq!(missing(&answers), "uav 1, uav 2, uav 3, leader");
    }

    #[test]
    fn a_given_up_process_is_waited_for_again_once_it_answers() {
        let mut answers = answers();
        answers.note_leader(Some(Tick(5)));
        assert_eq!(answers.give_up().len(), 3);
        answers.begin(Tick(6), 100);
        assert_eq!(missing(&answers), "leader");
        answers.note(&command(2, 6), &Stamps::default(), 200);
        answers.begin(Tick(7), 100);
        assert_eq!(missing(&answers), "uav 2, leader");
    }

    #[test]
    fn a_given_up_process_is_waited_for_again_once_it_is_replaced() {
        let mut answers = answers();
        answers.give_up();
        for runs in [false, true] {
            change_roster(&mut answers, |roster| roster.set(UavId(3), runs));
        }
        answers.begin(Tick(6), 100);
        assert_eq!(missing(&answers), "uav 3");
    }

    #[test]
    fn an_agent_that_joins_while_a_tick_is_open_is_waited_for_from_the_next_tick_on() {
        let mut answers = answers();
        change_roster(&mut answers, |roster| roster.set(UavId(1), false));
        answers.begin(Tick(6), 100);
        change_roster(&mut answers, |roster| roster.set(UavId(1), true));
        assert_eq!(missing(&answers), "uav 2, uav 3, leader");
        answers.begin(Tick(7), 100);
        assert_eq!(missing(&answers), "uav 1, uav 2, uav 3, leader");
    }

    #[test]
    fn each_hop_of_a_tick_is_as_long_as_its_longest() {
        let stamps = |woke_ns, read_ns, sent_ns| Stamps { woke_ns, read_ns, sent_ns, ..Stamps::default() };
        let mut answers = answers();
        answers.note(&command(1, 5), &stamps(110, 115, 118), 150);
        answers.note(&command(2, 5), &stamps(130, 131, 140), 160);
        let timing = answers.timing();
        assert_eq!((timing.wake_ns, timing.read_ns, timing.compute_ns), (30, 5, 9));
        assert_eq!((timing.return_ns, timing.round_trip_ns), (32, 40));
    }
}
