//! How well each UAV senses its own flight.

use serde::{Deserialize, Serialize};

/// `[sensors]`: how well each UAV senses its own flight. By default it does so exactly, in every tick.
///
/// Each error is noise, which is drawn anew for every reading, and a bias. The biases of position and heading wander: they are
/// first-order Gauss-Markov processes, whose standard deviation is the same at all times.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SensorsSection {
    /// Fixes of the position per second, as of a satellite receiver; between two fixes, the last one is repeated. 0 means one in
    /// every tick.
    pub position_rate_hz: f64,
    /// Standard deviation of the noise of each coordinate.
    pub position_noise_m: f64,
    /// Standard deviation of the bias of each coordinate.
    pub position_bias_m: f64,
    /// Time in which that bias forgets 63 % of itself.
    pub position_bias_time_s: f64,
    /// Share of fixes that fail, from 0 to 1.
    pub position_dropout: f64,
    /// Mean time for which fixes fail in a row; 0 means that each one fails by itself.
    pub position_dropout_s: f64,
    /// Readings of the heading per second, as of a compass; 0 means one in every tick.
    pub heading_rate_hz: f64,
    /// Standard deviation of the noise of the heading.
    pub heading_noise_deg: f64,
    /// Standard deviation of the bias of the heading.
    pub heading_bias_deg: f64,
    /// Time in which that bias forgets 63 % of itself.
    pub heading_bias_time_s: f64,
    /// Standard deviation of the noise of the speed through the air, which is read in every tick.
    pub airspeed_noise_m_s: f64,
    /// Standard deviation of the bias of that speed. Each UAV has one bias for the whole flight.
    pub airspeed_bias_m_s: f64,
    /// Standard deviation of the noise of the turn rate, as of a gyroscope, which is read in every tick.
    pub turn_rate_noise_rad_s: f64,
    /// Standard deviation of the bias of the turn rate. Each UAV has one bias for the whole flight.
    pub turn_rate_bias_rad_s: f64,
}

impl Default for SensorsSection {
    fn default() -> Self {
        Self {
            position_rate_hz: 0.0,
            position_noise_m: 0.0,
            position_bias_m: 0.0,
            // What the errors of satellite clocks and of the ionosphere take to change. Shorter looks more like noise.
            position_bias_time_s: 60.0,
            position_dropout: 0.0,
            position_dropout_s: 0.0,
            heading_rate_hz: 0.0,
            heading_noise_deg: 0.0,
            heading_bias_deg: 0.0,
            heading_bias_time_s: 60.0,
            airspeed_noise_m_s: 0.0,
            airspeed_bias_m_s: 0.0,
            turn_rate_noise_rad_s: 0.0,
            turn_rate_bias_rad_s: 0.0,
        }
    }
}

impl SensorsSection {
    /// Whether every UAV senses its own flight exactly, in every tick.
    pub fn are_perfect(&self) -> bool {
        let perfect = Self::default();
        // Without biases and dropouts it does not matter how fast biases wander or how long dropouts last.
        let Self { position_bias_time_s, position_dropout_s, heading_bias_time_s, .. } = *self;
        *self == Self { position_bias_time_s, position_dropout_s, heading_bias_time_s, ..perfect }
    }

    /// Whether any error is drawn with the seed.
    pub fn are_random(&self) -> bool {
        // A low rate repeats values, and draws nothing.
        !Self { position_rate_hz: 0.0, heading_rate_hz: 0.0, ..self.clone() }.are_perfect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sensors_are_perfect_until_a_key_makes_them_err() {
        let perfect = SensorsSection::default();
        let settled =
            SensorsSection { position_bias_time_s: 5.0, position_dropout_s: 2.0, ..perfect.clone() };
        assert!(perfect.are_perfect() && settled.are_perfect() && !settled.are_random());
        let slow = SensorsSection { position_rate_hz: 10.0, ..perfect.clone() };
        assert!(!slow.are_perfect() && !slow.are_random());
        let noisy = SensorsSection { airspeed_noise_m_s: 0.5, ..perfect };
        assert!(!noisy.are_perfect() && noisy.are_random());
    }
}
