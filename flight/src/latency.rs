//! The distribution of the latencies of a flight: the one way in which every summary computes its percentiles.
//!
//! Must never read a clock: the latencies come in.

use crate::{Latency, TickTiming};
use hdrhistogram::Histogram;

/// Longer latencies are recorded as this one, a minute. A larger bound costs memory.
const LONGEST_NS: u64 = 60_000_000_000;
/// Significant decimal digits of recorded latencies. One more costs ten times the memory.
const DIGITS: u8 = 3;

/// The latencies so far.
#[derive(Debug, Clone)]
pub struct LatencyTally {
    histogram: Histogram<u64>,
}

impl LatencyTally {
    /// No latencies yet.
    ///
    /// # Panics
    /// Never: the bounds of the histogram are constants that it accepts.
    pub fn new() -> Self {
        let histogram = Histogram::new_with_max(LONGEST_NS, DIGITS).expect("these bounds make a histogram");
        Self { histogram }
    }

    /// Adds the round trip of a tick. A tick before the flight, or one that nobody answered, has none.
    pub fn add(&mut self, timing: &TickTiming) {
        if timing.answered > 0 && timing.tick >= 0 {
            self.add_ns(timing.round_trip_ns);
        }
    }

    /// Adds one latency.
    pub fn add_ns(&mut self, latency_ns: u64) {
        // Saturating: an error would leave out the longest times, which are those that people look for.
        self.histogram.saturating_record(latency_ns);
    }

    /// The distribution; `None` before the first latency.
    pub fn latency(&self) -> Option<Latency> {
        (!self.histogram.is_empty()).then(|| Latency {
            p50_us: microseconds(self.histogram.value_at_quantile(0.5)),
            p99_us: microseconds(self.histogram.value_at_quantile(0.99)),
            max_us: microseconds(self.histogram.max()),
        })
    }
}

impl Default for LatencyTally {
    fn default() -> Self {
        Self::new()
    }
}

fn microseconds(nanoseconds: u64) -> f64 {
    nanoseconds as f64 / 1e3
}

#[cfg(test)]
mod tests {
    use super::*;

    fn timing(tick: i64, answered: u32, round_trip_ns: u64) -> TickTiming {
        TickTiming { tick, round_trip_ns, answered, ..TickTiming::default() }
    }

    #[test]
    fn ticks_without_answers_and_before_the_flight_have_no_latency() {
        let mut tally = LatencyTally::new();
        tally.add(&timing(0, 0, 5000));
        tally.add(&timing(-1, 6, 5000));
        assert_eq!(tally.latency(), None);
        tally.add(&timing(0, 1, 5000));
        let latency = tally.latency().unwrap();
        assert!((latency.p50_us - 5.0).abs() < 0.01 && latency.p50_us == latency.max_us);
    }

    #[test]
    fn percentiles_are_those_of_all_ticks() {
        let mut tally = LatencyTally::new();
        (1..=100).for_each(|tick| tally.add(&timing(tick, 6, tick.cast_unsigned() * 1000)));
        let latency = tally.latency().unwrap();
        assert!((latency.p50_us - 50.0).abs() < 0.1 && (latency.p99_us - 99.0).abs() < 0.1, "{latency:?}");
    }
}
