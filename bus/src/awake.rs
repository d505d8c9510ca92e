//! Time limits that do not run while this process is asleep.
//!
//! A run may be stopped as a whole: by the terminal's Ctrl-Z, by a container that is paused, by a laptop that is closed.
//! When it goes on, none of its processes has been slow, and no time limit may say so.
//!
//! Must never be used for what is measured: a stall counts there.

use std::time::{Duration, Instant};

/// The most that can pass between two looks at the clock while a process waits; more means that it was asleep. With less,
/// time limits become longer on a busy machine, where a process often gets the processor late; with more, a process
/// that slept takes the sleep for waiting.
const STEP_MAX: Duration = Duration::from_millis(200);
/// What a sleep counts. With nothing, a wait would never end on a machine so busy that each look is late; with more, what
/// others do right after a common sleep seems late.
const SLEEP_COUNTS: Duration = Duration::from_millis(20);

/// The time in which this process was awake. Whoever waits has to look at it at least five times a second.
#[derive(Debug, Clone)]
pub struct AwakeClock {
    last: Instant,
    awake: Duration,
}

impl AwakeClock {
    /// A clock that begins at zero, now.
    pub fn start() -> Self {
        Self { last: Instant::now(), awake: Duration::ZERO }
    }

    /// Looks at the clock; returns for how long the process has slept since the last look.
    pub fn look(&mut self) -> Duration {
        let now = Instant::now();
        let step = now.duration_since(self.last);
        self.last = now;
        self.pass(step)
    }

    /// Looks at the clock without counting the time since the last look.
    pub fn skip(&mut self) {
        self.last = Instant::now();
    }

    /// Lets `step` pass since the last look; returns it if the process slept.
    fn pass(&mut self, step: Duration) -> Duration {
        let slept = step > STEP_MAX;
        self.awake += if slept { SLEEP_COUNTS } else { step };
        if slept { step } else { Duration::ZERO }
    }

    /// The time until the last look, without the time asleep.
    pub fn awake(&self) -> Duration {
        self.awake
    }
}

/// How long to wait for something that may never come.
#[derive(Debug, Clone)]
pub struct Patience {
    clock: AwakeClock,
    limit: Duration,
}

impl Patience {
    /// A wait that begins now and may take `limit`, not counting the time in which this process is asleep.
    pub fn of(limit: Duration) -> Self {
        Self { clock: AwakeClock::start(), limit }
    }

    /// Whether the time is over. To be asked at least five times a second.
    pub fn is_over(&mut self) -> bool {
        self.clock.look();
        self.clock.awake() >= self.limit
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_step_hardly_counts_and_short_ones_count_in_full() {
        let mut clock = AwakeClock::start();
        let mut pass = |milliseconds| clock.pass(Duration::from_millis(milliseconds)).as_millis();
        assert_eq!([20, 150, 15_000, 30].map(&mut pass), [0, 0, 15_000, 0]);
        assert_eq!(clock.awake(), Duration::from_millis(20 + 150 + 20 + 30));
    }

    #[test]
    fn a_process_that_slept_says_for_how_long() {
        let mut clock = AwakeClock::start();
        assert!(clock.look() < Duration::from_secs(5), "nothing has slept yet");
        clock.last -= Duration::from_secs(10);
        assert!(clock.look() >= Duration::from_secs(10));
        assert!(clock.awake() < Duration::from_secs(1), "{clock:?}");
        let before = clock.awake();
        clock.last -= Duration::from_millis(100);
        clock.skip();
        assert_eq!(clock.awake(), before, "time that is skipped does not count");
    }

    #[test]
    fn patience_ends_after_its_limit() {
        assert!(Patience::of(Duration::ZERO).is_over());
        let mut patience = Patience::of(Duration::from_millis(400));
        patience.clock.last -= Duration::from_secs(3600);
        assert!(!patience.is_over(), "an hour asleep is no waiting");
        for _ in 0..2 {
            patience.clock.pass(STEP_MAX);
        }
        assert!(patience.is_over());
    }
}
