//! The launcher's side of the gate: it learns when the world holds, and asks it to end the flight.

use super::{
    Gate,
    layout::{FAULTS, HOLDS, STOP},
    wait_for_growth,
};
use std::{sync::atomic::Ordering::SeqCst, time::Duration};

impl Gate {
    /// Waits until the world has begun to hold more often than `seen` times, at most for `limit`; returns how often it
    /// has.
    pub fn wait_for_hold(&self, seen: u32, limit: Duration) -> u32 {
        wait_for_growth(&self.page[HOLDS], seen, limit)
    }

    /// Announces that `count` faults were added during the run.
    pub fn set_faults(&self, count: u32) {
        self.page[FAULTS].store(count, SeqCst);
    }

    /// Asks the world to end the flight after the tick that is open.
    pub fn request_stop(&self) {
        self.page[STOP].store(1, SeqCst);
        self.nudge_world();
    }
}
