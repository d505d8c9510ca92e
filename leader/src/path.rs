//! The leader's state at each tick of a flight.
//!
//! The path must depend on the tick alone, so that a replacement continues exactly where the lost leader would be.

use ringwing_flight::{LeaderPath, LeaderState, PathMotion, Tick};
use ringwing_scenario::Scenario;

/// Where the leader is at each tick.
#[derive(Debug, Clone, PartialEq)]
pub struct Path {
    path: LeaderPath,
    rate_hz: u32,
}

impl Path {
    /// The leader's path in `scenario`, which has been validated.
    pub fn new(scenario: &Scenario) -> Self {
        Self { path: scenario.leader_path(), rate_hz: scenario.time.rate_hz }
    }

    /// The leader's state at `tick`.
    pub fn at(&self, tick: Tick) -> LeaderState {
        // From the start and not from the tick before: a replacement does not know that one, and rounding would add up.
        let PathMotion { pose, speed_m_s, turn_rate_rad_s } = self.path.at(tick.seconds(self.rate_hz));
        LeaderState {
            tick,
            position_m: pose.position.into(),
            heading_rad: pose.heading_rad,
            speed_m_s,
            turn_rate_rad_s,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ringwing_scenario::PathKind;

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

    #[test]
    fn a_leader_that_turns_publishes_the_rate_at_which_it_turns() {
        let mut scenario = Scenario::default();
        scenario.leader.path.kind = PathKind::Circle;
        let path = Path::new(&scenario);
        let (now, next) = (path.at(Tick(500)), path.at(Tick(501)));
        assert_eq!(now.turn_rate_rad_s, 15.0 / 300.0);
        assert!((next.heading_rad - now.heading_rad - 0.01 * now.turn_rate_rad_s).abs() < 1e-12);
    }
}
