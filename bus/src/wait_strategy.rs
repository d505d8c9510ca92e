//! How a process spends a wait: spinning, yielding its core, or sleeping.
//!
//! Never decides what is waited for, nor whether it has come.

use crate::monotonic_ns;
use rustix::{
    thread::{ClockId, clock_nanosleep_absolute},
    time::Timespec,
};
use std::{
    hint::spin_loop,
    mem,
    thread::{available_parallelism, yield_now},
    time::Duration,
};

/// Decides for each wait whether to yield before sleeping, from what yielding brought in the last ones.
///
/// Where processes alternate on few cores, `sched_yield` hands over in a fraction of the time that a sleep takes.
/// Beside a busy foreign process it gives away whole time slices instead. So a process yields only while that pays.
#[derive(Debug)]
pub struct WaitStrategy(Kind);

#[derive(Debug)]
enum Kind {
    /// Yields for a while, then sleeps.
    Yielding(YieldPolicy),
    /// Sleeps, but yields around the time when the end of the wait is due.
    Timed { waits_until_retry: u32, retry_after: u32 },
    /// Never sleeps.
    Spinning,
}

/// When a wait should end, and how long before that a process should be awake.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Due {
    /// Nanoseconds of the monotonic clock.
    pub at_ns: u64,
    /// A waiting process stands by for this long before, and at most as long after; 0: it does not stand by.
    pub lead_ns: u64,
}

impl Due {
    /// How long until a waiting process should stand by; [`Duration::MAX`] if that time has passed or the process
    /// does not stand by at all.
    pub(crate) fn until_stand_by(self, now_ns: u64) -> Duration {
        let Self { at_ns, lead_ns } = self;
        if lead_ns == 0 || now_ns > at_ns.saturating_add(lead_ns) {
            return Duration::MAX;
        }
        Duration::from_nanos(at_ns.saturating_sub(lead_ns).saturating_sub(now_ns))
    }
}

/// Yields per wait before falling back to a futex, at least. With fewer, a process in a crowd falls asleep although the
/// others are about to have their turn; more keep it awake during waits that are long anyway.
const YIELDS_MIN: u32 = 20;
/// How long a process yields before falling back to a futex, at least. A shorter time lets a process on an idle core,
/// where a yield returns at once, fall asleep before its partner on the other core can have answered; then each of the
/// two waits for the other to wake up. A longer time burns CPU in long waits.
const YIELDING_MIN_NS: u64 = 100_000;
/// How long a process sleeps at once after a yield that cost a time slice. The time doubles with each further such
/// yield. A longer time makes a single disturbance slow down more ticks; a shorter one gives more slices away.
const PAUSE_MIN_NS: u64 = 1_000_000;
/// Where the doubling ends. With more, a process notices later that a lasting disturbance is over; with less, it keeps
/// giving slices away to a busy foreign process.
const PAUSE_MAX_NS: u64 = 256_000_000;
/// After how many waits a timed process stands by again, the first time that it cost a time slice. The number doubles
/// with each further time. More lose punctuality after one disturbance; fewer keep paying for a lasting one.
const TIMED_RETRY_WAITS_MIN: u32 = 8;
/// Where the doubling ends. With more, a process notices only minutes later that a disturbance is over; with fewer, it
/// keeps paying for a lasting one.
const TIMED_RETRY_WAITS_MAX: u32 = 4096;
/// A yield that takes at least this long has run another process's time slice, where no other process of the run shares
/// the core. A smaller value mistakes ordinary hand-overs for time slices; a larger one misses short time slices.
const LONG_YIELD_NS: u64 = 500_000;
/// How much longer a yield may take for each process of the run that shares the core: all of them may have their turn
/// before it returns. A smaller value makes a crowd take its own work for a disturbance, and fall asleep.
const TURN_NS: u64 = 40_000;
/// How long a process that waits for answers stays on its core after a yield, while none comes. By then the others on this
/// core have had their turn, and the missing answers come from other cores, one every few microseconds. A longer time
/// keeps a core from those who still have to answer; with a shorter one the process yields right before the last answer, and
/// all others on its core have their turn for nothing before it can go on.
const STAY_NS: u64 = 6_000;
/// How often a spinning process checks between two yields. More see a change sooner on a core of its own; fewer waste
/// less where processes share one.
const CHECKS_PER_YIELD: u32 = 100;
/// After how many yields a spinning wait returns to its caller, which may have more to check. More delay that; fewer
/// cost calls.
const YIELDS_PER_SPIN: u32 = 100;

