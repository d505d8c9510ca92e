//! What a run takes of the machine: shared memory, files in it, open files, processes.
//!
//! The figures are measured, see the test in `tests/machines.rs`; they are a little higher than what a run really takes.
//!
//! Must never look at the machine: [`Capacity`](crate::Capacity) does.

use crate::{
    BusError, Domain, ballast,
    domain::{Reserve, reserve},
    journal,
};
use ringwing_flight::{Part, ProcessAction, UavId};
use ringwing_scenario::{Scenario, Wake, fault::Action};
use rustix::param::page_size;

/// Pages of shared memory that a run takes before the first UAV: the services for rare messages, the gate, the processes
/// beside the agents. Fewer let a run begin that lacks memory later; more refuse runs that would fit.
const PAGES_PER_RUN: u64 = 160;
/// Pages of a UAV: its four boards and its agent's node.
const PAGES_PER_UAV: u64 = 17;
/// Pages of a board with few readers: `uav/N/sensed` and `uav/N/command`.
const PAGES_PER_BOARD: u64 = 4;
/// Pages of `uav/N/state`, which has places for many readers.
const PAGES_OF_STATE_BOARD: u64 = 6;
/// Further pages of a UAV if processes wake each other by events.
const PAGES_PER_LISTENER: u64 = 2;
/// Further pages of a UAV with ballast, without the bytes themselves.
const PAGES_PER_BALLAST: u64 = 9;
/// Further pages of a UAV that counts what becomes of samples on links with faults.
const PAGES_PER_LINK_COUNTS: u64 = 17;
/// Pages of a new process in place of one that has ended: its boards and its node. The old ones stay until all readers have
/// moved on.
const PAGES_PER_INCARNATION: u64 = 28;
/// Pages of an observer, such as the run's viewer: its node, and its ends of the services. Fewer let an observer begin for which
/// there is no memory; more refuse one that would fit.
const PAGES_PER_OBSERVER: u64 = 48;
/// Further pages of an observer for each UAV, whose agent may count what becomes of samples on links with faults.
const PAGES_PER_OBSERVED_UAV: u64 = 2;
/// New processes for which there is room although no fault of the scenario asks for them. With fewer, a lost process may
/// find no memory for its successor; more make each run take more.
const SPARE_INCARNATIONS: u64 = 8;
/// At most this many processes of each part are kept at the same time: the present one, and two whose remains are not
/// cleaned up yet.
const KEPT_INCARNATIONS: u64 = 2;

/// Files in shared memory: most are empty, and mark which process has which service open.
const FILES_PER_RUN: u64 = 150;
const FILES_PER_UAV: u64 = 40;
const FILES_PER_LISTENER: u64 = 8;
const FILES_PER_BALLAST: u64 = 20;

/// Open files of the launcher, which holds every service, and of the world, which uses nearly every one.
const DESCRIPTORS_PER_RUN: u64 = 80;
const DESCRIPTORS_OF_LAUNCHER_PER_UAV: u64 = 12;
const DESCRIPTORS_OF_LAUNCHER_PER_BALLAST: u64 = 4;
const DESCRIPTORS_OF_WORLD_PER_UAV: u64 = 10;
const DESCRIPTORS_OF_WORLD_PER_BALLAST: u64 = 10;
const DESCRIPTORS_OF_WORLD_PER_LISTENER: u64 = 3;

/// Processes and threads beside the agents: world, leader, recorder, and the launcher with its threads.
const TASKS_PER_RUN: u64 = 16;
/// Threads of the run's viewer. Fewer let it begin where it cannot serve anybody; more refuse runs that would fit.
const TASKS_OF_VIEWER: u64 = 8;
/// The largest file of a run without a recorder: a segment of rare messages.
const EVENT_SEGMENT_BYTES: u64 = 11 << 20;

/// What a run takes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Demand {
    /// Number of UAVs, for messages.
    pub(crate) uavs: u32,
    /// Shared memory without the journal and without the successors of lost processes, in bytes.
    pub(crate) swarm_bytes: u64,
    /// Shared memory for the successors of lost processes, in bytes.
    pub(crate) successors_bytes: u64,
    /// Files in shared memory.
    pub(crate) files: u64,
    /// How many ticks the journal should keep for a recorder that lags, and how many it must keep.
    pub(crate) journal_depths: [usize; 2],
    /// Open files of the process that opens most.
    pub(crate) descriptors: u64,
    /// Processes and threads.
    pub(crate) tasks: u64,
    /// The largest file beside the journal's, in bytes.
    other_segment_bytes: u64,
}

