//! Whether to give way, to sleep, or neither, while something is waited for.
//!
//! Never decides what is waited for, nor whether it has come.

use crate::monotonic_ns;
use rustix::{
    thread::{ClockId, clock_nanosleep_absolute},
    time::Timespec,
};
use std::{
    hint::spin_loop,
    thread::available_parallelism,
    time::{Duration, Instant},
};

/// Decides whether to give way to others for a moment before sleeping, from what that brought lately.
///
/// Where processes alternate on few cores, `sched_yield` hands over in a fraction of the time a sleep takes; beside a
/// busy foreign process it gives away whole time slices. So yields are tried only while they pay.
#[derive(Debug)]
pub struct Patience(Manner);

#[derive(Debug)]
enum Manner {
    /// Yields so often before it sleeps.
    Eager { yields: u32, waits_until_retry: u32 },
    /// Sleeps, but for the time around the moment that it waits for.
    Punctual { waits_until_retry: u32, retry_after: u32 },
    /// Never sleeps.
    Restless,
}

/// When the awaited comes, and how long before that it is worth being awake.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Due {
    /// By the monotonic clock.
    pub at_ns: u64,
    /// Those who wait stand by for so long before, and at most as long after; 0: nobody does.
    pub lead_ns: u64,
}

impl Due {
    /// How long until those who wait should stand by; for ever when that time is over, or never was.
    pub(crate) fn until_stand_by(self, now_ns: u64) -> Duration {
        let Self { at_ns, lead_ns } = self;
        if lead_ns == 0 || now_ns > at_ns.saturating_add(lead_ns) {
            return Duration::MAX;
        }
        Duration::from_nanos(at_ns.saturating_sub(lead_ns).saturating_sub(now_ns))
    }
}

/// The eager yield no oftener in one wait.
const MOST_YIELDS: u32 = 20;
/// The eager, once tired, try again after so many waits.
const EAGER_AGAIN_AFTER: u32 = 256;
/// The punctual, disappointed once, stand by again after so many waits; twice as many each further time.
const PUNCTUAL_AGAIN_AFTER: u32 = 8;
/// But after no more than these.
const PUNCTUAL_AGAIN_AT_LAST: u32 = 4096;
/// A yield that takes this long has run somebody else's time slice.
const LONG_YIELD: Duration = Duration::from_micros(500);

impl Patience {
    /// For waits that end within microseconds, as in lockstep.
    pub fn eager() -> Self {
        Self(Manner::Eager { yields: MOST_YIELDS, waits_until_retry: 0 })
    }

    /// For waits until a moment that is known, as in real time: sleeps, and stands by when it is near.
    ///
    /// Whoever is awake already, with warm caches, is a context switch away from the tick; a sleeper on an idle core,
    /// an interrupt, a context switch and a cold start.
    pub fn punctual() -> Self {
        Self(Manner::Punctual { waits_until_retry: 0, retry_after: PUNCTUAL_AGAIN_AFTER })
    }

    /// Never sleeps: looks again and again, and gives way in between.
    pub fn restless() -> Self {
        Self(Manner::Restless)
    }

    /// Whether it never sleeps.
    pub(crate) fn is_restless(&self) -> bool {
        matches!(self.0, Manner::Restless)
    }

    /// Yields until `condition` holds; false when it is time to sleep instead.
    pub(crate) fn yield_until(&mut self, condition: impl Fn() -> bool) -> bool {
        if condition() {
            return true;
        }
        match &mut self.0 {
            Manner::Eager { yields, waits_until_retry } => {
                if *yields == 0 {
                    *waits_until_retry -= 1;
                    if *waits_until_retry > 0 {
                        return false;
                    }
                    *yields = MOST_YIELDS;
                }
                let paid = yields_pay_until(*yields, &condition);
                *yields = if paid == Some(true) { (*yields * 2).min(MOST_YIELDS) } else { *yields / 2 };
                *waits_until_retry = EAGER_AGAIN_AFTER;
                paid.is_some()
            }
            Manner::Punctual { .. } => false,
            Manner::Restless => look_again_until(condition),
        }
    }

    /// What to stand by for in a wait that begins now, when `due` is the moment: nothing while that does not pay.
    pub(crate) fn stands_by_for(&mut self, due: Due) -> Due {
        match &mut self.0 {
            Manner::Punctual { waits_until_retry: 0, .. } => due,
            Manner::Punctual { waits_until_retry, .. } => {
                *waits_until_retry -= 1;
                Due::default()
            }
            Manner::Eager { .. } | Manner::Restless => Due::default(),
        }
    }

    /// Yields until `condition` holds, or the time around `due` is over, or yields do not pay.
    pub(crate) fn stand_by(&mut self, due: Due, condition: impl Fn() -> bool) {
        let Manner::Punctual { waits_until_retry, retry_after } = &mut self.0 else { return };
        let mut now_ns = monotonic_ns();
        while !condition() && due.until_stand_by(now_ns).is_zero() {
            std::thread::yield_now();
            let then_ns = std::mem::replace(&mut now_ns, monotonic_ns());
            if now_ns - then_ns > LONG_YIELD.as_nanos() as u64 {
                *waits_until_retry = *retry_after;
                *retry_after = (*retry_after * 2).min(PUNCTUAL_AGAIN_AT_LAST);
                return;
            }
        }
        *retry_after = (*retry_after / 2).max(PUNCTUAL_AGAIN_AFTER);
    }

