//! The launcher's side of the gate: it learns when the world holds, announces new incarnations of processes, and asks the
//! world to end the flight.
//!
//! Must never open or answer a tick.

use super::{
    Gate,
    layout::{self, FAULTS, HOLDS, STOP},
    wait_for_growth,
};
use ringwing_flight::Part;
use std::{sync::atomic::Ordering::SeqCst, time::Duration};

impl Gate {
    /// Waits until the count of the world's holds is no longer `seen`, at most for `limit`; returns the count.
    pub fn wait_for_hold(&self, seen: u32, limit: Duration) -> u32 {
        wait_for_growth(&self.page[HOLDS], seen, limit)
    }

    /// Announces that `count` faults were added during the run.
    pub fn set_faults(&self, count: u32) {
        self.page[FAULTS].store(count, SeqCst);
    }

    /// Sets how many cores the processes of the run share, if that is not all that this process may use. To be called
    /// before the first of them starts.
    pub fn set_cores(&self, cores: u32) {
        self.page[layout::CORES].store(cores, SeqCst);
    }

    /// Announces the number of `part`'s newest process, whose boards exist.
    pub(crate) fn set_incarnation(&self, part: Part, incarnation: u32) {
        self.page[layout::incarnation(part)].store(incarnation, SeqCst);
    }

    /// Asks the world to end the flight after the tick that is open.
    pub fn request_stop(&self) {
        self.page[STOP].store(1, SeqCst);
        self.nudge_world();
    }
}
