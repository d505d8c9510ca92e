//! What the clock and the waits add to the account of a flight: latencies, lateness, ticks without an answer.
//!
//! Never changes what flies: two flights with the same payload hash may differ in all of this.

use hdrhistogram::Histogram;
use ringwing_flight::{Latency, TickTiming, WorldReport};

/// Longer latencies are recorded as this one, a minute. A larger bound costs memory.
const LONGEST_NS: u64 = 60_000_000_000;
/// Significant decimal digits of recorded latencies. One more costs ten times the memory.
const DIGITS: u8 = 3;

/// The account so far.
#[derive(Debug)]
pub(super) struct WallClock {
    latency: Histogram<u64>,
    late_max_ns: u64,
    missed_deadlines: u64,
    unanswered_ticks: u64,
}

impl WallClock {
    pub(super) fn new() -> Self {
        Self {
            latency: Histogram::new_with_max(LONGEST_NS, DIGITS).expect("these bounds make a histogram"),
            late_max_ns: 0,
            missed_deadlines: 0,
            unanswered_ticks: 0,
        }
    }

    /// Adds a tick that took this long.
    pub(super) fn add(&mut self, timing: &TickTiming) {
        if timing.answered > 0 {
            self.latency.saturating_record(timing.round_trip_ns);
        }
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
            late_max_us: microseconds(self.late_max_ns),
            latency: self.latency(),
            ..report
        }
    }

    fn latency(&self) -> Option<Latency> {
        (!self.latency.is_empty()).then(|| Latency {
            p50_us: microseconds(self.latency.value_at_quantile(0.5)),
            p99_us: microseconds(self.latency.value_at_quantile(0.99)),
            max_us: microseconds(self.latency.max()),
        })
    }
}

fn microseconds(nanoseconds: u64) -> f64 {
    nanoseconds as f64 / 1e3
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tick_without_commands_has_no_latency() {
        let mut clock = WallClock::new();
        clock.add(&TickTiming { round_trip_ns: 5000, ..TickTiming::default() });
        assert_eq!(clock.latency(), None);
        clock.add(&TickTiming { round_trip_ns: 5000, answered: 1, ..TickTiming::default() });
        let latency = clock.latency().unwrap();
        assert!((latency.p50_us - 5.0).abs() < 0.01 && latency.p50_us == latency.max_us);
    }
}
