//! The wind of random scenarios.
//!
//! Never makes a scenario invalid: every airframe can follow its slot in the mean wind.

use super::Dice;
use ringwing_scenario::{PathKind, Scenario};

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
}
