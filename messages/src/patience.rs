//! Whether to give way, to sleep, or neither, while something is waited for.
//!
//! Never waits for anything itself longer than some yields take.

use std::{
    hint::spin_loop,
    time::{Duration, Instant},
};

/// Decides whether to give way to others for a moment before sleeping, from what that brought lately.
///
/// Where processes alternate on few cores, `sched_yield` hands over in a fraction of the time a sleep takes; beside a
/// busy foreign process it gives away whole time slices. So yields are tried only while they pay.
#[derive(Debug)]
pub struct Patience {
    yields: u32,
    waits_until_retry: u32,
    restless: bool,
}

impl Patience {
    const MOST_YIELDS: u32 = 20;
    const RETRY_AFTER_WAITS: u32 = 256;
    /// A yield that takes this long has run somebody else's time slice.
    const LONG_YIELD: Duration = Duration::from_micros(500);

    /// For waits that end within microseconds, as in lockstep.
    pub fn eager() -> Self {
        Self { yields: Self::MOST_YIELDS, waits_until_retry: Self::RETRY_AFTER_WAITS, restless: false }
    }

    /// For waits that take milliseconds, as in real time: sleep at once, always.
    pub fn calm() -> Self {
        Self { yields: 0, waits_until_retry: u32::MAX, restless: false }
    }

    /// Never sleeps: looks again and again, and gives way in between.
    pub fn restless() -> Self {
        Self { yields: Self::MOST_YIELDS, waits_until_retry: u32::MAX, restless: true }
    }

    /// Whether it never sleeps.
    pub(crate) fn is_restless(&self) -> bool {
        self.restless
    }

    /// Yields until `condition` holds; false when it is time to sleep instead.
    pub(crate) fn yield_until(&mut self, condition: impl Fn() -> bool) -> bool {
        if condition() {
            return true;
        }
        if self.restless {
            return look_again_until(condition);
        }
        if self.yields == 0 && !self.is_time_to_retry() {
            return false;
        }
        let start = Instant::now();
        for _ in 0..self.yields {
            std::thread::yield_now();
            if condition() {
                self.learn(start.elapsed() < Self::LONG_YIELD);
                return true;
            }
        }
        self.learn(false);
        false
    }

    fn is_time_to_retry(&mut self) -> bool {
        self.waits_until_retry =
            self.waits_until_retry.saturating_sub(u32::from(self.waits_until_retry < u32::MAX));
        if self.waits_until_retry == 0 {
            *self = Self::eager();
        }
        self.yields > 0
    }

    fn learn(&mut self, paid: bool) {
        self.yields = if paid { (self.yields * 2).clamp(1, Self::MOST_YIELDS) } else { self.yields / 2 };
    }
}

/// How often a restless one looks between two yields: on a core of its own it sees at once what another writes.
const LOOKS_PER_YIELD: u32 = 100;
/// After so many yields it looks up from the gate.
const YIELDS_PER_LOOK_UP: u32 = 100;

fn look_again_until(condition: impl Fn() -> bool) -> bool {
    for _ in 0..YIELDS_PER_LOOK_UP {
        for _ in 0..LOOKS_PER_YIELD {
            if condition() {
                return true;
            }
            spin_loop();
        }
        std::thread::yield_now();
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patience_ends_while_yields_do_not_pay_and_comes_back() {
        let mut patience = Patience::eager();
        for _ in 0..10 {
            assert!(!patience.yield_until(|| false));
        }
        assert_eq!(patience.yields, 0);
        let comes_back = (0..Patience::RETRY_AFTER_WAITS).any(|_| {
            patience.yield_until(|| false);
            patience.yields > 0
        });
        assert!(comes_back);
    }

    #[test]
    fn the_calm_never_yield() {
        let mut patience = Patience::calm();
        for _ in 0..1000 {
            assert!(!patience.yield_until(|| false));
        }
        assert_eq!(patience.yields, 0);
    }

    #[test]
    fn the_restless_never_tire() {
        let mut patience = Patience::restless();
        for _ in 0..10 {
            assert!(!patience.yield_until(|| false));
        }
        assert!(patience.is_restless() && patience.yield_until(|| true));
    }
}
