//! Where and how urgently the processes of a run are scheduled: on which processor, and before whom.
//!
//! Never changes the process that starts the others for longer than the start of one takes.

use crate::WrongUsage;
use rustix::thread::{CpuSet, sched_getaffinity, sched_setaffinity};
use std::io;
use thread_priority::{
    NormalThreadSchedulePolicy, RealtimeThreadSchedulePolicy, ThreadPriority, ThreadSchedulePolicy,
    set_thread_priority_and_policy, thread_native_id,
};

/// What the crate takes for niceness 0, on its scale from 0 to 99.
const ORDINARY: u8 = 47;

/// What a started process inherits.
#[derive(Debug, Clone, Default, clap::Args)]
pub(crate) struct Placement {
    /// Pin each process to one processor, round robin
    #[arg(long)]
    pub(crate) pin: bool,
    /// Run the processes in real-time class `SCHED_FIFO` with this priority, where that is permitted
    #[arg(long, value_name = "1 TO 99", value_parser = clap::value_parser!(u8).range(1..=99))]
    pub(crate) priority: Option<u8>,
}

impl Placement {
    /// As a process of ours is told of it.
    pub(crate) fn arguments(&self) -> Vec<String> {
        let pin = self.pin.then(|| "--pin".to_owned());
        pin.into_iter().chain(self.priority.map(|priority| format!("--priority={priority}"))).collect()
    }

    /// Whether the kernel lets us: tried on this thread, for a moment.
    pub(crate) fn check(&self) -> Result<(), WrongUsage> {
        let Some(priority) = self.priority else { return Ok(()) };
        let tried = set_fifo(priority).and_then(|()| set_normal());
        tried.map_err(|why| {
            WrongUsage(format!(
                "--priority {priority}: {why}; run as root, raise `ulimit -r`, or leave --priority out"
            ))
        })
    }

    /// Starts a process in the place number `place`: what this thread is for a moment, the process inherits.
    pub(crate) fn around<T>(&self, place: usize, start: impl FnOnce() -> io::Result<T>) -> io::Result<T> {
        let before = sched_getaffinity(None)?;
        if self.pin {
            sched_setaffinity(None, &one_of(&before, place))?;
        }
        let urgent = self.priority.map_or(Ok(()), set_fifo);
        let started = urgent.and_then(|()| start());
        if self.priority.is_some() {
            set_normal()?;
        }
        if self.pin {
            sched_setaffinity(None, &before)?;
        }
        started
    }
}

/// The processor number `place` of those in `all`, round robin.
fn one_of(all: &CpuSet, place: usize) -> CpuSet {
    let allowed: Vec<usize> = (0..CpuSet::MAX_CPU).filter(|cpu| all.is_set(*cpu)).collect();
    let mut one = CpuSet::new();
    one.set(allowed[place % allowed.len()]);
    one
}

fn set_fifo(priority: u8) -> io::Result<()> {
    let value = priority.try_into().map_err(io::Error::other)?;
    let policy = ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);
    set(ThreadPriority::Crossplatform(value), policy)
}

fn set_normal() -> io::Result<()> {
    let policy = ThreadSchedulePolicy::Normal(NormalThreadSchedulePolicy::Other);
    set(ThreadPriority::Crossplatform(ORDINARY.try_into().map_err(io::Error::other)?), policy)
}

fn set(priority: ThreadPriority, policy: ThreadSchedulePolicy) -> io::Result<()> {
    let refused = |error| match error {
        thread_priority::Error::OS(code) => io::Error::from_raw_os_error(code),
        other => io::Error::other(format!("{other:?}")),
    };
    set_thread_priority_and_policy(thread_native_id(), priority, policy).map_err(refused)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn processes_take_turns_at_the_processors_there_are() {
        let mut all = CpuSet::new();
        for cpu in [1, 5, 6] {
            all.set(cpu);
        }
        for (place, cpu) in [(0, 1), (1, 5), (2, 6), (3, 1)] {
            let one = one_of(&all, place);
            assert!(one.is_set(cpu) && one.count() == 1, "place {place}");
        }
    }

    #[test]
    fn an_urgent_start_leaves_this_thread_as_nice_as_it_was() {
        let urgent = Placement { pin: false, priority: Some(1) };
        if urgent.check().is_err() {
            return; // Not permitted here, and then refused.
        }
        urgent.around(0, || Ok(())).unwrap();
        assert_eq!(rustix::process::getpriority_process(None).unwrap(), 0);
    }

    #[test]
    fn a_started_process_inherits_its_processor_and_this_one_keeps_its_own() {
        let before = sched_getaffinity(None).unwrap();
        let pinned = Placement { pin: true, priority: None };
        let inside = pinned.around(1, || Ok(sched_getaffinity(None)?)).unwrap();
        assert!(inside.count() == 1 && inside == one_of(&before, 1));
        assert!(sched_getaffinity(None).unwrap() == before);
    }
}
