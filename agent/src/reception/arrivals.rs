//! Which samples of one sender a receiver uses in which tick.
//!
//! A sample is used in a tick that depends on its own tick alone, and never on when it came: in lockstep, scheduling
//! decides how far ahead a fast sender is.
//!
//! Never loses or delays a sample because of a link fault: that is the [impairment](super::impairment).

use ringwing_flight::{Pace, Tick};
use std::ops::RangeInclusive;

/// How far a receiver has come with the samples of one sender.
#[derive(Debug, Clone)]
pub struct Arrivals {
    /// Ticks from the sending of a sample until it can be used.
    latency_ticks: i64,
    pace: Pace,
    /// Samples that were sent before this tick are not used.
    first: Option<Tick>,
}

impl Arrivals {
    /// The arrivals from a sender whose samples can be used `latency_ticks` after they were sent.
    pub fn new(latency_ticks: i64, pace: Pace) -> Self {
        Self { latency_ticks, pace, first: None }
    }

    /// The ticks whose samples can be used in `now` and were not used before; none for a newcomer.
    pub fn usable(&mut self, now: Tick) -> RangeInclusive<Tick> {
        let newest = Tick(now.0 - self.latency_ticks);
        // A newcomer does not use what was sent before its first tick: it joined between two ticks, and was not there.
        let first = *self.first.get_or_insert(now);
        // In lockstep every sample is there one tick after it was sent at the latest. So an older one was missed by a
        // receiver that was frozen, and a thawed receiver goes on with the newest.
        match self.pace {
            Pace::Lockstep => first.max(newest)..=newest,
            Pace::RealTime => first..=newest,
        }
    }

    /// Notes that the sample of `tick` has arrived: it and those before it are not used again.
    pub fn note(&mut self, tick: Tick) {
        self.first = self.first.max(Some(Tick(tick.0 + 1)));
    }

    /// Starts over: the next tick makes this receiver a newcomer.
    pub fn reset(&mut self) {
        self.first = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn usable(arrivals: &mut Arrivals, now: i64) -> Vec<i64> {
        let ticks = arrivals.usable(Tick(now));
        (ticks.start().0..=ticks.end().0).collect()
    }

    #[test]
    fn in_lockstep_a_tick_uses_the_samples_of_the_tick_before() {
        let mut arrivals = Arrivals::new(1, Pace::Lockstep);
        assert_eq!(usable(&mut arrivals, 0), [0_i64; 0]);
        assert_eq!(usable(&mut arrivals, 1), [0]);
        arrivals.note(Tick(0));
        assert_eq!(usable(&mut arrivals, 2), [1]);
    }

    #[test]
    fn a_newcomer_does_not_use_what_was_sent_before_its_first_tick() {
        let mut arrivals = Arrivals::new(1, Pace::RealTime);
        assert_eq!(usable(&mut arrivals, 7), [0_i64; 0]);
        assert_eq!(usable(&mut arrivals, 8), [7]);
        arrivals.reset();
        assert_eq!(usable(&mut arrivals, 12), [0_i64; 0]);
    }

    #[test]
    fn own_senses_are_used_in_the_tick_in_which_they_are_sent() {
        let mut arrivals = Arrivals::new(0, Pace::Lockstep);
        assert_eq!(usable(&mut arrivals, 7), [7]);
    }

    #[test]
    fn after_a_thaw_in_lockstep_only_the_newest_sample_is_used() {
        let mut arrivals = Arrivals::new(1, Pace::Lockstep);
        usable(&mut arrivals, 3);
        arrivals.note(Tick(3));
        assert_eq!(usable(&mut arrivals, 8), [7]);
    }

    #[test]
    fn in_real_time_a_receiver_uses_all_that_it_has_not_used() {
        let mut arrivals = Arrivals::new(1, Pace::RealTime);
        usable(&mut arrivals, 3);
        assert_eq!(usable(&mut arrivals, 5), [3, 4]);
        arrivals.note(Tick(3));
        assert_eq!(usable(&mut arrivals, 6), [4, 5], "the sample of tick 4 was late");
        arrivals.note(Tick(5));
        assert_eq!(usable(&mut arrivals, 6), [0_i64; 0]);
    }
}
