//! Wind, broken airframes and sensors of random scenarios.
//!
//! Never makes a scenario invalid: every airframe can follow its slot in the mean wind.

use super::Dice;
use ringwing_scenario::{
    Action, Fault, PathKind, Scenario,
    fault::{ProcessFault, SensorDrift},
};

impl Dice {
    /// Wind and gusts for a third of the flights. The mean wind is so weak that every airframe can follow its slot.
    pub(super) fn set_wind(&mut self, scenario: &mut Scenario) {
        if !self.one_in(3) {
            return;
        }
        // A turn may take all of the speeds that the airframes have to spare, and a mean wind takes from them as well.
        let is_straight = scenario.leader.path.kind == PathKind::Straight;
        let wind = &mut scenario.wind;
        wind.mean_speed_m_s = if is_straight { self.number(0.0, 1.5) } else { 0.0 };
        wind.from_deg = self.number(-180.0, 180.0);
        wind.turbulence_m_s = self.pick(&[0.0, 7.7, 15.4]);
        wind.height_m = self.number(10.0, 300.0);
        wind.known = self.one_in(2);
        scenario.control.wind_time_s = self.pick(&[0.1, 0.5, 2.0]);
    }

    /// Lags for a quarter of the flights, and a broken airframe for another one.
    pub(super) fn break_airframe(&mut self, scenario: &mut Scenario) {
        if self.one_in(4) {
            scenario.airframe.speed_lag_s = self.pick(&[0.0, 0.3, 1.0]);
            scenario.airframe.acceleration_max_m_s2 = self.pick(&[0.0, 3.0]);
            scenario.airframe.turn_lag_s = self.pick(&[0.0, 0.02, 0.3]);
            scenario.airframe.turn_acceleration_max_rad_s2 = self.pick(&[0.0, 1.0]);
        }
        if !self.one_in(4) {
            return;
        }
        let for_s = self.one_in(2).then(|| self.number(0.01, 5.0));
        let fault = if self.one_in(2) {
            ProcessFault::Weaken { to_m_s: self.number(10.0, 20.0), for_s }
        } else {
            ProcessFault::Jam { turn_rate_rad_s: self.number(-0.6, 0.6), for_s }
        };
        let targets = self.some_uavs(scenario.formation.uavs);
        let at_s = self.number(0.0, scenario.time.duration_s);
        scenario.faults.push(Fault { at_s, action: Action::Process { fault, targets } });
    }

    /// Sensors with errors for a third of the flights, each of them with half of the errors.
    pub(super) fn set_sensors(&mut self, scenario: &mut Scenario) {
        if !self.one_in(3) {
            return;
        }
        let sensors = &mut scenario.sensors;
        sensors.position_rate_hz = self.pick(&[0.0, 5.0, 7.5, 50.0]);
        sensors.position_noise_m = self.pick(&[0.0, 0.5]);
        sensors.position_bias_m = self.pick(&[0.0, 1.0]);
        sensors.position_bias_time_s = self.number(1.0, 100.0);
        sensors.position_dropout = self.pick(&[0.0, 0.2]);
        sensors.position_dropout_s = self.pick(&[0.0, 1.0]);
        sensors.heading_rate_hz = self.pick(&[0.0, 20.0]);
        sensors.heading_noise_deg = self.pick(&[0.0, 2.0]);
        sensors.heading_bias_deg = self.pick(&[0.0, 2.0]);
        sensors.airspeed_noise_m_s = self.pick(&[0.0, 0.5]);
        sensors.airspeed_bias_m_s = self.pick(&[0.0, 0.5]);
        sensors.turn_rate_noise_rad_s = self.pick(&[0.0, 0.01]);
        sensors.turn_rate_bias_rad_s = self.pick(&[0.0, 0.003]);
        // Both ways to fly, under either law.
        scenario.control.pose_estimated ^= self.one_in(4);
    }

    /// A sensor that drifts, for a quarter of the flights.
    pub(super) fn drift(&mut self, scenario: &mut Scenario) {
        if !self.one_in(4) {
            return;
        }
        let drift = if self.one_in(2) {
            SensorDrift::Position { speed_m_s: self.number(0.1, 2.0), toward_rad: self.number(-3.0, 3.0) }
        } else {
            SensorDrift::Heading { rate_rad_s: self.number(-0.1, 0.1) }
        };
        let for_s = self.one_in(2).then(|| self.number(0.01, 5.0));
        let targets = self.some_uavs(scenario.formation.uavs);
        let at_s = self.number(0.0, scenario.time.duration_s);
        let action = Action::Process { fault: ProcessFault::Drift { drift, for_s }, targets };
        scenario.faults.push(Fault { at_s, action });
    }
}
