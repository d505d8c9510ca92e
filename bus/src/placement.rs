//! On which core a new process runs, and with which priority.
//!
//! Must never change the scheduling of the calling thread for longer than it takes to start one process, except where that
//! thread takes a place itself or makes way for all others.

use rustix::{
    process::setpriority_process,
    thread::{CpuSet, sched_getaffinity, sched_setaffinity},
};
use std::io;
use thread_priority::{
    NormalThreadSchedulePolicy, RealtimeThreadSchedulePolicy, ThreadPriority, ThreadSchedulePolicy,
    set_thread_priority_and_policy, thread_native_id,
};

/// Niceness 0 on the scale from 0 to 99 of `thread_priority`. Any other value would leave the thread nicer or less nice
/// than it was.
const NORMAL_PRIORITY: u8 = 47;
/// The niceness of a thread that yields to all others. With less, it would take time from the processes of a run.
const LOWEST_PRIORITY: i32 = 19;

/// The scheduling that a started process inherits.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Placement {
    /// The cores that it may use.
    pub cores: Cores,
    /// Run in the real-time class `SCHED_FIFO` with this priority, from 1 to 99.
    pub priority: Option<u8>,
}

/// The cores that a process may use, of those that whoever starts it may use.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Cores {
    /// All.
    #[default]
    All,
    /// One for each process, round robin.
    OneEach,
    /// The same one for every process, counted round robin.
    Same(usize),
}

/// The kernel refuses the real-time priority.
#[derive(Debug, thiserror::Error)]
#[error("--priority {priority}: {source}; run as root, raise `ulimit -r`, or leave --priority out")]
pub struct PlacementError {
    /// The priority that was asked for.
    pub priority: u8,
    /// The operating system's reason.
    pub source: io::Error,
}

impl Placement {
    /// Finds out whether the kernel permits the priority, by trying it on this thread for a moment.
    pub fn check(self) -> Result<(), PlacementError> {
        let Some(priority) = self.priority else { return Ok(()) };
        let tried = set_fifo(priority).and_then(|()| set_normal());
        tried.map_err(|source| PlacementError { priority, source })
    }

    /// How many cores the processes share, if whoever starts them may use `usable` cores.
    pub fn shared_cores(self, usable: u32) -> u32 {
        match self.cores {
            Cores::All | Cores::OneEach => usable,
            Cores::Same(_) => 1,
        }
    }

    /// Gives this thread the core and the priority of process number `index`, for good. Start all other processes first:
    /// they would inherit the one core.
    pub fn take(self, index: usize) -> io::Result<()> {
        let core = match self.cores {
            Cores::All => None,
            Cores::OneEach => Some(index),
            Cores::Same(core) => Some(core),
        };
        if let Some(core) = core {
            sched_setaffinity(None, &one_core(&sched_getaffinity(None)?, core))?;
        }
        self.priority.map_or(Ok(()), set_fifo)
    }

    /// Calls `start` to start the process number `index`.
    ///
    /// A child inherits the scheduling of the thread that starts it, so this thread takes it on until `start` returns.
    pub fn start<T>(self, index: usize, start: impl FnOnce() -> io::Result<T>) -> io::Result<T> {
        let before = sched_getaffinity(None)?;
        let started = self.take(index).and_then(|()| start());
        // Undo both before reporting a failed start.
        if self.priority.is_some() {
            set_normal()?;
        }
        if self.cores != Cores::All {
            sched_setaffinity(None, &before)?;
        }
        started
    }
}

/// The core number `index` of those in `all`, round robin.
fn one_core(all: &CpuSet, index: usize) -> CpuSet {
    // Only the cores that this thread may use: a container may allow just some of the machine's.
    let usable: Vec<usize> = (0..CpuSet::MAX_CPU).filter(|cpu| all.is_set(*cpu)).collect();
    let mut one = CpuSet::new();
    one.set(usable[index % usable.len()]);
    one
}

/// Gives this thread the lowest priority: while anything else wants its core, it hardly runs.
pub(crate) fn make_way() -> io::Result<()> {
    // On Linux, this changes only the calling thread.
    Ok(setpriority_process(None, LOWEST_PRIORITY)?)
}

fn set_fifo(priority: u8) -> io::Result<()> {
    let value = priority.try_into().map_err(io::Error::other)?;
    let policy = ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);
    set_scheduling(ThreadPriority::Crossplatform(value), policy)
}

fn set_normal() -> io::Result<()> {
    let policy = ThreadSchedulePolicy::Normal(NormalThreadSchedulePolicy::Other);
    let value = NORMAL_PRIORITY.try_into().map_err(io::Error::other)?;
    set_scheduling(ThreadPriority::Crossplatform(value), policy)
}

fn set_scheduling(priority: ThreadPriority, policy: ThreadSchedulePolicy) -> io::Result<()> {
    let to_io_error = |error| match error {
        thread_priority::Error::OS(code) => io::Error::from_raw_os_error(code),
        other => io::Error::other(format!("{other:?}")),
    };
    set_thread_priority_and_policy(thread_native_id(), priority, policy).map_err(to_io_error)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn processes_are_pinned_round_robin_to_the_usable_cores() {
        let mut all = CpuSet::new();
        for cpu in [1, 5, 6] {
            all.set(cpu);
        }
        for (index, cpu) in [(0, 1), (1, 5), (2, 6), (3, 1)] {
            let one = one_core(&all, index);
            assert!(one.is_set(cpu) && one.count() == 1, "process {index}");
        }
    }

    #[test]
    fn starting_an_urgent_process_restores_the_niceness_of_this_thread() {
        let urgent = Placement { cores: Cores::All, priority: Some(1) };
        if urgent.check().is_err() {
            return; // Not permitted on this machine, so `start` would refuse.
        }
        urgent.start(0, || Ok(())).unwrap();
        assert_eq!(rustix::process::getpriority_process(None).unwrap(), 0);
    }

    #[test]
    fn a_thread_that_takes_a_place_keeps_it() {
        let pinned = Placement { cores: Cores::OneEach, priority: None };
        let (all, taken) = std::thread::spawn(move || {
            let all = sched_getaffinity(None).unwrap();
            pinned.take(1).unwrap();
            (all, sched_getaffinity(None).unwrap())
        })
        .join()
        .unwrap();
        assert!(taken == one_core(&all, 1));
    }

    #[test]
    fn processes_share_all_cores_unless_they_keep_together() {
        let shared = |cores| Placement { cores, priority: None }.shared_cores(4);
        assert_eq!([Cores::All, Cores::OneEach, Cores::Same(3)].map(shared), [4, 4, 1]);
    }

    #[test]
    fn processes_that_keep_together_get_the_same_core() {
        let before = sched_getaffinity(None).unwrap();
        for core in [0, 1] {
            let together = Placement { cores: Cores::Same(core), priority: None };
            for index in [0, 3, 4] {
                let inside = together.start(index, || Ok(sched_getaffinity(None)?)).unwrap();
                assert!(inside == one_core(&before, core), "process {index}");
            }
        }
        assert!(sched_getaffinity(None).unwrap() == before);
    }

    #[test]
    fn a_started_process_inherits_one_core_and_this_thread_keeps_all() {
        let before = sched_getaffinity(None).unwrap();
        let pinned = Placement { cores: Cores::OneEach, priority: None };
        let inside = pinned.start(1, || Ok(sched_getaffinity(None)?)).unwrap();
        assert!(inside.count() == 1 && inside == one_core(&before, 1));
        assert!(sched_getaffinity(None).unwrap() == before);
    }
}
