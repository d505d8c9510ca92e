//! A Kalman filter for a quantity that is measured now and then, while its rate is measured in between with an offset.
//!
//! Two states: the quantity and the offset of its rate, which is a random walk. For a position, the rate is the velocity through the
//! air and the offset is the wind; for a heading, they are the turn rate and the bias of the gyroscope. The filter is the alpha-beta
//! filter with gains that follow from the variances (Bar-Shalom, Li and Kirubarajan, *Estimation with Applications to Tracking and
//! Navigation*, 2001, Section 6.2, there called a nearly constant velocity model). With fixes at intervals that are short compared with
//! its memory, it comes to rest at the closed form of Kalman and Bucy, which the tests check.
//!
//! Never knows what the quantity is: an angle has to be wrapped by its owner.

/// The filter of one quantity, in its unit u.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct OffsetFilter {
    /// The estimate of the quantity.
    pub(super) value: f64,
    /// The estimate of what has to be added to the measured rate, in u/s.
    pub(super) offset: f64,
    /// Variance of the value, u^2.
    variance: f64,
    /// Covariance of both, u^2/s.
    covariance: f64,
    /// Variance of the offset, u^2/s^2.
    offset_variance: f64,
    /// How fast the variance of the offset grows, u^2/s^3.
    offset_walk: f64,
}

impl OffsetFilter {
    /// A filter that begins with a measured value and a guess of the offset, each with its variance.
    pub(super) fn begun(
        [value, variance]: [f64; 2],
        [offset, offset_variance]: [f64; 2],
        offset_walk: f64,
    ) -> Self {
        Self { value, offset, variance, covariance: 0.0, offset_variance, offset_walk }
    }

    /// Goes on by `elapsed_s`, in which the measured rate alone makes `way`, with a variance of `way_variance`.
    pub(super) fn predict(&mut self, way: f64, way_variance: f64, elapsed_s: f64) {
        let walked = self.offset_walk * elapsed_s;
        self.value += way + self.offset * elapsed_s;
        // What the random walk of the offset adds to each variance is exact for any step.
        self.variance += elapsed_s * (2.0 * self.covariance + elapsed_s * self.offset_variance)
            + way_variance
            + walked * elapsed_s * elapsed_s / 3.0;
        self.covariance += elapsed_s * (self.offset_variance + walked / 2.0);
        self.offset_variance += walked;
    }

    /// Takes in a measurement of the value with a variance of `noise_variance`, which is off the estimate by `innovation`.
    pub(super) fn correct(&mut self, innovation: f64, noise_variance: f64) {
        let total = self.variance + noise_variance;
        let (gain, offset_gain) = (self.variance / total, self.covariance / total);
        self.value += gain * innovation;
        self.offset += offset_gain * innovation;
        self.offset_variance -= offset_gain * self.covariance;
        // As products and not as differences, so that rounding makes no variance negative.
        self.covariance *= noise_variance / total;
        self.variance *= noise_variance / total;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ringwing_flight::draw::Draws;

    // Noise of each measurement, in u, and the strength of the walk, in u^2/s^3.
    const NOISE: f64 = 0.5;
    const WALK: f64 = 0.4;
    const STEP_S: f64 = 0.01;
    /// Steps in which errors are measured, after those in which the filter comes to rest.
    const COUNT: u32 = 400_000;

    fn filter() -> OffsetFilter {
        OffsetFilter::begun([0.0, NOISE * NOISE], [0.0, 100.0], WALK)
    }

    /// The variances at rest of value and offset in continuous time, with noise of the spectral density r and a walk of q: the
    /// solution of Kalman and Bucy's Riccati equation for a double integrator, `sqrt(2) r^(3/4) q^(1/4)` and
    /// `sqrt(2) r^(1/4) q^(3/4)`.
    fn at_rest() -> [f64; 2] {
        let density = NOISE * NOISE * STEP_S;
        [(0.75, 0.25), (0.25, 0.75)].map(|(r, q)| 2_f64.sqrt() * density.powf(r) * WALK.powf(q))
    }

    #[test]
    fn the_variances_come_to_the_closed_form() {
        let mut filter = filter();
        let mut means = [0.0; 2];
        for _ in 0..5000 {
            filter.predict(0.0, 0.0, STEP_S);
            let before = [filter.variance, filter.offset_variance];
            filter.correct(0.0, NOISE * NOISE);
            // Continuous time lies in the middle between before and after a measurement.
            let after = [filter.variance, filter.offset_variance];
            means = std::array::from_fn(|place| f64::midpoint(before[place], after[place]));
        }
        for (mean, expected) in means.into_iter().zip(at_rest()) {
            assert!((mean / expected - 1.0).abs() < 0.01, "{mean} {expected}");
        }
    }

    #[test]
    fn the_errors_have_the_variances_that_the_filter_claims() {
        let mut draws = Draws::new(1, [0; 3], 0);
        let (mut filter, mut truth, mut wind) = (filter(), 0.0, 3.0);
        let mut squares = [0.0; 2];
        for step in 0..COUNT + 5000 {
            wind += (WALK * STEP_S).sqrt() * draws.normal();
            truth += (7.0 + wind) * STEP_S;
            filter.predict(7.0 * STEP_S, 0.0, STEP_S);
            filter.correct(truth + NOISE * draws.normal() - filter.value, NOISE * NOISE);
            if step >= 5000 {
                squares[0] += (filter.value - truth).powi(2);
                squares[1] += (filter.offset - wind).powi(2);
            }
        }
        for (square, expected) in squares.into_iter().zip(at_rest()) {
            let variance = square / f64::from(COUNT);
            assert!((variance / expected - 1.0).abs() < 0.08, "{variance} {expected}");
        }
    }

    #[test]
    fn a_steady_offset_is_learnt_and_carries_the_value_on_without_measurements() {
        let mut filter = OffsetFilter::begun([0.0, 1e-4], [0.0, 100.0], 1e-6);
        for step in 1..=1000 {
            filter.predict(0.1, 0.0, 0.1);
            filter.correct(0.3 * f64::from(step) - filter.value, 1e-4);
        }
        assert!((filter.offset - 2.0).abs() < 1e-3, "{}", filter.offset);
        (0..50).for_each(|_| filter.predict(0.1, 0.0, 0.1));
        assert!((filter.value - 315.0).abs() < 0.02, "{}", filter.value);
        // Without measurements it is less and less sure.
        assert!(filter.variance > 1e-4);
    }
}