impl Demand {
    /// What a run of `scenario` takes; without a recorder nobody reads the journal.
    pub fn of(scenario: &Scenario, has_recorder: bool) -> Self {
        let (uavs, n) = (scenario.formation.uavs, u64::from(scenario.formation.uavs));
        let ballast_bytes = u64::from(scenario.ipc.payload_bytes);
        let [events, ballast] = [scenario.ipc.wake == Wake::Event, ballast_bytes > 0].map(u64::from);
        let link_faults = u64::from(has_link_faults(scenario));
        let own = UavId::all(uavs).filter(|uav| scenario.agent_of(*uav).is_some()).count() as u64;
        let pages_per_uav = PAGES_PER_UAV
            + PAGES_PER_LISTENER * events
            + PAGES_PER_BALLAST * ballast
            + PAGES_PER_LINK_COUNTS * link_faults;
        let launcher = DESCRIPTORS_OF_LAUNCHER_PER_UAV + DESCRIPTORS_OF_LAUNCHER_PER_BALLAST * ballast;
        let world = DESCRIPTORS_OF_WORLD_PER_UAV
            + DESCRIPTORS_OF_WORLD_PER_BALLAST * ballast
            + DESCRIPTORS_OF_WORLD_PER_LISTENER * events;
        Self {
            uavs,
            // Each UAV with ballast has a segment in each direction.
            swarm_bytes: bytes(PAGES_PER_RUN + pages_per_uav * n)
                + 2 * n * ballast * reserve::pinned_bytes(ballast_bytes)
                + own * journal::notes_lag_bytes(uavs),
            successors_bytes: bytes(PAGES_PER_INCARNATION) * successors(scenario),
            files: FILES_PER_RUN
                + n * (FILES_PER_UAV + FILES_PER_LISTENER * events + FILES_PER_BALLAST * ballast),
            // The world opens the journal in any case, so it exists without a recorder too, as small as possible.
            journal_depths: if has_recorder { journal_depths(scenario) } else { [1, 1] },
            // The limit holds for each process by itself, so the one that opens more decides.
            descriptors: DESCRIPTORS_PER_RUN + n * launcher.max(world),
            tasks: TASKS_PER_RUN + n,
            other_segment_bytes: EVENT_SEGMENT_BYTES.max(ballast::segment_bytes(ballast_bytes)),
        }
    }

    /// The same run with a viewer.
    pub fn with_viewer(mut self) -> Self {
        self.successors_bytes += observer_bytes(self.uavs);
        self.tasks += TASKS_OF_VIEWER;
        self
    }

    /// The same run with so many more threads.
    pub fn with_threads(mut self, count: u32) -> Self {
        self.tasks += u64::from(count);
        self
    }

    /// Shared memory that the run takes if its journal keeps `depth` ticks, in bytes.
    pub fn memory_bytes(&self, depth: usize) -> u64 {
        self.swarm_bytes + self.successors_bytes + journal::lag_bytes(self.uavs, depth)
    }

    /// Sets the memory of the run aside in `domain`, with `depth` ticks of its journal.
    pub fn set_aside(&self, domain: &Domain, depth: usize) -> Result<(), BusError> {
        // The launcher's own node and the services for rare messages come to life while all this is set aside.
        domain.set_aside(Reserve::Swarm, self.swarm_bytes - bytes(PAGES_PER_RUN))?;
        domain.set_aside(Reserve::Journal, journal::lag_bytes(self.uavs, depth))?;
        domain.set_aside(Reserve::Successors, self.successors_bytes)
    }

    /// The largest file that the run makes if its journal keeps `depth` ticks, in bytes.
    pub(crate) fn largest_file_bytes(&self, depth: usize) -> u64 {
        self.other_segment_bytes.max(journal::segment_bytes(self.uavs, depth))
    }
}

/// Shared memory of one new process in place of one that has ended, in bytes.
pub(crate) fn successor_bytes() -> u64 {
    bytes(PAGES_PER_INCARNATION)
}

/// Shared memory of an observer of a swarm of `uavs` that hangs, in bytes.
pub(crate) fn observer_bytes(uavs: u32) -> u64 {
    bytes(PAGES_PER_OBSERVER + PAGES_PER_OBSERVED_UAV * u64::from(uavs)) + journal::observer_lag_bytes(uavs)
}

/// Shared memory of the boards of `part` in a swarm of `uavs`, in bytes.
pub(crate) fn board_bytes(part: Part, uavs: u32) -> u64 {
    bytes(match part {
        Part::World => PAGES_PER_BOARD * u64::from(uavs),
        Part::Agent(_) => PAGES_OF_STATE_BOARD + PAGES_PER_BOARD,
        Part::Leader => PAGES_PER_BOARD,
        Part::Recorder => 0,
    })
}

