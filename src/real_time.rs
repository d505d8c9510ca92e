//! What a run in real time asks of the kernel, apart from a core for each process: a priority, and memory that stays in RAM.
//!
//! Must never fail a run because the kernel refuses: the run flies without, and says so.

use crate::WrongUsage;
use ringwing_bus::{Placement, PlacementError};
use ringwing_scenario::{Scenario, Wake};
use rustix::{
    mm::{MlockAllFlags, mlockall},
    process::{Resource, getrlimit},
    thread::{CapabilitySet, capabilities},
};
use std::io;

/// What the processes of a run get.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Urgency {
    /// Their core and priority.
    pub(crate) placement: Placement,
    /// Whether their memory is locked.
    pub(crate) lock_memory: bool,
    /// What was asked for and is not permitted, each with a remedy.
    pub(crate) notes: Vec<String>,
}

/// What the processes of a run of `scenario` get of what the user `asked` for.
pub(crate) fn urgency(asked: Placement, scenario: &Scenario) -> Result<Urgency, WrongUsage> {
    if asked != Placement::default() && !scenario.time.real_time {
        return Err(WrongUsage(
            "--pin and --priority need --real-time: in lockstep no process is ever late, so they would change \
             nothing that a run can show"
                .into(),
        ));
    }
    if asked.priority.is_some() && scenario.ipc.wake == Wake::Spin {
        return Err(WrongUsage(
            "--priority with ipc.wake=spin would block every other process: leave one of them out".into(),
        ));
    }
    Ok(permitted(asked, asked.check().err().as_ref(), may_lock_memory()))
}

/// What remains of `asked` if the kernel refuses the priority, or the locking of memory.
fn permitted(asked: Placement, refused: Option<&PlacementError>, may_lock_memory: bool) -> Urgency {
    let is_urgent = asked.priority.is_some();
    let mut notes: Vec<String> = Vec::new();
    if let Some(PlacementError { priority, source }) = refused {
        notes.push(format!(
            "--priority {priority} is not permitted ({source}), so the processes run as any other: run as root, or raise \
             `ulimit -r`"
        ));
    }
    if is_urgent && !may_lock_memory {
        notes.push(
            "locking memory is not permitted, so a page may have to be fetched in mid-tick: run as root, or set \
             `ulimit -l unlimited`"
                .into(),
        );
    }
    let priority = asked.priority.filter(|_| refused.is_none());
    Urgency { placement: Placement { priority, ..asked }, lock_memory: is_urgent && may_lock_memory, notes }
}

/// Whether processes may lock as much memory as they map.
///
/// A limit that suffices now would make a later mapping fail, and with it the process.
pub(crate) fn may_lock_memory() -> bool {
    let is_privileged = capabilities(None).is_ok_and(|sets| sets.effective.contains(CapabilitySet::IPC_LOCK));
    is_privileged || getrlimit(Resource::Memlock).current.is_none()
}

/// Locks all memory of this process, also what it will map.
///
/// Pages are locked once they are touched: a process maps much more than it ever uses.
pub(crate) fn lock_memory() -> io::Result<()> {
    Ok(mlockall(MlockAllFlags::CURRENT | MlockAllFlags::FUTURE | MlockAllFlags::ONFAULT)?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use ringwing_bus::Cores;

    const ASKED: Placement = Placement { cores: Cores::OneEach, priority: Some(7) };

    #[test]
    fn what_is_permitted_is_used_without_a_note() {
        let urgency = permitted(ASKED, None, true);
        assert_eq!(urgency, Urgency { placement: ASKED, lock_memory: true, notes: Vec::new() });
    }

    #[test]
    fn what_is_not_permitted_is_left_out_with_a_note() {
        let refusal = PlacementError { priority: 7, source: io::Error::from_raw_os_error(1) };
        let urgency = permitted(ASKED, Some(&refusal), false);
        assert_eq!(urgency.placement, Placement { cores: Cores::OneEach, priority: None });
        assert!(!urgency.lock_memory);
        let [priority, memory] = urgency.notes.as_slice() else { panic!("{urgency:?}") };
        assert!(
            priority.contains("--priority 7 is not permitted") && priority.contains("ulimit -r"),
            "{priority}"
        );
        assert!(memory.contains("ulimit -l"), "{memory}");
    }

    #[test]
    fn memory_is_locked_only_for_a_priority() {
        let urgency = permitted(Placement { cores: Cores::OneEach, priority: None }, None, false);
        assert!(!urgency.lock_memory && urgency.notes.is_empty(), "{urgency:?}");
    }

    #[test]
    fn priorities_are_refused_where_they_would_do_nothing_or_harm() {
        let mut scenario = Scenario::default();
        scenario.time.real_time = false;
        assert!(urgency(ASKED, &scenario).unwrap_err().to_string().contains("need --real-time"));
        assert!(urgency(Placement::default(), &scenario).is_ok());
        scenario.time.real_time = true;
        assert!(urgency(ASKED, &scenario).is_ok());
        scenario.ipc.wake = Wake::Spin;
        assert!(urgency(ASKED, &scenario).unwrap_err().to_string().contains("leave one of them out"));
    }
}
