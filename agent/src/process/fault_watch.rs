//! The faults that concern an agent: those of the scenario, and those added while the run goes on.

use super::AgentError;
use ringwing_bus::{Gate, Member, report};
use ringwing_flight::{Part, Tick, UavId};
use ringwing_scenario::{
    Fault, Scenario,
    fault::schedule::{LinkFault, SlowAnswers},
};
use std::{thread, time::Duration};

/// Watches the gate for added faults.
pub(super) struct FaultWatch {
    uav: UavId,
    scenario: Scenario,
    /// How many added faults are known; `None` before the first look.
    known: Option<u32>,
    slow_answers: Vec<SlowAnswers>,
}

impl FaultWatch {
    pub(super) fn new(scenario: Scenario, uav: UavId) -> Self {
        Self { uav, scenario, known: None, slow_answers: Vec::new() }
    }

    /// The faults of all links, if they have changed since the last look.
    pub(super) fn changed_link_faults(
        &mut self,
        member: &Member,
        gate: &Gate,
    ) -> Result<Option<Vec<LinkFault>>, AgentError> {
        let count = gate.faults();
        if self.known.replace(count) == Some(count) {
            return Ok(None);
        }
        let mut faults = self.scenario.faults.clone();
        if count > 0 {
            faults.extend(member.domain().report::<Vec<Fault>>(report::FAULTS)?.unwrap_or_default());
        }
        let schedule = self.scenario.schedule_of(&faults);
        let part = Part::Agent(self.uav);
        self.slow_answers = schedule.slow_answers().into_iter().filter(|slow| slow.part == part).collect();
        Ok(Some(schedule.link_faults()))
    }

    /// Delays the answer to `now` by as much as the `slow` faults of this agent say.
    pub(super) fn delay_answer(&self, now: Tick) {
        for slow in self.slow_answers.iter().filter(|slow| (slow.begin..slow.end).contains(&now.0)) {
            thread::sleep(Duration::from_secs_f64(slow.by_s));
        }
    }
}