fn bytes(pages: u64) -> u64 {
    pages * page_size() as u64
}

fn has_link_faults(scenario: &Scenario) -> bool {
    scenario.faults.iter().any(|fault| matches!(fault.action, Action::Link { .. }))
}

/// For how many successors of lost processes there is room.
fn successors(scenario: &Scenario) -> u64 {
    let ends = |action| matches!(action, ProcessAction::Kill { .. } | ProcessAction::Stop);
    let actions = scenario.schedule().scheduled_actions();
    let planned = actions.iter().filter(|scheduled| ends(scheduled.action)).count() as u64;
    // The agents, the leader and the recorder. A lost world ends the run, so it needs no room for a successor.
    let parts = u64::from(scenario.formation.uavs) + 2;
    SPARE_INCARNATIONS + planned.min(KEPT_INCARNATIONS * parts)
}

/// How many ticks the journal should keep, and how many it must: half a second, for a recorder that waits for the disk.
fn journal_depths(scenario: &Scenario) -> [usize; 2] {
    let most = journal::depth_max(scenario.formation.uavs);
    [most, most.min(scenario.time.rate_hz as usize / 2).max(1)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use ringwing_flight::Notes;
    use ringwing_scenario::AgentSection;

    fn demand(uavs: u32, change: impl FnOnce(&mut Scenario)) -> Demand {
        let mut scenario = Scenario::default();
        scenario.formation.uavs = uavs;
        change(&mut scenario);
        Demand::of(&scenario, true)
    }

    #[test]
    fn a_larger_swarm_takes_more_of_everything() {
        let [small, large] = [6, 60].map(|uavs| demand(uavs, |_| {}));
        assert!(large.memory_bytes(100) > 3 * small.memory_bytes(100), "{small:?} {large:?}");
        assert!(large.files > 5 * small.files && large.descriptors > 5 * small.descriptors);
        assert_eq!(large.tasks - small.tasks, 54);
        let seen = small.clone().with_viewer();
        assert!(seen.memory_bytes(100) > small.memory_bytes(100) && seen.tasks > small.tasks);
    }

    #[test]
    fn whatever_a_scenario_adds_takes_memory() {
        let plain = demand(6, |_| {}).swarm_bytes;
        assert!(demand(6, |scenario| scenario.ipc.wake = Wake::Event).swarm_bytes > plain);
        let ballast = |bytes| demand(6, |scenario| scenario.ipc.payload_bytes = bytes).swarm_bytes;
        assert!(ballast(16) > plain);
        assert!(ballast(1 << 20) - ballast(16) > 6 * 4 * (1 << 20), "{}", ballast(1 << 20));
        let fault = |sentence: &str| demand(6, |scenario| scenario.faults = vec![sentence.parse().unwrap()]);
        assert!(fault("at 1 s link all loss 30 %").swarm_bytes > plain);
        let agents =
            |text: &str| demand(6, |scenario| scenario.agents = vec![AgentSection::parse(text).unwrap()]);
        let [one, all] = ["3=./mine", "all=./mine"].map(|text| agents(text).swarm_bytes - plain);
        assert!(one > 1000 * size_of::<Notes>() as u64 && all == 6 * one, "{one} {all}");
        let spare = SPARE_INCARNATIONS * successor_bytes();
        assert_eq!(fault("at 1 s freeze uav 3").successors_bytes, spare);
        assert_eq!(
            fault("at 1 s restart all uavs after 1 s").successors_bytes,
            spare + 6 * successor_bytes()
        );
        let flapping = fault("at 1 s flap all uavs every 1 s for 60 s").successors_bytes;
        assert_eq!(flapping, spare + 2 * 8 * successor_bytes(), "not one for each of 360 kills");
    }

    #[test]
    fn the_journal_keeps_half_a_second_and_as_much_more_as_it_may() {
        assert_eq!(demand(6, |_| {}).journal_depths, [1024, 50]);
        let [most, least] = demand(1000, |scenario| scenario.time.rate_hz = 1000).journal_depths;
        assert!(most == least && most < 200, "64 MiB hold fewer ticks than half a second: {most}");
        assert_eq!(Demand::of(&Scenario::default(), false).journal_depths, [1, 1]);
    }

    #[test]
    fn the_largest_file_is_the_journal_or_the_ballast() {
        let plain = demand(6, |_| {});
        assert!(plain.largest_file_bytes(1024) > 9 << 20);
        assert_eq!(plain.largest_file_bytes(1), EVENT_SEGMENT_BYTES);
        let ballast = demand(6, |scenario| scenario.ipc.payload_bytes = 1 << 20);
        assert!(ballast.largest_file_bytes(1) > 40 << 20);
    }
}