impl WaitStrategy {
    /// For waits that end within microseconds, as in lockstep, in a run of `processes` that share so many `cores`: yields first,
    /// then sleeps.
    pub fn yielding(processes: u32, cores: u32) -> Self {
        Self(Kind::Yielding(YieldPolicy::new(processes, cores)))
    }

    /// For waits until a time that is known, as in real time: sleeps, and is awake around that time.
    ///
    /// A process that is awake, with warm caches, is one context switch away from its tick. A sleeping one needs an
    /// interrupt, often the wake-up of an idle core, a context switch, and a start with cold caches.
    pub fn timed() -> Self {
        Self(Kind::Timed { waits_until_retry: 0, retry_after: TIMED_RETRY_WAITS_MIN })
    }

    /// Never sleeps: checks again and again, and yields in between.
    pub fn spinning() -> Self {
        Self(Kind::Spinning)
    }

    /// Whether it never sleeps.
    pub(crate) fn never_sleeps(&self) -> bool {
        matches!(self.0, Kind::Spinning)
    }

    /// Yields until `condition` holds; false when it is time to sleep, or for a spinning process to look around.
    pub(crate) fn yield_until(&mut self, condition: impl Fn() -> bool) -> bool {
        self.yield_and_stay_until(condition, |now_ns| now_ns)
    }

    /// Like [`yield_until`](Self::yield_until), for a process that waits for several others on other cores: it keeps its
    /// core while `count` grows.
    pub(crate) fn yield_until_counted(
        &mut self,
        condition: impl Fn() -> bool,
        count: impl Fn() -> u32,
    ) -> bool {
        let stay_ns = if let Kind::Yielding(policy) = &self.0 { policy.stay_ns } else { 0 };
        let stay = |now_ns| stay_while_growing(now_ns, stay_ns, &condition, &count);
        self.yield_and_stay_until(&condition, stay)
    }

    /// Yields until `condition` holds, and calls `stay` between two yields, which may keep the core for a while.
    fn yield_and_stay_until(&mut self, condition: impl Fn() -> bool, stay: impl Fn(u64) -> u64) -> bool {
        if condition() {
            return true;
        }
        match &mut self.0 {
            Kind::Yielding(policy) => {
                let now_ns = monotonic_ns();
                if !policy.pays_at(now_ns) {
                    return false;
                }
                let outcome = yield_until(now_ns, policy.long_yield_ns, &condition, stay);
                policy.note(outcome);
                outcome.held
            }
            // In real time a wait lasts most of a period. Yielding from its start would burn all of it; `stand_by`
            // yields at its end.
            Kind::Timed { .. } => false,
            Kind::Spinning => spin_until(condition),
        }
    }

    /// When to stand by in a wait that begins now and should end at `due`. The answer is the default, which is never,
    /// while standing by does not pay.
    pub(crate) fn stands_by_for(&mut self, due: Due) -> Due {
        match &mut self.0 {
            // At 0 the process tries again. Otherwise this wait is one of those that it sleeps through.
            Kind::Timed { waits_until_retry: 0, .. } => due,
            Kind::Timed { waits_until_retry, .. } => {
                *waits_until_retry -= 1;
                Due::default()
            }
            Kind::Yielding(_) | Kind::Spinning => Due::default(),
        }
    }

    /// Yields until `condition` holds, the time around `due` is over, or a yield costs a time slice.
    pub(crate) fn stand_by(&mut self, due: Due, condition: impl Fn() -> bool) {
        let Kind::Timed { waits_until_retry, retry_after } = &mut self.0 else { return };
        let mut now_ns = monotonic_ns();
        // Ends by itself if the tick does not come: once it is late by the lead, the time to stand by is over.
        while !condition() && due.until_stand_by(now_ns).is_zero() {
            yield_now();
            let then_ns = mem::replace(&mut now_ns, monotonic_ns());
            if now_ns - then_ns > LONG_YIELD_NS {
                *waits_until_retry = *retry_after;
                *retry_after = (*retry_after * 2).min(TIMED_RETRY_WAITS_MAX);
                return;
            }
        }
        // Halve instead of starting over: a disturbance that comes and goes then still finds a long pause the next
        // time.
        *retry_after = (*retry_after / 2).max(TIMED_RETRY_WAITS_MIN);
    }

