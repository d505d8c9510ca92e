//! How a slot moves, as far as the law flies that ahead of any error.
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
}
