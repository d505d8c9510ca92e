//! The deadlines of ticks in real time.
//!
//! Deadlines are absolute, so small delays do not add up. After a delay of a period or more, all later deadlines move:
//! simulated time falls behind the wall clock, and no airframe ever gets a burst of ticks.
//!
//! Must never read a clock: callers pass the time in.

use crate::Due;

/// When each tick is due, in nanoseconds of a monotonic clock.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Deadlines {
    period_ns: u64,
    lead_ns: u64,
    due_ns: u64,
}

/// Longest time for which processes stand by, awake, before a tick is due. Within half a millisecond all processes of a
/// small swarm wake up; a longer lead burns CPU for nothing, a shorter one finds some of them still waking.
const MAX_LEAD_NS: u64 = 500_000;
/// The lead is at most the period divided by this. Smaller makes high rates burn more CPU.
const PERIODS_TO_LEAD: u64 = 20;
/// Most processes per core that stand by. With more, they take the core from one another.
const MAX_CROWD: u32 = 8;

/// How late a tick was.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Lateness {
    /// Time after its deadline.
    pub late_ns: u64,
    /// Whole periods in that time.
    pub missed_deadlines: u32,
}

impl Deadlines {
    /// Deadlines at `rate_hz`, the first one period after `now_ns`, for `crowd` processes per core.
    pub fn new(rate_hz: u32, crowd: u32, now_ns: u64) -> Self {
        let period_ns = 1_000_000_000 / u64::from(rate_hz);
        Self { period_ns, lead_ns: lead_ns(period_ns, crowd), due_ns: now_ns + period_ns }
    }

    /// Moves the next deadline to one period after `now_ns`.
    pub fn restart(&mut self, now_ns: u64) {
        self.due_ns = now_ns + self.period_ns;
    }

    /// The next deadline.
    pub fn due(&self) -> Due {
        Due { at_ns: self.due_ns, lead_ns: self.lead_ns }
    }

    /// Says how late `now_ns` is for the deadline, and moves on to the next one after it.
    pub fn meet(&mut self, now_ns: u64) -> Lateness {
        let late_ns = now_ns.saturating_sub(self.due_ns);
        let missed = late_ns / self.period_ns;
        self.due_ns += (missed + 1) * self.period_ns;
        Lateness { late_ns, missed_deadlines: u32::try_from(missed).unwrap_or(u32::MAX) }
    }
}

/// How long before a deadline all processes should be awake.
fn lead_ns(period_ns: u64, crowd: u32) -> u64 {
    if crowd > MAX_CROWD { 0 } else { MAX_LEAD_NS.min(period_ns / PERIODS_TO_LEAD) }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: u64 = 1_000_000;

    #[test]
    fn a_small_swarm_stands_by_for_a_short_time_and_a_crowd_never_does() {
        let [slow, fast] = [10 * MS, 2 * MS];
        assert_eq!([lead_ns(slow, 1), lead_ns(slow, 8), lead_ns(fast, 8)], [500_000, 500_000, 100_000]);
        assert_eq!(lead_ns(slow, 9), 0);
    }

    #[test]
    fn a_delay_below_a_period_is_caught_up_at_once() {
        let mut deadlines = Deadlines::new(100, 1, 0);
        assert_eq!(deadlines.meet(13 * MS), Lateness { late_ns: 3 * MS, missed_deadlines: 0 });
        assert_eq!(deadlines.due().at_ns, 20 * MS);
    }

    #[test]
    fn a_stall_is_counted_in_full_and_not_followed_by_a_burst() {
        let mut deadlines = Deadlines::new(100, 1, 0);
        assert_eq!(deadlines.meet(47 * MS), Lateness { late_ns: 37 * MS, missed_deadlines: 3 });
        assert_eq!(deadlines.due().at_ns, 50 * MS);
        assert_eq!(deadlines.meet(50 * MS), Lateness::default());
        assert_eq!(deadlines.due().at_ns, 60 * MS);
    }

    #[test]
    fn the_next_deadline_is_always_in_the_future() {
        let mut deadlines = Deadlines::new(200, 1, 0);
        let mut now = 0;
        for delay in [0, 1, 4, 5, 9, 10, 11, 100, 3, 0].map(|ms| ms * MS) {
            now = now.max(deadlines.due().at_ns) + delay;
            deadlines.meet(now);
            assert!(deadlines.due().at_ns > now);
        }
    }
}
