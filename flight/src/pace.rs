//! What simulated time waits for, and how fast it passes.

/// Shortest wall-clock time of a flight whose real-time factor is measured, in seconds. The launcher notices the begin and
/// the end of a flight a millisecond late, so the factor of a shorter one would be noise; a larger bound hides the factor of
/// short flights.
const MEASURABLE_S: f64 = 0.01;

/// What has to happen before the world opens the next tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pace {
    /// Every process has answered the tick before. The same scenario gives the same payloads, whatever the scheduling.
    Lockstep,
    /// The tick's deadline by the wall clock has come, whoever has answered.
    RealTime,
}

/// How many times faster than the wall clock the flight was; `None` if it was too short to tell.
pub fn real_time_factor(simulated_s: f64, wall_s: f64) -> Option<f64> {
    // A flight that ends at the approach tick has simulated less than no time.
    (wall_s >= MEASURABLE_S && simulated_s > 0.0).then(|| simulated_s / wall_s)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_factor_is_absent_where_it_cannot_be_measured() {
        assert_eq!(real_time_factor(10.0, 2.0), Some(5.0));
        assert_eq!(real_time_factor(10.0, 2.2e-6), None);
        assert_eq!(real_time_factor(-0.01, 1.0), None);
        assert_eq!(real_time_factor(0.0, 0.0), None);
    }
}
