//! The airframes that are broken by faults which were added during the run.
//!
//! The world knows those of the scenario from the beginning. Never breaks an airframe: the airspace does.

use super::World;
use ringwing_bus::{BusError, Gate, Member, TickProbe, report};
use ringwing_scenario::{Fault, fault::schedule::AirframeFault};

/// Watches the gate for added faults.
#[derive(Debug, Default)]
pub(super) struct FaultWatch {
    /// How many added faults are known.
    known: u32,
}

impl FaultWatch {
    /// All faults of airframes, if there are new faults since the last look.
    fn changed(&mut self, gate: &Gate, member: &Member) -> Result<Option<Vec<AirframeFault>>, BusError> {
        let count = gate.faults();
        if std::mem::replace(&mut self.known, count) == count {
            return Ok(None);
        }
        let scenario = member.scenario();
        // The launcher writes the list before it raises the count, so a list with at least that many faults is there.
        let added = member.domain().report::<Vec<Fault>>(report::FAULTS)?.unwrap_or_default();
        let faults = [scenario.faults.as_slice(), &added].concat();
        Ok(Some(scenario.schedule_of(&faults).airframe_faults()))
    }
}

impl<P: TickProbe> World<'_, P> {
    /// Takes over the faults that were added since the last tick. In lockstep the launcher adds them while it holds the tick in which
    /// they begin.
    pub(super) fn refresh_faults(&mut self) -> Result<(), BusError> {
        let changed = self.faults.changed(&self.ports.gate, self.ports.member())?;
        if let Some(faults) = changed {
            self.airspace.set_airframe_faults(faults);
        }
        Ok(())
    }
}
