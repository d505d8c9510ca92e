//! The air that the swarm flies in.

use nalgebra::Vector2;
use ringwing_flight::direction;
use serde::{Deserialize, Serialize};

/// `[wind]`: the air that the swarm flies in. By default it is still.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct WindSection {
    /// Speed of the mean wind.
    pub mean_speed_m_s: f64,
    /// Where the mean wind comes from: 0 is a wind from the east, 90 one from the north, as headings count.
    pub from_deg: f64,
    /// Intensity of the gusts as MIL-F-8785C gives it: the wind speed at 20 feet above the ground. 7.7 is light turbulence,
    /// 15.4 moderate, 23.2 severe; 0 means no gusts.
    pub turbulence_m_s: f64,
    /// Height of the flight above the ground, on which the strength and length of gusts depend.
    pub height_m: f64,
    /// Tell every agent the mean wind.
    pub known: bool,
}

impl Default for WindSection {
    fn default() -> Self {
        // At 100 m a gust is 263 m long. Lower down gusts are shorter and stronger.
        Self { mean_speed_m_s: 0.0, from_deg: 180.0, turbulence_m_s: 0.0, height_m: 100.0, known: false }
    }
}

impl WindSection {
    /// Whether the air never moves.
    pub fn is_still(&self) -> bool {
        self.mean_speed_m_s == 0.0 && self.turbulence_m_s == 0.0
    }

    /// The velocity of the mean wind: where it blows to, in m/s.
    pub fn mean_m_s(&self) -> Vector2<f64> {
        // Without a speed, the product could have a negative zero, which would change the bits of a flight in still air.
        if self.mean_speed_m_s == 0.0 {
            return Vector2::zeros();
        }
        direction(self.from_deg.to_radians()) * -self.mean_speed_m_s
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wind_from_the_north_blows_to_the_south() {
        let wind = WindSection { mean_speed_m_s: 6.0, from_deg: 90.0, ..WindSection::default() };
        assert!((wind.mean_m_s() - Vector2::new(0.0, -6.0)).norm() < 1e-12);
        assert!(!wind.is_still() && WindSection::default().is_still());
        assert!(WindSection::default().mean_m_s().iter().all(|part| part.is_sign_positive()));
    }
}
