//! The faults that concern an agent: those of the scenario, and those added during the run.
//!
//! Never applies a link fault: the agent's reception does.

use ringwing_bus::{BusError, Gate, Member, report};
use ringwing_flight::{Part, Tick, UavId};
use ringwing_scenario::{
    Fault,
    fault::schedule::{LinkFault, SlowAnswers},
};
use std::{thread, time::Duration};

/// Watches the gate for added faults.
pub(super) struct FaultWatch<'m> {
    member: &'m Member,
    part: Part,
    /// How many added faults are known; `None` before the first look.
    known: Option<u32>,
    slow_answers: Vec<SlowAnswers>,
}

impl<'m> FaultWatch<'m> {
    pub(super) fn new(member: &'m Member, uav: UavId) -> Self {
        Self { member, part: Part::Agent(uav), known: None, slow_answers: Vec::new() }
    }

    /// The faults of all links, if they have changed since the last look.
    pub(super) fn changed_link_faults(&mut self, gate: &Gate) -> Result<Option<Vec<LinkFault>>, BusError> {
        let count = gate.faults();
        // `None` differs from every count, so the scenario's own faults are taken over at the first look.
        if self.known.replace(count) == Some(count) {
            return Ok(None);
        }
        let scenario = self.member.scenario();
        let mut faults = scenario.faults.clone();
        // The launcher writes the list before it raises the count, so a list with at least that many faults is there.
        if count > 0 {
            let added = self.member.domain().report::<Vec<Fault>>(report::FAULTS)?;
            faults.extend(added.unwrap_or_default());
        }
        let schedule = scenario.schedule_of(&faults);
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
