//! The faults that concern an agent: those of the scenario, and those added during the run.
//!
//! Never applies a link fault: the agent's reception does.

use ringwing_bus::{BusError, FaultWatch, Gate, Member};
use ringwing_flight::{Part, Tick, UavId};
use ringwing_scenario::fault::schedule::{LinkFault, SlowAnswers};
use std::{thread, time::Duration};

/// The faults of one agent.
pub(super) struct AgentFaults<'m> {
    watch: FaultWatch<'m>,
    part: Part,
    slow_answers: Vec<SlowAnswers>,
}

impl<'m> AgentFaults<'m> {
    pub(super) fn new(member: &'m Member, uav: UavId) -> Self {
        Self { watch: FaultWatch::new(member), part: Part::Agent(uav), slow_answers: Vec::new() }
    }

    /// The faults of all links, if the faults of the run have changed since the last look.
    pub(super) fn changed_link_faults(&mut self, gate: &Gate) -> Result<Option<Vec<LinkFault>>, BusError> {
        let Some(schedule) = self.watch.changed(gate)? else { return Ok(None) };
        let part = self.part;
        self.slow_answers = schedule.slow_answers().into_iter().filter(|slow| slow.part == part).collect();
        Ok(Some(schedule.link_faults()))
    }

    /// Delays the answer to `now` by as much as the `slow` faults of this agent say.
    pub(super) fn delay_answer(&self, now: Tick) {
        for slow in self.slow_answers.iter().filter(|slow| slow.is_on(now)) {
            thread::sleep(Duration::from_secs_f64(slow.by_s));
        }
    }
}
