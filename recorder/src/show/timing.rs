//! Collects how long ticks took, and sums up each second: `/timing/percentiles`.
//!
//! A plot of every tick is a band with spikes; the percentiles of each second show whether the swarm became slower. Must
//! never see simulated values: these times differ from run to run.

use crate::schema::TimingPercentiles;
use ringwing_flight::TickTiming;

/// The round trips since the last message.
#[derive(Debug, Clone, Default)]
pub(crate) struct TimingWatch {
    round_trips_ns: Vec<u64>,
}

impl TimingWatch {
    /// Takes the times of a tick.
    pub(crate) fn observe(&mut self, timing: &TickTiming) {
        self.round_trips_ns.push(timing.round_trip_ns);
    }

    /// The percentiles of the ticks since the last call, `tick` included; `None` if there was no tick.
    pub(crate) fn take(&mut self, tick: i64) -> Option<TimingPercentiles> {
        self.round_trips_ns.sort_unstable();
        let times = &self.round_trips_ns;
        let at = |per_cent: usize| nearest_rank(times, per_cent).map(|ns| ns as f64 / 1e3);
        let percentiles = TimingPercentiles {
            tick,
            ticks: times.len() as u32,
            p50_us: at(50)?,
            p90_us: at(90)?,
            p99_us: at(99)?,
            max_us: at(100)?,
        };
        self.round_trips_ns.clear();
        Some(percentiles)
    }
}

/// The smallest of the `sorted` values that at least `per_cent` % of them do not exceed.
fn nearest_rank(sorted: &[u64], per_cent: usize) -> Option<u64> {
    let rank = (per_cent * sorted.len()).div_ceil(100);
    // Ranks count from 1. Without a tick the rank is 0, and there is no percentile.
    sorted.get(rank.checked_sub(1)?).copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_those_of_the_ticks_since_the_last_message() {
        let mut watch = TimingWatch::default();
        for round_trip_us in (1..=200).rev() {
            watch.observe(&TickTiming { round_trip_ns: 1000 * round_trip_us, ..TickTiming::default() });
        }
        let first = watch.take(200).unwrap();
        assert_eq!((first.tick, first.ticks), (200, 200));
        assert_eq!((first.p50_us, first.p90_us, first.p99_us, first.max_us), (100.0, 180.0, 198.0, 200.0));
        assert_eq!(watch.take(300), None, "no tick since");
        watch.observe(&TickTiming { round_trip_ns: 7000, ..TickTiming::default() });
        let only = watch.take(400).unwrap();
        assert_eq!((only.ticks, only.p50_us, only.max_us), (1, 7.0, 7.0));
    }
}
