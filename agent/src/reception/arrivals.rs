//! The order in which one receiver uses the samples of one sender.
//!
//! In lockstep, scheduling decides how far ahead a fast sender is and how much a thawed receiver finds in its queue.
//! Here a sample is used in a tick that depends on its own tick alone: one that comes early waits, and a receiver
//! that was away skips its backlog.
//!
//! Never loses or delays a sample because of a link fault: that is the [impairment](super::impairment).

use super::sample::Sample;
use ringwing_flight::{Pace, Tick};

/// The samples of one sender at their receiver, sorted by when they can be used.
#[derive(Debug, Clone)]
pub struct Arrivals<T> {
    /// Ticks from the sending of a sample until it can be used.
    latency_ticks: i64,
    /// In lockstep a gap between two ticks means that the receiver was frozen.
    pace: Pace,
    /// Samples that were sent before this tick are ignored.
    first: Option<Tick>,
    /// The tick of the last [`begin`](Self::begin).
    last: Option<Tick>,
    /// The sending tick of the newest sample that can be used now.
    newest: Tick,
    /// Samples that arrived before they can be used.
    early: Vec<T>,
}

impl<T: Sample> Arrivals<T> {
    /// The arrivals from a sender whose samples can be used `latency_ticks` after they were sent.
    pub fn new(latency_ticks: i64, pace: Pace) -> Self {
        Self { latency_ticks, pace, first: None, last: None, newest: Tick::APPROACH, early: Vec::new() }
    }

    /// Starts tick `now` and passes on the early samples that can be used in it.
    ///
    /// Returns whether the newest usable sample was among them; then there is no need to poll for more.
    pub fn begin(&mut self, now: Tick, mut take: impl FnMut(&T)) -> bool {
        self.newest = Tick(now.0 - self.latency_ticks);
        // A newcomer ignores what was sent before its first tick: chance decides whether its queue still got that.
        self.first.get_or_insert(now);
        // After a thaw, use only the newest sample: how much was queued depends on scheduling.
        let is_lockstep = self.pace == Pace::Lockstep;
        if is_lockstep && self.last.is_some_and(|last| now.since(last) > 1) {
            self.early.clear();
            self.first = self.first.max(Some(self.newest));
        }
        self.last = Some(now);
        let (newest, mut has_newest) = (self.newest, false);
        self.early.retain(|sample| {
            let is_early = sample.tick() > newest;
            if !is_early {
                has_newest |= sample.tick() == newest;
                take(sample);
            }
            is_early
        });
        has_newest
    }

    /// Passes on a sample that has just arrived if it can be used now, and keeps it if it is early.
    ///
    /// Returns whether it is the newest usable sample. An early sample does not imply that its predecessor has
    /// arrived: the predecessor may come from a sender that was killed, the early one from its replacement.
    pub fn sort(&mut self, sample: &T, mut take: impl FnMut(&T)) -> bool {
        if Some(sample.tick()) < self.first {
            return false;
        }
        if sample.tick() > self.newest {
            self.early.push(*sample);
        } else {
            take(sample);
        }
        sample.tick() == self.newest
    }

    /// Starts over: the next tick makes this receiver a newcomer.
    pub fn reset(&mut self) {
        (self.first, self.last) = (None, None);
        self.early.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reception::sample::test_state;
    use ringwing_flight::UavState;

    /// The ticks of the samples that are used in `now` when the samples of `sent` arrive in it.
    fn used(arrivals: &mut Arrivals<UavState>, now: i64, sent: &[i64]) -> Vec<i64> {
        let mut used = Vec::new();
        arrivals.begin(Tick(now), |sample| used.push(sample.tick.0));
        for tick in sent {
            arrivals.sort(&test_state(*tick), |sample| used.push(sample.tick.0));
        }
        used
    }

    #[test]
    fn a_sample_from_a_neighbour_that_is_ahead_is_used_in_the_next_tick() {
        let mut arrivals = Arrivals::new(1, Pace::Lockstep);
        assert_eq!(used(&mut arrivals, 0, &[0]), [0_i64; 0]);
        assert_eq!(used(&mut arrivals, 1, &[1]), [0]);
        assert_eq!(used(&mut arrivals, 2, &[]), [1]);
    }

    #[test]
    fn polling_ends_with_the_newest_usable_sample() {
        let mut arrivals = Arrivals::new(1, Pace::Lockstep);
        assert!(!arrivals.begin(Tick(5), |_| ()));
        assert!(!arrivals.sort(&test_state(5), |_| ()), "early, so its predecessor may still come");
        assert!(arrivals.begin(Tick(6), |_| ()));
        assert!(!arrivals.begin(Tick(7), |_| ()));
        assert!(arrivals.sort(&test_state(6), |_| ()));
    }

    #[test]
    fn a_newcomer_ignores_what_was_sent_before_its_first_tick() {
        let mut arrivals = Arrivals::new(1, Pace::Lockstep);
        assert_eq!(used(&mut arrivals, 7, &[5, 6, 7]), [0_i64; 0]);
        assert_eq!(used(&mut arrivals, 8, &[]), [7]);
        arrivals.reset();
        assert_eq!(used(&mut arrivals, 12, &[10, 11, 12]), [0_i64; 0]);
    }

    #[test]
    fn after_a_thaw_in_lockstep_only_the_newest_sample_is_used_however_many_were_queued() {
        for queued_before in [&[4_i64] as &[i64], &[4, 5]] {
            let mut arrivals = Arrivals::new(1, Pace::Lockstep);
            used(&mut arrivals, 3, &[3]);
            used(&mut arrivals, 4, &[]);
            used(&mut arrivals, 5, queued_before);
            assert_eq!(used(&mut arrivals, 8, &[5, 6, 7, 8]), [7], "{queued_before:?}");
            assert_eq!(used(&mut arrivals, 9, &[]), [8]);
        }
    }

    #[test]
    fn a_slow_receiver_in_real_time_uses_its_whole_backlog() {
        let mut arrivals = Arrivals::new(1, Pace::RealTime);
        used(&mut arrivals, 3, &[3]);
        assert_eq!(used(&mut arrivals, 6, &[4, 5, 6]), [3, 4, 5]);
    }
}