    /// Waits until `due`, or until `is_over`, which is checked whenever a signal has come. Calls `rehearse` when it begins to
    /// stand by.
    pub fn wait_until(&mut self, due: Due, is_over: impl Fn() -> bool, mut rehearse: impl FnMut()) {
        let mut standing_by = self.stands_by_for(due);
        let is_done = || monotonic_ns() >= due.at_ns || is_over();
        while !is_done() {
            let now_ns = monotonic_ns();
            let nap = standing_by.until_stand_by(now_ns);
            if self.never_sleeps() {
                yield_now();
            } else if nap.is_zero() {
                rehearse();
                // Stand by once: if that cost a time slice, the process sleeps for the rest of the wait.
                self.stand_by(standing_by, is_done);
                standing_by = Due::default();
            } else {
                let wake_up = Duration::from_nanos(now_ns).saturating_add(nap);
                sleep_until(wake_up.min(Duration::from_nanos(due.at_ns)));
            }
        }
    }
}

/// How many of `processes` share each of the `cores` when they are spread evenly.
pub fn processes_per_core(processes: u32, cores: u32) -> u32 {
    processes.div_ceil(cores.max(1))
}

/// How many cores of this machine the process may use.
pub fn usable_cores() -> u32 {
    available_parallelism().map_or(1, |cores| cores.get() as u32)
}

/// Decides whether yielding pays, from what the last yields cost.
#[derive(Debug)]
struct YieldPolicy {
    /// How long to keep the core while no answer comes; 0 if there is no other core from which one could come.
    stay_ns: u64,
    /// A yield that takes longer has cost a time slice.
    long_yield_ns: u64,
    /// Yielding does not pay before this time.
    pauses_until_ns: u64,
    /// How long to pause after the next yield that costs a time slice.
    pause_ns: u64,
}

impl YieldPolicy {
    /// The policy where so many processes of the run share so many cores.
    fn new(processes: u32, cores: u32) -> Self {
        let long_yield_ns = LONG_YIELD_NS + TURN_NS * u64::from(processes_per_core(processes, cores));
        let stay_ns = if cores > 1 { STAY_NS } else { 0 };
        Self { stay_ns, long_yield_ns, pauses_until_ns: 0, pause_ns: PAUSE_MIN_NS }
    }

    fn pays_at(&self, now_ns: u64) -> bool {
        now_ns >= self.pauses_until_ns
    }

    /// Takes note of what yielding brought.
    ///
    /// A wait that was merely long says nothing about the next one, so it changes nothing: processes that stopped
    /// yielding after long waits would make all waits long. Only a lost time slice tells of a disturbance.
    fn note(&mut self, outcome: YieldOutcome) {
        if outcome.lost_slice {
            self.pauses_until_ns = outcome.ended_ns + self.pause_ns;
            self.pause_ns = (self.pause_ns * 2).min(PAUSE_MAX_NS);
        } else if outcome.held {
            self.pause_ns = PAUSE_MIN_NS;
        }
    }
}

/// What yielding for a condition brought.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct YieldOutcome {
    /// Whether the condition holds.
    held: bool,
    /// Whether a yield cost a time slice.
    lost_slice: bool,
    /// When the last yield ended.
    ended_ns: u64,
}

/// Yields until `condition` holds, a yield takes `long_yield_ns`, or it is time to sleep. It is `start_ns` now. After a yield
/// that has not brought it, calls `stay` with the time, which returns the time of its end.
fn yield_until(
    start_ns: u64,
    long_yield_ns: u64,
    condition: impl Fn() -> bool,
    stay: impl Fn(u64) -> u64,
) -> YieldOutcome {
    let mut before_ns = start_ns;
    for yields in 1.. {
        yield_now();
        let mut now_ns = monotonic_ns();
        let lost_slice = now_ns - before_ns >= long_yield_ns;
        if !condition() && !lost_slice {
            now_ns = stay(now_ns);
        }
        let held = condition();
        // Both limits are needed: on an idle core all yields return at once, and in a crowd a few of them take the
        // whole time.
        let is_enough = yields >= YIELDS_MIN && now_ns - start_ns >= YIELDING_MIN_NS;
        if held || lost_slice || is_enough {
            return YieldOutcome { held, lost_slice, ended_ns: now_ns };
        }
        before_ns = now_ns;
    }
    unreachable!("the loop has no end")
}

