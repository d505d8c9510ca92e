//! A short flight of the paper's six UAVs by real processes: whatever else a machine lacks shows here.

use super::{Check, Grade};
use crate::launcher::{Outcome, Plan, launch};
use ringwing_bus::Placement;
use ringwing_scenario::Scenario;
use std::{collections::BTreeSet, path::Path};

/// Length of the flight. Shorter shows the first ticks alone, with cold caches; longer takes more than a second on a slow
/// machine.
const DURATION_S: f64 = 2.0;

/// Flies, and says how fast.
pub(super) fn check() -> anyhow::Result<Check> {
    let folder = tempfile::tempdir()?;
    let check = match launch(&plan(folder.path())) {
        Ok(outcome) if outcome.failures.is_empty() => flown(&outcome),
        Ok(outcome) => unfit(&outcome.failures.join("; ")),
        Err(refusal) => unfit(&refusal.to_string()),
    };
    Ok(check)
}

fn plan(out: &Path) -> Plan {
    let mut scenario = Scenario { name: "doctor".into(), ..Scenario::default() };
    scenario.time.duration_s = DURATION_S;
    Plan {
        scenario,
        out: out.to_owned(),
        record: false,
        timing: false,
        by_hand: BTreeSet::new(),
        quiet: true,
        recorder: false,
        measure: None,
        placement: Placement::default(),
        lock_memory: false,
        live: None,
    }
}

fn flown(outcome: &Outcome) -> Check {
    let tick_us = outcome.flight_time.as_secs_f64() * 1e6 / outcome.ticks.max(1) as f64;
    let start_ms = outcome.start_time.as_secs_f64() * 1e3;
    Check {
        name: "flight",
        grade: Grade::Fit,
        finding: format!("six UAVs started in {start_ms:.0} ms and fly a tick in {tick_us:.0} us"),
    }
}

fn unfit(why: &str) -> Check {
    Check { name: "flight", grade: Grade::Unfit, finding: format!("six UAVs do not fly: {why}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_flight_that_fails_makes_the_machine_unfit() {
        let check = unfit("/dev/shm is full: mount it with more");
        assert!(check.grade == Grade::Unfit && check.finding.contains("/dev/shm is full"), "{check:?}");
    }
}
