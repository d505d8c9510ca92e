//! The recorder's side of the gate: it reads in batches and reports how far it has come.
//!
//! Must never open or answer a tick.

use super::{
    Gate,
    layout::{BATCH, RECORDED},
    wait_for_growth,
};
use ringwing_flight::Tick;
use std::{sync::atomic::Ordering::SeqCst, time::Duration};

impl Gate {
    /// Waits for a batch other than `seen`, at most for `limit`; returns the newest batch.
    pub fn wait_for_batch(&self, seen: u32, limit: Duration) -> u32 {
        wait_for_growth(&self.page[BATCH], seen, limit)
    }

    /// Reports that every sample up to `tick` is read.
    pub fn set_recorded(&self, tick: Tick) {
        self.page[RECORDED].store(tick.0, SeqCst);
        // The world may hold the next tick until the recorder has caught up.
        self.nudge_world();
    }
}