/// Keeps the core until `condition` holds or `count` has not grown for `stay_ns`. It is `start_ns` now; returns the time of
/// the end.
fn stay_while_growing(
    start_ns: u64,
    stay_ns: u64,
    condition: impl Fn() -> bool,
    count: impl Fn() -> u32,
) -> u64 {
    let (mut counted, mut grew_ns, mut now_ns) = (count(), start_ns, start_ns);
    while !condition() && now_ns - grew_ns < stay_ns {
        spin_loop();
        now_ns = monotonic_ns();
        let before = mem::replace(&mut counted, count());
        if counted != before {
            grew_ns = now_ns;
        }
    }
    now_ns
}

/// Checks `condition` for a bounded number of times; returns whether it held.
fn spin_until(condition: impl Fn() -> bool) -> bool {
    for _ in 0..YIELDS_PER_SPIN {
        for _ in 0..CHECKS_PER_YIELD {
            if condition() {
                return true;
            }
            spin_loop();
        }
        yield_now();
    }
    false
}

/// Sleeps until the monotonic clock shows `time`, or until a signal.
fn sleep_until(time: Duration) {
    let time = Timespec { tv_sec: time.as_secs().cast_signed(), tv_nsec: i64::from(time.subsec_nanos()) };
    // A signal ends the sleep early; the caller checks why.
    let _ = clock_nanosleep_absolute(ClockId::Monotonic, &time);
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::Cell;

    const HELD: YieldOutcome = YieldOutcome { held: true, lost_slice: false, ended_ns: 0 };
    const NOT_HELD: YieldOutcome = YieldOutcome { held: false, ..HELD };

    fn lost_slice(ended_ns: u64) -> YieldOutcome {
        YieldOutcome { lost_slice: true, ended_ns, ..HELD }
    }

    /// Without the time.
    fn told(outcome: YieldOutcome) -> YieldOutcome {
        YieldOutcome { ended_ns: 0, ..outcome }
    }

    #[test]
    fn a_long_wait_does_not_keep_the_next_one_from_yielding() {
        let mut policy = YieldPolicy::new(2, 2);
        (0..100).for_each(|ended_ns| policy.note(YieldOutcome { ended_ns, ..NOT_HELD }));
        assert!(policy.pays_at(100));
    }

    #[test]
    fn after_a_lost_time_slice_a_process_yields_again_within_a_millisecond() {
        let mut policy = YieldPolicy::new(2, 2);
        policy.note(lost_slice(50));
        assert!(!policy.pays_at(50) && !policy.pays_at(49 + PAUSE_MIN_NS));
        assert!(policy.pays_at(50 + PAUSE_MIN_NS));
    }

    #[test]
    fn lasting_disturbances_make_the_pauses_longer_and_one_good_yield_makes_them_short_again() {
        let mut policy = YieldPolicy::new(2, 2);
        for pause_ns in [1, 2, 4, 8].map(|factor| factor * PAUSE_MIN_NS) {
            policy.note(lost_slice(0));
            assert!(!policy.pays_at(pause_ns - 1) && policy.pays_at(pause_ns));
        }
        (0..100).for_each(|_| policy.note(lost_slice(0)));
        assert!(policy.pays_at(PAUSE_MAX_NS));
        policy.note(HELD);
        policy.note(lost_slice(0));
        assert!(policy.pays_at(PAUSE_MIN_NS));
    }

    #[test]
    fn a_process_yields_often_and_long_enough_before_it_sleeps() {
        let (checks, start_ns) = (Cell::new(0_u32), monotonic_ns());
        let check = || {
            checks.set(checks.get() + 1);
            false
        };
        let outcome = yield_until(start_ns, u64::MAX, check, |now_ns| now_ns);
        assert_eq!(told(outcome), NOT_HELD);
        assert!(checks.get() >= YIELDS_MIN && monotonic_ns() - start_ns >= YIELDING_MIN_NS);
    }

    #[test]
    fn a_yield_that_takes_too_long_has_lost_a_time_slice() {
        assert_eq!(told(yield_until(monotonic_ns(), 0, || true, |now_ns| now_ns)), lost_slice(0));
        assert_eq!(told(yield_until(monotonic_ns(), u64::MAX, || true, |now_ns| now_ns)), HELD);
    }

    #[test]
    fn a_process_keeps_its_core_while_answers_come_and_gives_it_back_when_they_stop() {
        let counted = Cell::new(0);
        let count_to = |end: u32| {
            counted.set(end.min(counted.get() + 1));
            counted.get()
        };
        let start_ns = monotonic_ns();
        let end_ns = stay_while_growing(start_ns, STAY_NS, || counted.get() == 900, || count_to(900));
        assert_eq!(counted.get(), 900, "ended early, after {} ns", end_ns - start_ns);
        let start_ns = monotonic_ns();
        let end_ns = stay_while_growing(start_ns, STAY_NS, || false, || count_to(900));
        assert!(end_ns - start_ns >= STAY_NS && end_ns <= monotonic_ns());
        assert_eq!(stay_while_growing(7, STAY_NS, || true, || 0), 7);
    }

    #[test]
    fn a_process_keeps_its_core_only_if_others_have_one_too() {
        assert_eq!([1, 2, 8].map(|cores| YieldPolicy::new(8, cores).stay_ns), [0, STAY_NS, STAY_NS]);
        assert!(YieldPolicy::new(8, 1).long_yield_ns > YieldPolicy::new(8, 2).long_yield_ns);
    }

    #[test]
    fn a_spinning_process_never_gives_up() {
        let mut strategy = WaitStrategy::spinning();
        for _ in 0..10 {
            assert!(!strategy.yield_until(|| false));
        }
        assert!(strategy.never_sleeps() && strategy.yield_until(|| true));
    }

    #[test]
    fn the_time_to_stand_by_lies_around_the_due_time() {
        let due = Due { at_ns: 1000, lead_ns: 200 };
        let until = |now_ns| due.until_stand_by(now_ns);
        assert_eq!(until(300), Duration::from_nanos(500));
        assert_eq!([until(800), until(1000), until(1200)], [Duration::ZERO; 3]);
        assert_eq!(until(1201), Duration::MAX);
        assert_eq!(Due { lead_ns: 0, ..due }.until_stand_by(300), Duration::MAX);
        assert_eq!(Due { at_ns: 1000, lead_ns: 2000 }.until_stand_by(0), Duration::ZERO);
    }

    #[test]
    fn a_timed_process_stands_by_for_the_lead_on_both_sides_and_no_longer() {
        let mut strategy = WaitStrategy::timed();
        let due = Due { at_ns: monotonic_ns() + 100_000, lead_ns: 200_000 };
        assert_eq!(strategy.stands_by_for(due), due);
        assert!(!strategy.yield_until(|| false), "it yielded before it was time");
        strategy.stand_by(due, || false);
        let Kind::Timed { waits_until_retry, .. } = strategy.0 else { panic!("{strategy:?}") };
        assert!(waits_until_retry > 0 || monotonic_ns() > due.at_ns + due.lead_ns);
    }

    #[test]
    fn a_timed_process_sleeps_while_yields_give_time_slices_away() {
        let mut strategy = WaitStrategy::timed();
        let due = || Due { at_ns: monotonic_ns(), lead_ns: 1_000_000_000 };
        let steal = || {
            std::thread::sleep(Duration::from_nanos(2 * LONG_YIELD_NS));
            false
        };
        let waits_slept_through = |strategy: &mut WaitStrategy| {
            (0..2 * TIMED_RETRY_WAITS_MAX)
                .take_while(|_| strategy.stands_by_for(due()) == Due::default())
                .count()
        };
        for waits in [8, 16, 32] {
            strategy.stand_by(due(), steal);
            assert_eq!(waits_slept_through(&mut strategy), waits);
        }
        strategy.stand_by(due(), || true);
        strategy.stand_by(due(), steal);
        assert_eq!(waits_slept_through(&mut strategy), 32, "one success halves the next pause");
    }

    #[test]
    fn a_wait_until_a_due_time_never_ends_early_unless_it_is_called_off() {
        for mut strategy in [WaitStrategy::timed(), WaitStrategy::spinning()] {
            for lead_ns in [0, 300_000] {
                let due = Due { at_ns: monotonic_ns() + 2_000_000, lead_ns };
                strategy.wait_until(due, || false, || ());
                assert!(monotonic_ns() >= due.at_ns);
            }
            strategy.wait_until(Due { at_ns: u64::MAX, lead_ns: 0 }, || true, || ());
        }
    }
}
