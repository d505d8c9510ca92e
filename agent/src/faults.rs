//! What an agent learns of the faults that concern it: those of the scenario, and those added while the run goes on.

use crate::AgentError;
use ringwing_bus::{Gate, Member, report};
use ringwing_flight::{Part, Tick, UavId};
use ringwing_scenario::{
    Fault, Scenario,
    fault::schedule::{LinkFault, SlowAnswers},
};
use std::{thread, time::Duration};

/// The faults that an agent knows of.
pub(crate) struct Faults {
    uav: UavId,
    scenario: Scenario,
    /// How many of those added it knows; none before the first look.
    known: Option<u32>,
    slow_answers: Vec<SlowAnswers>,
}

impl Faults {
    pub(crate) fn new(scenario: Scenario, uav: UavId) -> Self {
        Self { uav, scenario, known: None, slow_answers: Vec::new() }
    }

    /// All faults of links, if there are others than at the last look.
    pub(crate) fn news(
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

    /// Takes as much longer for `now` as it should.
    pub(crate) fn dawdle(&self, now: Tick) {
        for slow in self.slow_answers.iter().filter(|slow| (slow.begin..slow.end).contains(&now.0)) {
            thread::sleep(Duration::from_secs_f64(slow.by_s));
        }
    }
}
