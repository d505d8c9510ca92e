//! Whether the formation turns with its leader.
//!
//! Must never know the shape of the formation: it turns offsets from the centre, whatever they are.

use crate::{PathMotion, turned};
use nalgebra::Vector2;
use serde::{Deserialize, Serialize};

/// The frame in which the formation keeps its bearing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FormationFrame {
    /// The local frame: the formation never turns, and every slot moves as the leader does.
    Fixed,
    /// That of the leader, whose x axis is its heading: the formation turns with it, and outer slots move faster.
    Leader,
}

impl FormationFrame {
    /// `offset`, from the centre to a slot, in the local frame while the leader heads for `heading_rad`.
    pub fn placed(self, offset_m: Vector2<f64>, heading_rad: f64) -> Vector2<f64> {
        match self {
            Self::Fixed => offset_m,
            Self::Leader => turned(offset_m, heading_rad),
        }
    }

    /// `offset`, from the centre in the local frame, as the formation sees it: the inverse of [`placed`](Self::placed).
    pub fn seen(self, offset_m: Vector2<f64>, heading_rad: f64) -> Vector2<f64> {
        self.placed(offset_m, -heading_rad)
    }

    /// The rate at which the formation turns with a leader that turns at `turn_rate_rad_s`.
    pub fn turn_rate_rad_s(self, turn_rate_rad_s: f64) -> f64 {
        match self {
            Self::Fixed => 0.0,
            Self::Leader => turn_rate_rad_s,
        }
    }

    /// The velocity of the place `offset_m` from a leader that moves at `velocity_m_s` and turns at `turn_rate_rad_s`:
    /// `v_d h_d + omega x offset`, with the offset in the local frame.
    pub fn velocity_m_s(
        self,
        velocity_m_s: Vector2<f64>,
        turn_rate_rad_s: f64,
        offset_m: Vector2<f64>,
    ) -> Vector2<f64> {
        let rate_rad_s = self.turn_rate_rad_s(turn_rate_rad_s);
        // Without a turn, return the same bits: adding a product with zero could still change the sign of a zero.
        if rate_rad_s == 0.0 {
            return velocity_m_s;
        }
        velocity_m_s + Vector2::new(-offset_m.y, offset_m.x) * rate_rad_s
    }
}

/// How the leader moves through the air, seen in the frame in which the formation keeps its bearing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrameMotion {
    frame: FormationFrame,
    velocity_m_s: Vector2<f64>,
    turn_rate_rad_s: f64,
}

impl FrameMotion {
    /// Of a leader that moves like this over the ground, in a wind of this velocity.
    pub fn new(frame: FormationFrame, leader: &PathMotion, wind_m_s: Vector2<f64>) -> Self {
        let PathMotion { pose, speed_m_s, turn_rate_rad_s } = *leader;
        let velocity_m_s = match frame {
            FormationFrame::Fixed => leader.velocity_m_s() - wind_m_s,
            // In its own frame the leader always heads along the x axis.
            FormationFrame::Leader => Vector2::new(speed_m_s, 0.0) - turned(wind_m_s, -pose.heading_rad),
        };
        Self { frame, velocity_m_s, turn_rate_rad_s }
    }

    /// The velocity through the air, in this frame, of a place that rests at `offset_m` from the leader.
    pub fn velocity_m_s(&self, offset_m: Vector2<f64>) -> Vector2<f64> {
        self.frame.velocity_m_s(self.velocity_m_s, self.turn_rate_rad_s, offset_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Pose, direction};
    use nalgebra::Point2;
    use std::f64::consts::FRAC_PI_2;

    #[test]
    fn a_slot_behind_the_leader_stays_behind_it_only_in_its_frame() {
        let behind = Vector2::new(-40.0, 0.0);
        assert_eq!(FormationFrame::Fixed.placed(behind, FRAC_PI_2), behind);
        assert!((FormationFrame::Leader.placed(behind, FRAC_PI_2) - Vector2::new(0.0, -40.0)).norm() < 1e-12);
        assert_eq!(FormationFrame::Leader.placed(behind, 0.0), behind);
        for frame in [FormationFrame::Fixed, FormationFrame::Leader] {
            assert!((frame.seen(frame.placed(behind, 0.7), 0.7) - behind).norm() < 1e-12);
        }
    }

    #[test]
    fn the_velocity_of_a_slot_is_the_rate_of_its_place() {
        let (leader, rate, offset) =
            (Pose { position: Point2::new(5.0, 6.0), heading_rad: 1.0 }, 0.05, [30.0, -20.0]);
        for frame in [FormationFrame::Fixed, FormationFrame::Leader] {
            let slot = |time_s: f64| {
                let pose = leader.after(15.0, rate, time_s);
                pose.position + frame.placed(offset.into(), pose.heading_rad)
            };
            let numeric = (slot(1e-4) - slot(-1e-4)) / 2e-4;
            let placed = frame.placed(offset.into(), leader.heading_rad);
            let velocity = frame.velocity_m_s(direction(1.0) * 15.0, rate, placed);
            assert!((velocity - numeric).norm() < 1e-6, "{frame:?}");
        }
    }
}
