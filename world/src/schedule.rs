//! The deadlines of real time.
//!
//! Absolute, so that small delays do not add up. A delay of a period or more moves the whole schedule: simulated time
//! falls behind the wall clock, and the airframes never feel ticks in a burst.

/// When each tick is due, in nanoseconds of a monotonic clock.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Schedule {
    period_ns: u64,
    due_ns: u64,
}

/// How late a tick was.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Lateness {
    /// After its deadline.
    pub late_ns: u64,
    /// Whole periods of that.
    pub missed_deadlines: u32,
}

impl Schedule {
    /// A schedule whose first deadline is one period after `now_ns`.
    pub fn new(rate_hz: u32, now_ns: u64) -> Self {
        let period_ns = 1_000_000_000 / u64::from(rate_hz);
        Self { period_ns, due_ns: now_ns + period_ns }
    }

    /// The next deadline.
    pub fn due_ns(&self) -> u64 {
        self.due_ns
    }

    /// Meets the deadline at `now_ns` and sets the next.
    pub fn meet(&mut self, now_ns: u64) -> Lateness {
        let late_ns = now_ns.saturating_sub(self.due_ns);
        let missed = late_ns / self.period_ns;
        self.due_ns += (missed + 1) * self.period_ns;
        Lateness { late_ns, missed_deadlines: u32::try_from(missed).unwrap_or(u32::MAX) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: u64 = 1_000_000;

    #[test]
    fn a_small_delay_is_caught_up_at_once() {
        let mut schedule = Schedule::new(100, 0);
        assert_eq!(schedule.meet(13 * MS), Lateness { late_ns: 3 * MS, missed_deadlines: 0 });
        assert_eq!(schedule.due_ns(), 20 * MS);
    }

    #[test]
    fn a_stall_is_counted_in_full_and_followed_by_no_burst() {
        let mut schedule = Schedule::new(100, 0);
        assert_eq!(schedule.meet(47 * MS), Lateness { late_ns: 37 * MS, missed_deadlines: 3 });
        assert_eq!(schedule.due_ns(), 50 * MS);
        assert_eq!(schedule.meet(50 * MS), Lateness::default());
        assert_eq!(schedule.due_ns(), 60 * MS);
    }

    #[test]
    fn no_two_ticks_come_closer_than_the_schedule_allows() {
        // Whatever the delays, the next deadline is never in the past by a period or more.
        let mut schedule = Schedule::new(200, 0);
        let mut now = 0;
        for delay in [0, 1, 4, 5, 9, 10, 11, 100, 3, 0].map(|ms| ms * MS) {
            now = now.max(schedule.due_ns()) + delay;
            schedule.meet(now);
            assert!(schedule.due_ns() > now);
        }
    }
}
