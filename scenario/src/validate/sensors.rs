//! The bounds of the sensors.

use super::violation::{Violation, quantity};
use crate::Scenario;

/// Largest error of a position, in metres. A larger one is a mistake: the swarm would lose itself.
const POSITION_MAX_M: f64 = 1000.0;
/// Largest error of a speed, in m/s; no airspeed sensor is that wrong.
const SPEED_MAX_M_S: f64 = 100.0;
/// Largest error of a turn rate, in rad/s; no gyroscope is that wrong.
const TURN_RATE_MAX_RAD_S: f64 = 10.0;
/// Longest time that a bias or a dropout may last: a day, as a flight.
const TIME_MAX_S: f64 = 24.0 * 3600.0;
/// Largest share of fixes that may fail. With all of them, no UAV would know its position after the start.
const DROPOUT_MAX: f64 = 0.99;

/// The bounds of each quantity, and rates above that of the flight.
pub(super) fn quantities(scenario: &Scenario) -> impl Iterator<Item = Violation> {
    let sensors = &scenario.sensors;
    let tick_rate = quantity("time.rate_hz", scenario.time.rate_hz);
    let rate = |key, value: f64| {
        let rate = quantity(key, value);
        // A sensor is read at most once per tick. A tick rate of 0 has a message of its own.
        rate.not_below_zero().or_else(|| (tick_rate.value > 0.0).then(|| rate.at_most(tick_rate)).flatten())
    };
    [
        rate("sensors.position_rate_hz", sensors.position_rate_hz),
        quantity("sensors.position_noise_m", sensors.position_noise_m).within(0.0..=POSITION_MAX_M),
        quantity("sensors.position_bias_m", sensors.position_bias_m).within(0.0..=POSITION_MAX_M),
        quantity("sensors.position_bias_time_s", sensors.position_bias_time_s).timeout(TIME_MAX_S),
        quantity("sensors.position_dropout", sensors.position_dropout).within(0.0..=DROPOUT_MAX),
        quantity("sensors.position_dropout_s", sensors.position_dropout_s).within(0.0..=TIME_MAX_S),
        rate("sensors.heading_rate_hz", sensors.heading_rate_hz),
        quantity("sensors.heading_noise_deg", sensors.heading_noise_deg).within(0.0..=180.0),
        quantity("sensors.heading_bias_deg", sensors.heading_bias_deg).within(0.0..=180.0),
        quantity("sensors.heading_bias_time_s", sensors.heading_bias_time_s).timeout(TIME_MAX_S),
        quantity("sensors.airspeed_noise_m_s", sensors.airspeed_noise_m_s).within(0.0..=SPEED_MAX_M_S),
        quantity("sensors.airspeed_bias_m_s", sensors.airspeed_bias_m_s).within(0.0..=SPEED_MAX_M_S),
        quantity("sensors.turn_rate_noise_rad_s", sensors.turn_rate_noise_rad_s)
            .within(0.0..=TURN_RATE_MAX_RAD_S),
        quantity("sensors.turn_rate_bias_rad_s", sensors.turn_rate_bias_rad_s)
            .within(0.0..=TURN_RATE_MAX_RAD_S),
    ]
    .into_iter()
    .flatten()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sensor_cannot_be_read_more_often_than_the_flight_has_ticks_and_either_rate_may_be_to_blame() {
        let mut scenario = Scenario::default();
        scenario.sensors.heading_rate_hz = 200.0;
        let violation = quantities(&scenario).next().unwrap();
        let blames: Vec<_> = violation.blames.iter().map(|blame| (&*blame.key, &*blame.message)).collect();
        assert_eq!(
            blames,
            [
                ("time.rate_hz", "100 Hz is below sensors.heading_rate_hz 200 Hz: give a larger value"),
                ("sensors.heading_rate_hz", "200 Hz is above time.rate_hz 100 Hz: give a smaller value"),
            ]
        );
    }
}
