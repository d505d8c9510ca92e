//! The leader's path: straight on at constant speed (Assumption 1).
//!
//! The path must depend on the tick alone, so that a replacement continues exactly where the lost leader would be.

use nalgebra::Point2;
use ringwing_flight::{LeaderState, Pose, Tick, wrap};
use ringwing_scenario::Scenario;

/// Where the leader is at each tick.
#[derive(Debug, Clone, PartialEq)]
pub struct Path {
    start: Pose,
    speed_m_s: f64,
    rate_hz: u32,
}

impl Path {
    /// The leader's path in `scenario`.
    pub fn new(scenario: &Scenario) -> Self {
        let leader = &scenario.leader;
        let start = Pose {
            position: Point2::from(leader.start_m),
            heading_rad: wrap(leader.heading_deg.to_radians()),
        };
        Self { start, speed_m_s: leader.speed_m_s, rate_hz: scenario.time.rate_hz }
    }

    /// The leader's state at `tick`.
    pub fn at(&self, tick: Tick) -> LeaderState {
        // From the start and not from the tick before: a replacement does not know that one, and rounding would add up.
        let pose = self.start.after(self.speed_m_s, 0.0, tick.seconds(self.rate_hz));
        LeaderState {
            tick,
            position_m: pose.position.into(),
            heading_rad: pose.heading_rad,
            speed_m_s: self.speed_m_s,
            turn_rate_rad_s: 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_leader_of_the_paper_reaches_obstacle_1_after_a_minute() {
        let path = Path::new(&Scenario::default());
        assert_eq!(path.at(Tick(0)).position_m, [0.0, 0.0]);
        assert_eq!(path.at(Tick(6000)).position_m, [900.0, 0.0]);
        assert_eq!(path.at(Tick(6000)).heading_rad, 0.0);
    }

    #[test]
    fn the_leader_flies_in_the_direction_of_its_heading() {
        let mut scenario = Scenario::default();
        scenario.leader.start_m = [10.0, 20.0];
        scenario.leader.heading_deg = 90.0;
        let [x, y] = Path::new(&scenario).at(Tick(200)).position_m;
        assert!((x - 10.0).abs() < 1e-9 && (y - 50.0).abs() < 1e-9);
    }
}
