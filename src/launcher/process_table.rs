//! All processes of a run, and the roster that tells the world which of them take part.
//!
//! Must never start or signal a process: it knows only what the supervisor tells it.

use super::lifecycle::{Lifecycle, SupervisionLimits};
use ringwing_flight::{Part, Roster, UavId};
use std::collections::BTreeMap;

/// All processes of a run by their parts.
#[derive(Debug)]
pub(super) struct ProcessTable {
    processes: BTreeMap<Part, Lifecycle>,
    uavs: u32,
}

impl ProcessTable {
    /// The processes of a swarm of `uavs`, none of them started; `is_by_hand` says which ones the user starts.
    pub(super) fn new(uavs: u32, limits: SupervisionLimits, is_by_hand: impl Fn(Part) -> bool) -> Self {
        let process = |part| (part, Lifecycle::new(part, limits, is_by_hand(part)));
        Self { processes: Part::all(uavs).map(process).collect(), uavs }
    }

    /// The process of `part`.
    ///
    /// # Panics
    /// If the run has no such part: faults and notices name only parts that exist.
    pub(super) fn get(&self, part: Part) -> &Lifecycle {
        self.processes.get(&part).unwrap_or_else(|| panic!("this run has no {part}"))
    }

    /// The process of `part`, to report an input to it.
    ///
    /// # Panics
    /// If the run has no such part.
    pub(super) fn get_mut(&mut self, part: Part) -> &mut Lifecycle {
        self.processes.get_mut(&part).unwrap_or_else(|| panic!("this run has no {part}"))
    }

    /// The part whose process has this id now.
    pub(super) fn part_of(&self, pid: u32) -> Option<Part> {
        self.parts_with(|process| process.pid() == Some(pid)).next()
    }

    /// Whether the run waits for any process to become ready, or for the user to start one.
    pub(super) fn is_any_starting(&self) -> bool {
        self.processes.values().any(Lifecycle::is_starting)
    }

    /// The parts whose process exists.
    pub(super) fn living(&self) -> Vec<Part> {
        // In the order of parts, so the world comes first: whoever stops all processes relies on that.
        self.parts_with(|process| process.pid().is_some()).collect()
    }

    /// The parts whose process is frozen.
    pub(super) fn frozen(&self) -> Vec<Part> {
        self.parts_with(Lifecycle::is_frozen).collect()
    }

    fn parts_with(&self, condition: impl Fn(&Lifecycle) -> bool) -> impl Iterator<Item = Part> {
        self.processes.iter().filter(move |(_, process)| condition(process)).map(|(part, _)| *part)
    }

    /// The roster with number `revision`: which processes take part now. The world may open every tick.
    pub(super) fn roster(&self, revision: u64) -> Roster {
        let mut roster = Roster::empty();
        roster.revision = revision;
        roster.set_leader(self.get(Part::Leader).is_running());
        // The recorder follows another rule than the others: frozen by accident, it keeps its buffers and is waited
        // for.
        roster.set_recorder(self.get(Part::Recorder).is_reading());
        roster.set_hold(self.processes.values().any(Lifecycle::holds_flight));
        for uav in UavId::all(self.uavs) {
            roster.set(uav, self.get(Part::Agent(uav)).is_running());
        }
        roster
    }
}

#[cfg(test)]
mod tests {
    use super::super::lifecycle::{Input, RunStage};
    use super::*;
    use ringwing_flight::{ProcessAction, ProcessEnd};
    use std::time::Duration;

    const LIMITS: SupervisionLimits =
        SupervisionLimits { start: Duration::from_secs(10), freeze: Duration::from_secs(2), replacements: 2 };

    fn pid(part: Part) -> u32 {
        100 + part.index() as u32
    }

    fn report(table: &mut ProcessTable, part: Part, input: Input) {
        table.get_mut(part).on(input, Duration::ZERO, RunStage::Flying);
    }

    /// A swarm of three whose processes are all ready.
    fn ready() -> ProcessTable {
        let mut table = ProcessTable::new(3, LIMITS, |_| false);
        for part in Part::all(3) {
            report(&mut table, part, Input::Spawned { pid: pid(part) });
            report(&mut table, part, Input::Ready { pid: pid(part) });
        }
        table
    }

    fn roster(table: &ProcessTable) -> Roster {
        table.roster(5)
    }

    #[test]
    fn the_roster_names_everybody_who_takes_part() {
        let roster = roster(&ready());
        assert!(UavId::all(3).all(|uav| roster.has(uav)));
        assert!(roster.has_leader() && roster.has_recorder() && !roster.holds());
        assert_eq!((roster.revision, roster.free_before), (5, Roster::empty().free_before));
    }

    #[test]
    fn the_roster_leaves_out_the_frozen_and_takes_back_the_thawed() {
        let (mut table, uav) = (ready(), UavId(2));
        for part in [Part::Agent(uav), Part::Leader] {
            report(&mut table, part, Input::Asked(ProcessAction::Freeze));
            report(&mut table, part, Input::Stopped);
        }
        let frozen = roster(&table);
        assert!(!frozen.has(uav) && frozen.has(UavId(1)) && !frozen.has_leader() && !frozen.holds());
        assert_eq!(table.frozen(), [Part::Leader, Part::Agent(uav)]);
        for part in [Part::Agent(uav), Part::Leader] {
            report(&mut table, part, Input::Asked(ProcessAction::Thaw));
            report(&mut table, part, Input::Continued);
        }
        let thawed = roster(&table);
        assert!(thawed.has(uav) && thawed.has_leader());
        assert!(table.frozen().is_empty());
    }

    #[test]
    fn the_roster_holds_the_flight_while_a_leader_or_recorder_is_replaced() {
        for part in [Part::Leader, Part::Recorder] {
            let mut table = ready();
            report(&mut table, part, Input::Ended(ProcessEnd::Killed(9)));
            report(&mut table, part, Input::Spawned { pid: 7 });
            assert!(roster(&table).holds(), "{part}");
            report(&mut table, part, Input::Ready { pid: 7 });
            assert!(!roster(&table).holds(), "{part}");
        }
    }

    #[test]
    fn a_process_is_found_by_its_id_as_long_as_it_lives() {
        let (mut table, part) = (ready(), Part::Agent(UavId(3)));
        assert_eq!(table.part_of(pid(part)), Some(part));
        assert_eq!(table.living().len(), 6);
        report(&mut table, part, Input::Ended(ProcessEnd::Killed(9)));
        assert_eq!(table.part_of(pid(part)), None);
        assert_eq!(table.living().len(), 5);
        assert!(!table.is_any_starting());
    }
}
