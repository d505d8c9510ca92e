//! How a slot moves, over the ground and through the air, as far as the law flies that ahead of any error.
//!
//! Never knows where the UAV is: a slot moves as the leader's velocity and turn rate make it.

use super::leader_estimate::EstimatedLeader;
use crate::law::speed_force;
use nalgebra::Vector2;
use ringwing_flight::FormationFrame;

/// What a UAV in its slot flies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SlotMotion {
    /// The velocity of the slot.
    pub velocity_m_s: Vector2<f64>,
    /// The rate at which that velocity turns. 0 without feed-forward, because Eq. (6) has no such term.
    pub turn_rate_rad_s: f64,
}

impl SlotMotion {
    /// The paper's: the leader's velocity, Eq. (5), whatever the leader's turn.
    pub(super) fn straight(leader: &EstimatedLeader) -> Self {
        let velocity_m_s = speed_force(leader.track.speed_m_s, leader.pose.heading_rad);
        Self { velocity_m_s, turn_rate_rad_s: 0.0 }
    }

    /// That of a slot `offset_m` from a leader that turns.
    ///
    /// In both frames the velocity turns as fast as the leader: in a fixed one it is the leader's, and in the leader's frame
    /// it keeps its angle to the heading.
    pub(super) fn turning(leader: &EstimatedLeader, frame: FormationFrame, offset_m: Vector2<f64>) -> Self {
        let turn_rate_rad_s = leader.track.turn_rate_rad_s;
        let straight = Self::straight(leader);
        let velocity_m_s = frame.velocity_m_s(straight.velocity_m_s, turn_rate_rad_s, offset_m);
        Self { velocity_m_s, turn_rate_rad_s }
    }

    /// The same motion seen from air that moves at `wind_m_s`: what a UAV in the slot flies.
    ///
    /// The velocity v over the ground turns at omega. That through the air, a = v - w, turns at omega (a . v) / |a|^2, because the
    /// wind w does not turn.
    pub(super) fn in_wind(self, wind_m_s: Vector2<f64>) -> Self {
        // In still air, return the same bits.
        if wind_m_s == Vector2::zeros() {
            return self;
        }
        let air_m_s = self.velocity_m_s - wind_m_s;
        let squared = air_m_s.norm_squared();
        // A slot that drifts with the air has no direction that could turn.
        let share = if squared > 0.0 { air_m_s.dot(&self.velocity_m_s) / squared } else { 0.0 };
        Self { velocity_m_s: air_m_s, turn_rate_rad_s: self.turn_rate_rad_s * share }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ringwing_flight::turned;

    #[test]
    fn the_velocity_through_the_air_turns_as_its_direction_does() {
        let (velocity_m_s, turn_rate_rad_s) = (Vector2::new(9.0, 12.0), 0.1);
        let wind_m_s = Vector2::new(6.0, -3.0);
        let through_the_air = SlotMotion { velocity_m_s, turn_rate_rad_s }.in_wind(wind_m_s);
        assert_eq!(through_the_air.velocity_m_s, Vector2::new(3.0, 15.0));
        let direction_rad = |time_s: f64| {
            let air = turned(velocity_m_s, turn_rate_rad_s * time_s) - wind_m_s;
            air.y.atan2(air.x)
        };
        let numeric = (direction_rad(1e-4) - direction_rad(-1e-4)) / 2e-4;
        assert!((through_the_air.turn_rate_rad_s - numeric).abs() < 1e-8, "{numeric}");
    }
}
