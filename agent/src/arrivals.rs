//! What has come in from one sender, and when it can be used.
//!
//! Which senders are fast is chance: what comes before its time waits here, and nothing that depends on it is shown.

use crate::impairment::Carried;
use ringwing_flight::Tick;

/// The order of one sender's samples at their receiver.
#[derive(Debug, Clone)]
pub struct Arrivals<T> {
    /// How many ticks after it was sent a sample can be used.
    ticks: i64,
    /// Time stands still while somebody has to be waited for; see [`Arrivals::begin`].
    lockstep: bool,
    /// What was sent before is not heard.
    first: Option<Tick>,
    /// The tick that was received in last.
    last: Option<Tick>,
    /// The newest that can be used in it.
    newest: Tick,
    /// Has come, but was sent too lately to be used.
    early: Vec<T>,
}

impl<T: Carried> Arrivals<T> {
    /// From a sender whose samples can be used `ticks` after they were sent.
    pub fn new(ticks: i64, lockstep: bool) -> Self {
        Self { ticks, lockstep, first: None, last: None, newest: Tick::APPROACH, early: Vec::new() }
    }

    /// Begins to receive in `now` and hands over what waited for that; returns whether the newest that can be used was
    /// among it, so that there is no need to look for more.
    ///
    /// What was sent before the receiver's first tick is not heard: whether a newcomer still gets it is chance. Nor is, in
    /// lockstep, what was sent while the receiver was frozen, but for the newest: how much of it was kept for it, and had
    /// come before, is chance too.
    pub fn begin(&mut self, now: Tick, mut take: impl FnMut(&T)) -> bool {
        self.newest = Tick(now.0 - self.ticks);
        self.first.get_or_insert(now);
        if self.lockstep && self.last.is_some_and(|last| now.since(last) > 1) {
            self.early.clear();
            self.first = self.first.max(Some(self.newest));
        }
        self.last = Some(now);
        let (newest, mut complete) = (self.newest, false);
        self.early.retain(|sample| {
            let waits = sample.tick() > newest;
            if !waits {
                complete |= sample.tick() == newest;
                take(sample);
            }
            waits
        });
        complete
    }

    /// Hands over what has just come if it can be used, or keeps it until it can; returns whether it is the newest that
    /// can be used.
    ///
    /// One that came before its time is no sign that the one before has come, for a successor's may overtake.
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

    /// Nobody listens any more; who does again is a newcomer.
    pub fn forget(&mut self) {
        (self.first, self.last) = (None, None);
        self.early.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ringwing_flight::{UavId, UavState};

    fn state(tick: i64) -> UavState {
        UavState {
            tick: Tick(tick),
            position_m: [0.0; 2],
            heading_rad: 0.0,
            speed_m_s: 15.0,
            turn_rate_rad_s: 0.0,
            uav: UavId(2),
            reserved: 0,
            rumours: Default::default(),
        }
    }

    /// What is used in `now` when `sent` has come meanwhile.
    fn used(arrivals: &mut Arrivals<UavState>, now: i64, sent: &[i64]) -> Vec<i64> {
        let mut used = Vec::new();
        arrivals.begin(Tick(now), |sample| used.push(sample.tick.0));
        for tick in sent {
            arrivals.sort(&state(*tick), |sample| used.push(sample.tick.0));
        }
        used
    }

    #[test]
    fn a_neighbour_that_is_ahead_is_heard_the_tick_after() {
        let mut arrivals = Arrivals::new(1, true);
        assert_eq!(used(&mut arrivals, 0, &[0]), [0_i64; 0]);
        assert_eq!(used(&mut arrivals, 1, &[1]), [0]);
        assert_eq!(used(&mut arrivals, 2, &[]), [1]);
    }

    #[test]
    fn who_has_the_newest_needs_no_look_for_more() {
        let mut arrivals = Arrivals::new(1, true);
        assert!(!arrivals.begin(Tick(5), |_| ()));
        assert!(!arrivals.sort(&state(5), |_| ()), "too early to be used, and no sign of the one before");
        assert!(arrivals.begin(Tick(6), |_| ()));
        assert!(!arrivals.begin(Tick(7), |_| ()));
        assert!(arrivals.sort(&state(6), |_| ()));
    }

    #[test]
    fn a_newcomer_does_not_hear_what_was_sent_before_it_came() {
        let mut arrivals = Arrivals::new(1, true);
        assert_eq!(used(&mut arrivals, 7, &[5, 6, 7]), [0_i64; 0]);
        assert_eq!(used(&mut arrivals, 8, &[]), [7]);
        arrivals.forget();
        assert_eq!(used(&mut arrivals, 12, &[10, 11, 12]), [0_i64; 0]);
    }

    #[test]
    fn whoever_was_frozen_in_lockstep_hears_the_newest_only_whatever_had_come_before() {
        for came_before in [&[4_i64] as &[i64], &[4, 5]] {
            let mut arrivals = Arrivals::new(1, true);
            used(&mut arrivals, 3, &[3]);
            used(&mut arrivals, 4, &[]);
            used(&mut arrivals, 5, came_before);
            assert_eq!(used(&mut arrivals, 8, &[5, 6, 7, 8]), [7], "{came_before:?}");
            assert_eq!(used(&mut arrivals, 9, &[]), [8]);
        }
    }

    #[test]
    fn whoever_is_slow_in_real_time_hears_all_that_was_kept() {
        let mut arrivals = Arrivals::new(1, false);
        used(&mut arrivals, 3, &[3]);
        assert_eq!(used(&mut arrivals, 6, &[4, 5, 6]), [3, 4, 5]);
    }
}
