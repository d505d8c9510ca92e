//! The world's side of the gate: it opens ticks, waits for answers, and holds a tick for the launcher.
//!
//! Must never answer a tick.

use super::{
    Gate,
    layout::{
        ANSWERS, CLOSED, DUE_AT_NS, DUE_LEAD_NS, EXPECTED, HELD, HOLDS, NOT_HELD, NUDGES, RECORDED, RECORDS,
        ROUND, SLEEPERS, STOP, WORLD_SLEEPS, round_of,
    },
};
use crate::{Due, WaitStrategy, futex};
use ringwing_flight::Tick;
use std::{
    sync::atomic::Ordering::{Relaxed, SeqCst},
    time::Duration,
};

/// How many ticks the recorder reads at once in lockstep. More make the log lag further behind and let more be lost
/// with a recorder that dies; fewer wake it, and slow the swarm down, more often.
const BATCH_TICKS: i64 = 16;

impl Gate {
    /// Opens `tick`, which `expected` processes will answer. All they need must be published before.
    ///
    /// Does nothing at a closed gate: the flight is over, whoever ended it.
    pub fn open_tick(&self, tick: Tick, expected: u32) {
        // Opening the round orders these two stores: whoever sees the round sees them.
        self.page[EXPECTED].store(expected, Relaxed);
        self.page[ANSWERS].store(0, Relaxed);
        let open = |round| (round != CLOSED).then_some(round_of(tick));
        if self.page[ROUND].fetch_update(SeqCst, SeqCst, open).is_err() {
            return;
        }
        // Make the system call only if somebody sleeps.
        if self.page[SLEEPERS].load(SeqCst) > 0 {
            futex::wake_all(&self.page[ROUND]);
        }
        if tick.0 % BATCH_TICKS == 0 {
            self.call_recorder();
        }
    }

    /// Says whether the next tick goes into the journal. To be called before the tick opens, which orders the store: all
    /// agents must see the same answer, or the log would lack some of their accounts.
    pub fn set_records(&self, records: bool) {
        self.page[RECORDS].store(u32::from(records), Relaxed);
    }

    /// Tells waiting processes when the next tick is due, so that they can be awake by then.
    pub fn set_due(&self, due: Due) {
        // Opening the next tick orders these stores.
        self.page[DUE_AT_NS].store(due.at_ns.cast_signed(), Relaxed);
        self.page[DUE_LEAD_NS].store(due.lead_ns.cast_signed(), Relaxed);
    }

    /// Waits until all expected answers have come, at most for `limit`, or until somebody nudges the world.
    pub fn wait_for_answers(&self, strategy: &mut WaitStrategy, limit: Duration) {
        let answers = || self.page[ANSWERS].load(SeqCst);
        if strategy.yield_until_counted(|| self.is_answered(), answers) || strategy.never_sleeps() {
            return;
        }
        // Announce the sleep before the last look: an answer that comes in between then wakes the world.
        self.page[WORLD_SLEEPS].store(1, SeqCst);
        let answers = self.page[ANSWERS].load(SeqCst);
        if answers < self.page[EXPECTED].load(SeqCst) {
            futex::wait(&self.page[ANSWERS], answers, limit);
        }
        self.page[WORLD_SLEEPS].store(0, SeqCst);
    }

    /// Whether as many processes have answered as the world expects.
    pub fn is_answered(&self) -> bool {
        self.missing_answers() == 0
    }

    /// How many of the answers that the world expects have not come.
    pub(crate) fn missing_answers(&self) -> u32 {
        self.page[EXPECTED].load(SeqCst).saturating_sub(self.page[ANSWERS].load(SeqCst))
    }

    /// How many times the world was nudged. When this has grown, there is news besides the answers.
    pub fn nudges(&self) -> u32 {
        self.page[NUDGES].load(SeqCst)
    }

    /// Waits until the count of nudges is no longer `seen`, at most for `limit`.
    pub fn wait_for_nudge(&self, seen: u32, limit: Duration) {
        futex::wait(&self.page[NUDGES], seen, limit);
    }

    /// Announces that `tick` stays closed until the launcher has applied the faults due.
    pub fn hold_before(&self, tick: Tick) {
        // Write the tick before the count grows: the launcher waits for the count and then reads the tick.
        self.page[HELD].store(tick.0, SeqCst);
        self.page[HOLDS].fetch_add(1, SeqCst);
        futex::wake_all(&self.page[HOLDS]);
    }

    /// Announces that the world no longer holds.
    pub fn release(&self) {
        self.page[HELD].store(NOT_HELD, SeqCst);
    }

    /// The last tick that the recorder has read.
    pub fn recorded(&self) -> Tick {
        Tick(self.page[RECORDED].load(SeqCst))
    }

    /// Whether the user wants the run to end.
    pub fn stop_requested(&self) -> bool {
        self.page[STOP].load(SeqCst) != 0
    }
}