    /// Waits until `due`, or until `is_over`, at which it looks whenever a signal came.
    pub fn wait_until(&mut self, due: Due, is_over: impl Fn() -> bool) {
        let mut standing_by = self.stands_by_for(due);
        let is_done = || monotonic_ns() >= due.at_ns || is_over();
        while !is_done() {
            let now_ns = monotonic_ns();
            let nap = standing_by.until_stand_by(now_ns);
            if self.is_restless() {
                std::thread::yield_now();
            } else if nap.is_zero() {
                self.stand_by(standing_by, is_done);
                standing_by = Due::default();
            } else {
                sleep_until(
                    Duration::from_nanos(now_ns).saturating_add(nap).min(Duration::from_nanos(due.at_ns)),
                );
            }
        }
    }
}

/// How many share a core when there are so many processes.
pub fn crowd(processes: u32) -> u32 {
    processes.div_ceil(available_parallelism().map_or(1, |cores| cores.get() as u32))
}

/// Whether `condition` held after one of so many `yields`, and soon.
fn yields_pay_until(yields: u32, condition: impl Fn() -> bool) -> Option<bool> {
    let start = Instant::now();
    (0..yields)
        .any(|_| {
            std::thread::yield_now();
            condition()
        })
        .then(|| start.elapsed() < LONG_YIELD)
}

/// Sleeps until then by the monotonic clock, or until a signal.
fn sleep_until(then: Duration) {
    let then = Timespec { tv_sec: then.as_secs().cast_signed(), tv_nsec: i64::from(then.subsec_nanos()) };
    // What ends the sleep early is for the caller to look at.
    let _ = clock_nanosleep_absolute(ClockId::Monotonic, &then);
}

/// How often a restless one looks between two yields: on a core of its own it sees at once what another writes.
const LOOKS_PER_YIELD: u32 = 100;
/// After so many yields it looks up from the gate.
const YIELDS_PER_LOOK_UP: u32 = 100;

fn look_again_until(condition: impl Fn() -> bool) -> bool {
    for _ in 0..YIELDS_PER_LOOK_UP {
        for _ in 0..LOOKS_PER_YIELD {
            if condition() {
                return true;
            }
            spin_loop();
        }
        std::thread::yield_now();
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    fn yields(patience: &Patience) -> u32 {
        let Manner::Eager { yields, .. } = patience.0 else { panic!("{patience:?} is not eager") };
        yields
    }

    #[test]
    fn patience_ends_while_yields_do_not_pay_and_comes_back() {
        let mut patience = Patience::eager();
        for _ in 0..10 {
            assert!(!patience.yield_until(|| false));
        }
        assert_eq!(yields(&patience), 0);
        let comes_back = (0..EAGER_AGAIN_AFTER).any(|_| {
            patience.yield_until(|| false);
            yields(&patience) > 0
        });
        assert!(comes_back);
    }

    #[test]
    fn the_restless_never_tire() {
        let mut patience = Patience::restless();
        for _ in 0..10 {
            assert!(!patience.yield_until(|| false));
        }
        assert!(patience.is_restless() && patience.yield_until(|| true));
    }

    #[test]
    fn the_time_to_stand_by_is_around_what_is_due() {
        let due = Due { at_ns: 1000, lead_ns: 200 };
        let until = |now_ns| due.until_stand_by(now_ns);
        assert_eq!(until(300), Duration::from_nanos(500));
        assert_eq!([until(800), until(1000), until(1200)], [Duration::ZERO; 3]);
        assert_eq!(until(1201), Duration::MAX);
        assert_eq!(Due { lead_ns: 0, ..due }.until_stand_by(300), Duration::MAX);
        assert_eq!(Due { at_ns: 1000, lead_ns: 2000 }.until_stand_by(0), Duration::ZERO);
    }

    #[test]
    fn the_punctual_stand_by_for_no_longer_than_the_lead_on_both_sides() {
        let mut patience = Patience::punctual();
        let due = Due { at_ns: monotonic_ns() + 100_000, lead_ns: 200_000 };
        assert_eq!(patience.stands_by_for(due), due);
        assert!(!patience.yield_until(|| false), "the punctual yielded before it was time");
        patience.stand_by(due, || false);
        let Manner::Punctual { waits_until_retry, .. } = patience.0 else { panic!("{patience:?}") };
        assert!(waits_until_retry > 0 || monotonic_ns() > due.at_ns + due.lead_ns);
    }

    #[test]
    fn the_punctual_sleep_while_yields_give_time_slices_away() {
        let mut patience = Patience::punctual();
        let due = || Due { at_ns: monotonic_ns(), lead_ns: 1_000_000_000 };
        let steal = || {
            std::thread::sleep(2 * LONG_YIELD);
            false
        };
        let sleeps_through = |patience: &mut Patience| {
            (0..2 * PUNCTUAL_AGAIN_AT_LAST)
                .take_while(|_| patience.stands_by_for(due()) == Due::default())
                .count()
        };
        for often in [8, 16, 32] {
            patience.stand_by(due(), steal);
            assert_eq!(sleeps_through(&mut patience), often);
        }
        patience.stand_by(due(), || true);
        patience.stand_by(due(), steal);
        assert_eq!(sleeps_through(&mut patience), 32, "success brings it back sooner");
    }

    #[test]
    fn whoever_waits_until_a_moment_is_never_early_and_may_be_called_off() {
        for mut patience in [Patience::punctual(), Patience::restless()] {
            for lead_ns in [0, 300_000] {
                let due = Due { at_ns: monotonic_ns() + 2_000_000, lead_ns };
                patience.wait_until(due, || false);
                assert!(monotonic_ns() >= due.at_ns);
            }
            patience.wait_until(Due { at_ns: u64::MAX, lead_ns: 0 }, || true);
        }
    }
}
