//! What the clock and the waits add to the account of a flight: latencies, lateness, ticks without an answer.
//!
//! Never changes what flies: two flights with the same payload hash may differ in all of this.

use ringwing_flight::{LatencyTally, TickTiming, WorldReport};

/// Nanoseconds per microsecond.
const NS_PER_US: f64 = 1e3;

/// The account so far.
#[derive(Debug, Default)]
pub(super) struct WallClock {
    latency: LatencyTally,
    late_max_ns: u64,
    missed_deadlines: u64,
    unanswered_ticks: u64,
}

impl WallClock {
    /// Adds a tick that took this long.
    pub(super) fn add(&mut self, timing: &TickTiming) {
        self.latency.add(timing);
        self.late_max_ns = self.late_max_ns.max(timing.late_ns);
        self.missed_deadlines += u64::from(timing.missed_deadlines);
    }

    /// Counts a tick whose answers did not all arrive in time.
    pub(super) fn count_unanswered(&mut self) {
        self.unanswered_ticks += 1;
    }

    /// Fills in the fields of `report` that need a clock.
    pub(super) fn complete(&self, report: WorldReport) -> WorldReport {
        WorldReport {
            missed_deadlines: self.missed_deadlines,
            unanswered_ticks: self.unanswered_ticks,
            late_max_us: self.late_max_ns as f64 / NS_PER_US,
            latency: self.latency.latency(),
            ..report
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Airspace;
    use ringwing_scenario::Scenario;

    #[test]
    fn lateness_is_the_longest_of_all_ticks_and_missed_deadlines_add_up() {
        let mut clock = WallClock::default();
        for (late_ns, missed_deadlines) in [(2000, 0), (9000, 2), (1000, 1)] {
            clock.add(&TickTiming { late_ns, missed_deadlines, ..TickTiming::default() });
        }
        clock.count_unanswered();
        let report = clock.complete(Airspace::new(&Scenario::default(), &[]).report());
        assert_eq!((report.late_max_us, report.missed_deadlines, report.unanswered_ticks), (9.0, 3, 1));
        assert_eq!(report.latency, None);
    }
}
