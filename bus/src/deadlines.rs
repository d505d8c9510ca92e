//! When ticks are due in real time.
//!
//! Never reads a clock: callers give the time, in nanoseconds of the monotonic clock.

use crate::Due;

/// The deadlines of ticks in real time, one period apart.
///
/// They are absolute, so that small delays do not add up. A delay of a period or more moves all later deadlines:
/// simulated time falls behind the wall clock, and no burst of ticks hits the airframes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Deadlines {
    period_ns: u64,
    lead_ns: u64,
    due_ns: u64,
}

/// How long before a deadline processes wake up to stand by, at most. If it is larger, they burn more CPU; if it is
/// smaller, some processes of a small swarm are still waking up when the tick opens.
const LEAD_MAX_NS: u64 = 500_000;
/// The lead is at most one part in this many of the period. A smaller divisor burns more CPU at high rates.
const PERIODS_PER_LEAD: u64 = 20;
/// Most processes per core that stand by. With more, their turns take so long that standing by gains nothing: at 100 per
/// core, ticks are as slow as without. With fewer, swarms whose processes could stand by wake them one after another
/// instead: at 16 per core, ticks take twice as long.
const CROWD_MAX: u32 = 32;

/// How late a tick ended.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Lateness {
    /// Time since the deadline.
    pub late_ns: u64,
    /// How many later deadlines have passed as well.
    pub missed_deadlines: u32,
}

impl Deadlines {
    /// Deadlines that begin one period after `now_ns`. `crowd` is the number of processes on each core.
    pub fn new(rate_hz: u32, crowd: u32, now_ns: u64) -> Self {
        let period_ns = 1_000_000_000 / u64::from(rate_hz);
        Self { period_ns, lead_ns: lead_ns(period_ns, crowd), due_ns: now_ns + period_ns }
    }

    /// Sets the next deadline to one period after `now_ns`.
    pub fn restart(&mut self, now_ns: u64) {
        self.due_ns = now_ns + self.period_ns;
    }

    /// The next deadline.
    pub fn due(&self) -> Due {
        Due { at_ns: self.due_ns, lead_ns: self.lead_ns }
    }

    /// Ends the tick at `now_ns` and sets the next deadline: the first one of the old grid that is still to come.
    pub fn advance(&mut self, now_ns: u64) -> Lateness {
        let late_ns = now_ns.saturating_sub(self.due_ns);
        let missed = late_ns / self.period_ns;
        self.due_ns += (missed + 1) * self.period_ns;
        Lateness { late_ns, missed_deadlines: u32::try_from(missed).unwrap_or(u32::MAX) }
    }
}

/// Whether so many processes on each core are too many to stand by for a tick.
pub(crate) fn is_crowd(processes_per_core: u32) -> bool {
    processes_per_core > CROWD_MAX
}

fn lead_ns(period_ns: u64, crowd: u32) -> u64 {
    if is_crowd(crowd) { 0 } else { LEAD_MAX_NS.min(period_ns / PERIODS_PER_LEAD) }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: u64 = 1_000_000;

    #[test]
    fn a_small_swarm_stands_by_for_a_small_part_of_the_period_and_a_large_one_does_not() {
        let [slow, fast] = [10 * MS, 2 * MS];
        assert_eq!([lead_ns(slow, 1), lead_ns(slow, 32), lead_ns(fast, 32)], [500_000, 500_000, 100_000]);
        assert_eq!(lead_ns(slow, 33), 0);
    }

    #[test]
    fn a_small_delay_does_not_move_the_next_deadline() {
        let mut deadlines = Deadlines::new(100, 1, 0);
        assert_eq!(deadlines.advance(13 * MS), Lateness { late_ns: 3 * MS, missed_deadlines: 0 });
        assert_eq!(deadlines.due().at_ns, 20 * MS);
    }

    #[test]
    fn a_stall_skips_the_deadlines_that_have_passed() {
        let mut deadlines = Deadlines::new(100, 1, 0);
        assert_eq!(deadlines.advance(47 * MS), Lateness { late_ns: 37 * MS, missed_deadlines: 3 });
        assert_eq!(deadlines.due().at_ns, 50 * MS);
        assert_eq!(deadlines.advance(50 * MS), Lateness::default());
        assert_eq!(deadlines.due().at_ns, 60 * MS);
    }

    #[test]
    fn deadlines_begin_anew_one_period_after_a_restart() {
        let mut deadlines = Deadlines::new(100, 1, 0);
        deadlines.restart(123 * MS);
        assert_eq!(deadlines.due().at_ns, 133 * MS);
    }

    #[test]
    fn the_next_deadline_is_always_to_come() {
        let mut deadlines = Deadlines::new(200, 1, 0);
        let mut now = 0;
        for delay in [0, 1, 4, 5, 9, 10, 11, 100, 3, 0].map(|ms| ms * MS) {
            now = now.max(deadlines.due().at_ns) + delay;
            deadlines.advance(now);
            assert!(deadlines.due().at_ns > now);
        }
    }
}
