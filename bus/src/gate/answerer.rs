//! The gate's side for the processes that answer ticks: the agents and the leader.
//!
//! Must never open a tick.

use super::{
    Gate,
    layout::{
        ANSWERS, CLOSED, DUE_AT_NS, DUE_LEAD_NS, EXPECTED, FAULTS, ROUND, SLEEPERS, WORLD_SLEEPS, answered,
        round_of, tick_of,
    },
};
use crate::{Due, StopFlag, WaitStrategy, futex, monotonic_ns};
use ringwing_flight::{Part, Tick};
use std::sync::atomic::Ordering::{Relaxed, SeqCst};

/// Why a wait at the gate ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wait {
    /// This tick is open.
    Tick(Tick),
    /// The flight is over.
    Closed,
    /// The process was asked to stop.
    Stopped,
}

impl Gate {
    /// Waits until a tick other than `seen` is open, the flight is over, or `stop` is set. Calls `rehearse` when it begins
    /// to stand by for a tick that is due.
    pub fn wait(
        &self,
        seen: Option<Tick>,
        strategy: &mut WaitStrategy,
        stop: &StopFlag,
        rehearse: impl FnMut(),
    ) -> Wait {
        // Round 0 means that no tick was opened yet, so a process that has seen none waits for any.
        let old = seen.map_or(0, round_of);
        let is_over = || self.page[ROUND].load(SeqCst) != old || stop.is_set();
        // A spinning strategy returns after a bounded number of checks although nothing has happened.
        while strategy.never_sleeps() && !is_over() {
            strategy.yield_until(is_over);
        }
        if !strategy.yield_until(is_over) {
            self.sleep_until(old, strategy, is_over, rehearse);
        }
        self.current(stop)
    }

    /// Sleeps until `is_over`, but stands by, awake, around the time when the next tick is due.
    fn sleep_until(
        &self,
        old: u32,
        strategy: &mut WaitStrategy,
        is_over: impl Fn() -> bool + Copy,
        mut rehearse: impl FnMut(),
    ) {
        // Count this sleeper before the first look: a tick that opens in between then wakes it.
        self.page[SLEEPERS].fetch_add(1, SeqCst);
        let mut due = strategy.stands_by_for(self.due());
        while !is_over() {
            let nap = due.until_stand_by(monotonic_ns());
            if nap.is_zero() {
                rehearse();
                strategy.stand_by(due, is_over);
                due = Due::default();
            } else {
                futex::wait(&self.page[ROUND], old, nap);
            }
        }
        self.page[SLEEPERS].fetch_sub(1, SeqCst);
    }

    /// The state of the gate if it is no longer what it was at tick `seen`.
    pub(crate) fn news(&self, seen: Option<Tick>, stop: &StopFlag) -> Option<Wait> {
        let is_new = self.page[ROUND].load(SeqCst) != seen.map_or(0, round_of) || stop.is_set();
        is_new.then(|| self.current(stop))
    }

    /// When the next tick is due; the default in lockstep, and before the first.
    pub(crate) fn due(&self) -> Due {
        let [at_ns, lead_ns] =
            [DUE_AT_NS, DUE_LEAD_NS].map(|number| self.page[number].load(SeqCst).cast_unsigned());
        Due { at_ns, lead_ns }
    }

    fn current(&self, stop: &StopFlag) -> Wait {
        match self.page[ROUND].load(SeqCst) {
            _ if stop.is_set() => Wait::Stopped,
            CLOSED => Wait::Closed,
            round => Wait::Tick(tick_of(round)),
        }
    }

    /// Answers `tick` as `part`. Everything that this process sends for it must be published before.
    pub fn answer(&self, part: Part, tick: Tick) {
        // The next line orders this store, too.
        self.page[answered(part)].store(tick.0, Relaxed);
        let answers = self.page[ANSWERS].fetch_add(1, SeqCst) + 1;
        // Only the last answer wakes the world, and only if it sleeps.
        if answers >= self.page[EXPECTED].load(SeqCst) && self.page[WORLD_SLEEPS].load(SeqCst) != 0 {
            futex::wake_all(&self.page[ANSWERS]);
        }
    }

    /// The tick that was open and already answered by all when this process joined. It must not answer that one.
    pub fn missed(&self) -> Option<Tick> {
        self.missed
    }

    /// Notes the tick that this process missed. To be called before the process announces that it is ready: after that
    /// the world may go on.
    pub(crate) fn note_missed(&mut self, part: Part) {
        // While the world holds a tick, the one before is complete. Do not look at the open tick for that: the world may go
        // on at any moment.
        self.missed = self.held().map(|held| Tick(held.0 - 1));
        // Also without a missed tick: a predecessor's answers must not count as this process's.
        let answered_before = self.missed.map_or(i64::MIN, |tick| tick.0);
        self.page[answered(part)].store(answered_before, SeqCst);
    }

    /// How many faults were added during the run. When this has grown, the launcher's list of them has changed.
    pub fn faults(&self) -> u32 {
        self.page[FAULTS].load(SeqCst)
    }
}
