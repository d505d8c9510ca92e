//! What a process knows of the faults of its run: those of the scenario, and those added during the flight.
//!
//! Must never apply a fault: whoever watches does.

use crate::{BusError, Gate, Member, report};
use ringwing_scenario::{Fault, fault::schedule::FaultSchedule};

/// Looks out for faults that the launcher adds.
#[derive(Debug)]
pub struct FaultWatch<'m> {
    member: &'m Member,
    /// How many added faults are known; `None` before the first look.
    known: Option<u32>,
    /// The scenario's faults, then the added ones in their order.
    faults: Vec<Fault>,
}

impl<'m> FaultWatch<'m> {
    /// Watches the run of `member`.
    pub fn new(member: &'m Member) -> Self {
        Self { member, known: None, faults: Vec::new() }
    }

    /// The schedule of all faults of the run, if they changed since the last look. The first look counts as a change. A
    /// look without a change costs a read of the gate.
    pub fn changed(&mut self, gate: &Gate) -> Result<Option<FaultSchedule<'_>>, BusError> {
        let count = gate.faults();
        if self.known.replace(count) == Some(count) {
            return Ok(None);
        }
        let scenario = self.member.scenario();
        self.faults.clone_from(&scenario.faults);
        // The launcher writes the list before it raises the count, so a list with at least that many faults is there.
        if count > 0 {
            let added = self.member.domain().report::<Vec<Fault>>(report::FAULTS)?;
            self.faults.extend(added.unwrap_or_default());
        }
        Ok(Some(scenario.schedule_of(&self.faults)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{DomainOwner, MemberArgs};
    use ringwing_flight::Part;
    use ringwing_scenario::Scenario;

    #[test]
    fn faults_change_at_the_first_look_and_whenever_the_launcher_adds_some() {
        let fault = |sentence: &str| sentence.parse::<Fault>().unwrap();
        let (planned, added) = (fault("at 1 s kill uav 3"), fault("at 2 s kill uav 4"));
        let scenario = Scenario { faults: vec![planned.clone()], ..Scenario::default() };
        let (owner, gate) = DomainOwner::create(&scenario.to_toml()).unwrap();
        let args = MemberArgs { domain: owner.domain().id().clone(), launcher: None };
        let member = Member::join(&args, Part::World).unwrap();
        let mut watch = FaultWatch::new(&member);
        let mut changed = || watch.changed(&gate).unwrap().map(|schedule| schedule.faults.to_vec());
        assert_eq!(changed(), Some(vec![planned.clone()]));
        assert_eq!(changed(), None);
        owner.domain().write_report(report::FAULTS, &vec![added.clone()]).unwrap();
        gate.set_faults(1);
        assert_eq!(changed(), Some(vec![planned, added]));
        assert_eq!(changed(), None);
    }
}
