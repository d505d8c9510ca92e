//! The capacity of one link: how many samples it carries, and the queue of those that wait for it.
//!
//! The link opens for a sample at fixed times, counted from the beginning of its fault. So when it opens is a function of
//! the tick alone. What waits is not: a restarted receiver finds the same openings and an empty queue.
//!
//! Never looks at another link, nor at the other faults of its own.

use ringwing_flight::Tick;
use std::collections::VecDeque;

/// A limit on what a link carries.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct RateLimit {
    /// Which of the run's faults it is.
    pub(super) number: u32,
    /// The first tick in which it applies.
    pub(super) begin: Tick,
    /// Samples that the link carries in a second.
    pub(super) samples_per_s: f64,
    /// Ticks a second.
    pub(super) rate_hz: u32,
    /// Places in the queue.
    pub(super) queue: usize,
}

impl RateLimit {
    /// How often the link opens in `tick`. Over any span of time that is the rate, to within one sample.
    fn openings(&self, tick: Tick) -> usize {
        // The first opening is in the first tick, so that a link that was idle carries a sample at once.
        // Multiply before dividing: with whole numbers, no rounding then moves an opening.
        let opened_before =
            |ticks: i64| (ticks as f64 * self.samples_per_s / f64::from(self.rate_hz)).ceil() as usize;
        let passed = tick.since(self.begin);
        opened_before(passed + 1) - opened_before(passed)
    }
}

/// What becomes of a sample that stood in the queue.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Passage<T> {
    /// It leaves the queue in this tick.
    Sent(T, Tick),
    /// It was the oldest in a full queue; the limit of this fault dropped it.
    Dropped(T, u32),
}

/// The queue in front of a link.
#[derive(Debug, Clone)]
pub(super) struct SendQueue<T> {
    waiting: VecDeque<T>,
    /// The link has carried what it could up to this tick.
    served: Option<Tick>,
}

impl<T: Copy> SendQueue<T> {
    pub(super) fn new() -> Self {
        Self { waiting: VecDeque::new(), served: None }
    }

    pub(super) fn len(&self) -> usize {
        self.waiting.len()
    }

    pub(super) fn clear(&mut self) {
        self.waiting.clear();
    }

    /// Puts a sample that is sent in `sent` into the queue, once the link has carried what it could before. `limit` is what
    /// limits the link in a tick, if anything does.
    pub(super) fn push(
        &mut self,
        sample: T,
        sent: Tick,
        limit: impl Fn(Tick) -> Option<RateLimit>,
        pass: impl FnMut(Passage<T>),
    ) {
        self.serve_to(Tick(sent.0 - 1), limit, pass);
        self.waiting.push_back(sample);
    }

    /// Lets the link carry what it can in every tick up to `now`, and drops what finds no place in the queue.
    pub(super) fn serve_to(
        &mut self,
        now: Tick,
        limit: impl Fn(Tick) -> Option<RateLimit>,
        mut pass: impl FnMut(Passage<T>),
    ) {
        // A queue that was never served begins now: nothing has waited before.
        let first = self.served.map_or(now, Tick::next);
        self.served = self.served.max(Some(now));
        for tick in (first.0..=now.0).map(Tick) {
            // Unused openings are lost: a link does not save up capacity.
            if self.waiting.is_empty() {
                return;
            }
            let limit = limit(tick);
            let openings = limit.map_or(usize::MAX, |limit| limit.openings(tick));
            for sample in self.waiting.drain(..openings.min(self.waiting.len())) {
                pass(Passage::Sent(sample, tick));
            }
            while let Some(limit) = limit.filter(|limit| self.waiting.len() > limit.queue)
                && let Some(oldest) = self.waiting.pop_front()
            {
                pass(Passage::Dropped(oldest, limit.number));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn limit(samples_per_tick: f64, queue: usize) -> RateLimit {
        RateLimit { number: 1, begin: Tick(0), samples_per_s: samples_per_tick, rate_hz: 1, queue }
    }

    /// The samples that leave the queue, each with its tick, and those that are dropped, if one is sent in each of `0..ticks`.
    fn passed(limit: RateLimit, ticks: i64) -> (Vec<(i64, i64)>, Vec<i64>) {
        let (mut queue, mut sent, mut dropped) = (SendQueue::new(), Vec::new(), Vec::new());
        let mut note = |passage| match passage {
            Passage::Sent(sample, tick) => sent.push((sample, tick.0)),
            Passage::Dropped(sample, _) => dropped.push(sample),
        };
        for tick in 0..ticks {
            queue.push(tick, Tick(tick), |_| Some(limit), &mut note);
            queue.serve_to(Tick(tick), |_| Some(limit), &mut note);
        }
        (sent, dropped)
    }

    #[test]
    fn a_link_carries_exactly_its_rate() {
        for (samples_per_tick, expected) in
            [(0.2, 200), (0.3, 300), (0.01, 10), (1.0 / 3.0, 334), (1.5, 1000)]
        {
            assert_eq!(
                passed(limit(samples_per_tick, 10), 1000).0.len(),
                expected,
                "{samples_per_tick} a tick"
            );
        }
    }

    #[test]
    fn samples_wait_for_the_next_opening_and_a_full_queue_drops_the_oldest() {
        let (sent, dropped) = passed(limit(0.25, 2), 9);
        assert_eq!(sent, [(0, 0), (2, 4), (6, 8)]);
        assert_eq!(dropped, [1, 3, 4, 5]);
    }

    #[test]
    fn a_rate_above_that_of_the_sender_delays_nothing() {
        let (sent, dropped) = passed(limit(1.0, 1), 50);
        assert!(sent.iter().all(|(sample, tick)| sample == tick) && dropped.is_empty());
    }

    #[test]
    fn without_a_limit_everything_leaves_at_once() {
        let mut queue = SendQueue::new();
        let mut left = Vec::new();
        let limited = |tick: Tick| (tick < Tick(3)).then(|| limit(0.001, 10));
        for tick in 0..5 {
            queue.push(tick, Tick(tick), limited, |passage| left.push(passage));
            queue.serve_to(Tick(tick), limited, |passage| left.push(passage));
        }
        let at = |sample: i64, tick| Passage::Sent(sample, Tick(tick));
        assert_eq!(left, [at(0, 0), at(1, 3), at(2, 3), at(3, 3), at(4, 4)]);
    }
}
