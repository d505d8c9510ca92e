//! Simulated time as the log has it.
//!
//! Must never read a clock: the same tick gives the same time in every run.

use foxglove::messages::Timestamp;

/// The log time of tick 0: 2026-01-01T00:00:00Z. Arbitrary, but after 1970, because viewers show log times as dates.
const EPOCH_S: u64 = 1_767_225_600;
const NANOSECONDS: u64 = 1_000_000_000;

/// Converts ticks to log times.
#[derive(Debug, Clone, Copy)]
pub struct Clock {
    rate_hz: u32,
}

impl Clock {
    /// A clock of `rate_hz` ticks a second.
    pub fn new(rate_hz: u32) -> Self {
        Self { rate_hz }
    }

    /// Ticks a second.
    pub(crate) fn rate_hz(self) -> u32 {
        self.rate_hz
    }

    /// The log time of `tick`, in nanoseconds since 1970. Ticks before 0 have the time of tick 0.
    pub fn log_time_ns(self, tick: i64) -> u64 {
        EPOCH_S * NANOSECONDS + self.elapsed_ns(tick)
    }

    /// The tick whose log time is `log_time_ns`, if there is one.
    pub(crate) fn tick_at(self, log_time_ns: u64) -> Option<i64> {
        let elapsed_ns = log_time_ns.checked_sub(EPOCH_S * NANOSECONDS)?;
        // Log times are rounded down, by less than a period, so the quotient is rounded up.
        let tick = (u128::from(elapsed_ns) * u128::from(self.rate_hz)).div_ceil(u128::from(NANOSECONDS));
        i64::try_from(tick).ok().filter(|tick| self.elapsed_ns(*tick) == elapsed_ns)
    }

    /// The log time of `tick` as Foxglove's messages have it.
    pub(crate) fn timestamp(self, tick: i64) -> Timestamp {
        let elapsed = self.elapsed_ns(tick);
        Timestamp::new((EPOCH_S + elapsed / NANOSECONDS) as u32, (elapsed % NANOSECONDS) as u32)
    }

    /// The number of the interval of 1 / `hz` seconds that contains `tick`.
    pub(crate) fn interval(self, tick: i64, hz: u32) -> i64 {
        // In integers, because a rounded quotient would put some ticks into the wrong interval. Euclidean, so that
        // the tick before 0 belongs to an interval of its own and tick 0 is always due.
        (tick * i64::from(hz)).div_euclid(i64::from(self.rate_hz))
    }

    /// Whether `tick` is the first of its interval: `hz` times a second, or every tick if the tick rate is lower.
    pub(crate) fn is_due(self, tick: i64, hz: u32) -> bool {
        self.interval(tick, hz) != self.interval(tick - 1, hz)
    }

    fn elapsed_ns(self, tick: i64) -> u64 {
        // Multiply before dividing: the period of most rates is not a whole number of nanoseconds, and its error
        // would grow with the ticks. In 128 bits, because the product of a large tick overflows 64.
        let elapsed =
            u128::from(tick.max(0).cast_unsigned()) * u128::from(NANOSECONDS) / u128::from(self.rate_hz);
        elapsed as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tick_lies_at_its_multiple_of_the_period() {
        let clock = Clock::new(100);
        assert_eq!(clock.log_time_ns(0), 1_767_225_600_000_000_000);
        assert_eq!(clock.log_time_ns(-1), clock.log_time_ns(0));
        assert_eq!(clock.log_time_ns(1234) - clock.log_time_ns(0), 12_340_000_000);
        assert_eq!(clock.timestamp(1234), Timestamp::new(1_767_225_612, 340_000_000));
    }

    #[test]
    fn a_log_time_gives_back_its_tick() {
        for rate_hz in [1, 3, 7, 60, 100, 999, 1000] {
            let clock = Clock::new(rate_hz);
            for tick in (0..5000).chain([u32::MAX.into()]) {
                assert_eq!(clock.tick_at(clock.log_time_ns(tick)), Some(tick), "{rate_hz} Hz");
            }
            for beside in [0, clock.log_time_ns(0) - 1, clock.log_time_ns(5) + 1, u64::MAX] {
                assert_eq!(clock.tick_at(beside), None, "{rate_hz} Hz");
            }
        }
    }

    #[test]
    fn twenty_hertz_is_due_twenty_times_a_second_at_any_higher_rate() {
        for rate_hz in [1, 10, 20, 30, 50, 100, 200, 1000] {
            let clock = Clock::new(rate_hz);
            let due = (0..i64::from(rate_hz)).filter(|tick| clock.is_due(*tick, 20)).count();
            assert_eq!(due, rate_hz.min(20) as usize, "at {rate_hz} Hz");
            assert!(clock.is_due(0, 20));
        }
    }
}
