//! The tick gate: one shared page at which the processes of a run step through time together.
//!
//! [`Gate`] has the methods for all of them, each group in its own file: the world opens ticks, agents and leader
//! answer them, the recorder reads in batches, and the launcher watches over them.
//!
//! The gate must never carry data: it wakes processes and counts answers. Samples are stamped with their tick, and
//! these stamps tell which agent has answered. So if a process is killed between any two writes here, the others wait
//! for a time limit at most, never for ever.

mod answerer;
mod launcher;
mod layout;
mod recorder;
mod world;

pub use answerer::Wait;

use crate::{BusError, futex, page::Page, usable_cores};
use layout::{BATCH, CLOSED, LINES, NOT_HELD, NUDGES, ROUND, tick_of};
use ringwing_flight::{Part, Tick};
use std::{
    path::Path,
    sync::{
        Arc,
        atomic::{AtomicU32, Ordering::SeqCst},
    },
    time::Duration,
};

/// The tick gate of a run as one process sees it.
#[derive(Debug, Clone)]
pub struct Gate {
    page: Arc<Page>,
    missed: Option<Tick>,
}

impl Gate {
    /// Creates the gate of a new domain in the file `path`.
    pub(crate) fn create(path: &Path) -> Result<Self, BusError> {
        let page = Page::create(path, LINES).map_err(BusError::file(path))?;
        let gate = Self { page: Arc::new(page), missed: None };
        // A new page is all zeros, and 0 would mean that the world holds tick 0.
        gate.release();
        gate.set_cores(usable_cores());
        Ok(gate)
    }

    /// Opens the gate that another process created in the file `path`.
    pub(crate) fn open(path: &Path) -> Result<Self, BusError> {
        let page = Page::open(path, LINES).map_err(BusError::file(path))?;
        Ok(Self { page: Arc::new(page), missed: None })
    }

    /// The tick that is open; `None` before the first one and after the last.
    pub fn tick(&self) -> Option<Tick> {
        match self.page[ROUND].load(SeqCst) {
            0 | CLOSED => None,
            round => Some(tick_of(round)),
        }
    }

    /// Whether the flight is over.
    pub fn is_closed(&self) -> bool {
        self.page[ROUND].load(SeqCst) == CLOSED
    }

    /// Ends the flight for every process. A closed gate stays closed.
    pub fn close(&self) {
        self.page[ROUND].store(CLOSED, SeqCst);
        futex::wake_all(&self.page[ROUND]);
        // The recorder and the world sleep on words of their own.
        self.call_recorder();
        self.nudge_world();
    }

    /// The tick that the world does not open before the launcher has applied the faults due.
    pub fn held(&self) -> Option<Tick> {
        Some(self.page[layout::HELD].load(SeqCst)).filter(|tick| *tick != NOT_HELD).map(Tick)
    }

    /// The process that is ready as `part`.
    pub fn ready_process(&self, part: Part) -> Option<u32> {
        Some(self.page[layout::ready(part)].load(SeqCst)).filter(|pid| *pid != 0)
    }

    /// Notes that the process `pid` is ready as `part`, or that no process is.
    pub fn set_ready_process(&self, part: Part, pid: Option<u32>) {
        self.page[layout::ready(part)].store(pid.unwrap_or(0), SeqCst);
    }

    /// Which process of `part` is the newest, counted from 1: its *incarnation*, and the boards that belong to it.
    pub fn incarnation(&self, part: Part) -> u32 {
        self.page[layout::incarnation(part)].load(SeqCst)
    }

    /// How many cores the processes of the run share. A process that is pinned to one cannot see that by itself.
    pub fn cores(&self) -> u32 {
        self.page[layout::CORES].load(SeqCst)
    }

    /// Whether the open tick goes into the journal, so that agents have to account for their commands.
    pub fn records(&self) -> bool {
        self.page[layout::RECORDS].load(SeqCst) == 1
    }

    /// Whether the process that is ready as `part` has answered the open tick, or has no part in it.
    pub fn has_answered(&self, part: Part) -> bool {
        self.tick().is_none_or(|tick| self.page[layout::answered(part)].load(SeqCst) >= tick.0)
    }

    /// Wakes the recorder, so that it reads everything sent so far.
    pub fn call_recorder(&self) {
        self.page[BATCH].fetch_add(1, SeqCst);
        futex::wake_all(&self.page[BATCH]);
    }

    /// Wakes the world, whatever it waits for, to check again.
    pub fn nudge_world(&self) {
        self.page[NUDGES].fetch_add(1, SeqCst);
        futex::wake_all(&self.page[NUDGES]);
        // In lockstep, while a tick is open, the world sleeps on the count of answers instead of the nudges.
        futex::wake_all(&self.page[layout::ANSWERS]);
    }
}

/// Waits until `counter` is no longer `seen`, at most for `limit`; returns its value.
fn wait_for_growth(counter: &AtomicU32, seen: u32, limit: Duration) -> u32 {
    if counter.load(SeqCst) == seen {
        futex::wait(counter, seen, limit);
    }
    counter.load(SeqCst)
}

#[cfg(test)]
mod tests;
