//! How slowly, how fast and how tightly airframes flew.
//!
//! Never judges: whether an airframe may fly so is the world's business.

use super::TrueState;

/// The extremes of speeds and turn rates flown.
#[derive(Debug, Clone, Copy)]
pub(super) struct Envelope {
    pub(super) speed_min_m_s: f64,
    pub(super) speed_max_m_s: f64,
    pub(super) turn_rate_max_rad_s: f64,
}

impl Envelope {
    pub(super) fn of(state: &TrueState) -> Self {
        Self {
            speed_min_m_s: state.speed_m_s,
            speed_max_m_s: state.speed_m_s,
            turn_rate_max_rad_s: state.turn_rate_rad_s.abs(),
        }
    }

    pub(super) fn widen(&mut self, state: &TrueState) {
        self.speed_min_m_s = self.speed_min_m_s.min(state.speed_m_s);
        self.speed_max_m_s = self.speed_max_m_s.max(state.speed_m_s);
        self.turn_rate_max_rad_s = self.turn_rate_max_rad_s.max(state.turn_rate_rad_s.abs());
    }
}
