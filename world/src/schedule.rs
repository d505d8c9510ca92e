//! The deadlines of real time.
//!
//! Absolute, so that small delays do not add up. A delay of a period or more moves the whole schedule: simulated time
//! falls behind the wall clock, and the airframes never feel ticks in a burst.

use ringwing_bus::Due;

/// When each tick is due, in nanoseconds of a monotonic clock.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Schedule {
    period_ns: u64,
    lead_ns: u64,
    due_ns: u64,
}

/// Nobody stands by longer for a tick: all of a small swarm are awake within this time.
const LONGEST_LEAD_NS: u64 = 500_000;
/// Nor for more than this part of the time between two.
const LEAD_PER_PERIOD: u64 = 20;
/// With more processes on a core they would only be in one another's way.
const LARGEST_CROWD: u32 = 8;

/// How late a tick was.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Lateness {
    /// After its deadline.
    pub late_ns: u64,
    /// Whole periods of that.
    pub missed_deadlines: u32,
}

impl Schedule {
    /// A schedule whose first deadline is one period after `now_ns`, where as many processes share a core as `crowd` says.
    pub fn new(rate_hz: u32, crowd: u32, now_ns: u64) -> Self {
        let period_ns = 1_000_000_000 / u64::from(rate_hz);
        Self { period_ns, lead_ns: lead_ns(period_ns, crowd), due_ns: now_ns + period_ns }
    }

    /// Begins anew at `now_ns`.
    pub fn restart(&mut self, now_ns: u64) {
        self.due_ns = now_ns + self.period_ns;
    }

    /// The next deadline.
    pub fn due(&self) -> Due {
        Due { at_ns: self.due_ns, lead_ns: self.lead_ns }
    }

    /// Meets the deadline at `now_ns` and sets the next.
    pub fn meet(&mut self, now_ns: u64) -> Lateness {
        let late_ns = now_ns.saturating_sub(self.due_ns);
        let missed = late_ns / self.period_ns;
        self.due_ns += (missed + 1) * self.period_ns;
        Lateness { late_ns, missed_deadlines: u32::try_from(missed).unwrap_or(u32::MAX) }
    }
}

/// How long before a deadline all should be awake for it.
fn lead_ns(period_ns: u64, crowd: u32) -> u64 {
    if crowd > LARGEST_CROWD { 0 } else { LONGEST_LEAD_NS.min(period_ns / LEAD_PER_PERIOD) }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: u64 = 1_000_000;

    #[test]
    fn a_small_swarm_is_awake_in_time_and_sleeps_most_of_it() {
        let [slow, fast] = [10 * MS, 2 * MS];
        assert_eq!([lead_ns(slow, 1), lead_ns(slow, 8), lead_ns(fast, 8)], [500_000, 500_000, 100_000]);
        assert_eq!(lead_ns(slow, 9), 0);
    }

    #[test]
    fn a_small_delay_is_caught_up_at_once() {
        let mut schedule = Schedule::new(100, 1, 0);
        assert_eq!(schedule.meet(13 * MS), Lateness { late_ns: 3 * MS, missed_deadlines: 0 });
        assert_eq!(schedule.due().at_ns, 20 * MS);
    }

    #[test]
    fn a_stall_is_counted_in_full_and_followed_by_no_burst() {
        let mut schedule = Schedule::new(100, 1, 0);
        assert_eq!(schedule.meet(47 * MS), Lateness { late_ns: 37 * MS, missed_deadlines: 3 });
        assert_eq!(schedule.due().at_ns, 50 * MS);
        assert_eq!(schedule.meet(50 * MS), Lateness::default());
        assert_eq!(schedule.due().at_ns, 60 * MS);
    }

    #[test]
    fn no_two_ticks_come_closer_than_the_schedule_allows() {
        // Whatever the delays, the next deadline is never in the past by a period or more.
        let mut schedule = Schedule::new(200, 1, 0);
        let mut now = 0;
        for delay in [0, 1, 4, 5, 9, 10, 11, 100, 3, 0].map(|ms| ms * MS) {
            now = now.max(schedule.due().at_ns) + delay;
            schedule.meet(now);
            assert!(schedule.due().at_ns > now);
        }
    }
}
