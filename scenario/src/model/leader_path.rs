//! The leader's path as the scenario describes it.
//!
//! Never checks whether the airframes can follow it: `validate` does.

use super::{LeaderSection, PathKind, PathSection, Scenario};
use nalgebra::Point2;
use ringwing_flight::{FormationFrame, LeaderPath, PathMotion, Pose, TrackPoint, WaypointError, wrap};

impl LeaderSection {
    /// The path from time 0 on. A track must have two points or more, and times that grow.
    ///
    /// # Errors
    /// No path leads past the waypoints.
    pub(crate) fn try_path(&self) -> Result<LeaderPath, WaypointError> {
        let PathSection { kind, radius_m, turn, length_m, waypoints, points, .. } = &self.path;
        let (speed_m_s, place) = (self.speed_m_s, Point2::from(self.start_m));
        let start = Pose { position: place, heading_rad: wrap(self.heading_deg.to_radians()) };
        Ok(match kind {
            PathKind::Straight => LeaderPath::straight(start, speed_m_s),
            PathKind::Circle => LeaderPath::circle(start, speed_m_s, *radius_m, *turn),
            PathKind::FigureEight => LeaderPath::figure_eight(start, speed_m_s, *radius_m, *turn),
            PathKind::Racetrack => LeaderPath::racetrack(start, speed_m_s, *radius_m, *length_m, *turn),
            PathKind::Waypoints => {
                let places: Vec<_> = waypoints.iter().map(|one| Point2::from(one.position_m)).collect();
                LeaderPath::waypoints(place, speed_m_s, *radius_m, &places)?
            }
            PathKind::Track => LeaderPath::track(points),
        })
    }
}

impl Scenario {
    /// Where the leader flies.
    ///
    /// # Panics
    /// There is no such path: validation refuses such a scenario.
    pub fn leader_path(&self) -> LeaderPath {
        self.leader.try_path().expect("a validated scenario has a path")
    }

    /// The tightest turn in metres that every UAV in its slot can fly, whichever side it is on; `None` if no turn is wide
    /// enough, because the leader flies at a limit of the airframes' speed.
    ///
    /// `max(v / omega_max, v R / (v_max - v), v R / (v - v_min))`; the last two only if the formation turns with its leader.
    pub fn turn_radius_min_m(&self) -> Option<f64> {
        let (airframe, speed_m_s) = (&self.airframe, self.leader.speed_m_s);
        let of_turn_rate_m = speed_m_s / airframe.turn_rate_max_rad_s;
        if self.formation.frame == FormationFrame::Fixed {
            return Some(of_turn_rate_m);
        }
        let room_m_s = (airframe.speed_max_m_s - speed_m_s).min(speed_m_s - airframe.speed_min_m_s);
        let of_speeds_m = speed_m_s * self.reach_m() / room_m_s;
        (room_m_s > 0.0).then_some(of_turn_rate_m.max(of_speeds_m))
    }

    /// The leader at time 0. Starts and fields of obstacles are drawn around it, and its heading is in degrees because theirs
    /// are. Where no such path exists, it is what the keys say: checks ask before the path itself is checked.
    pub fn leader_start(&self) -> LeaderStart {
        let LeaderSection { start_m, heading_deg, speed_m_s, path } = &self.leader;
        let keyed =
            LeaderStart { position: (*start_m).into(), heading_deg: *heading_deg, speed_m_s: *speed_m_s };
        let follows_path = match path.kind {
            // As the keys say, to the bit: degrees made of radians would differ in their last bits.
            PathKind::Straight | PathKind::Circle | PathKind::FigureEight | PathKind::Racetrack => false,
            PathKind::Waypoints => true,
            PathKind::Track => {
                let grows = |pair: &[TrackPoint]| pair[0].time_s < pair[1].time_s;
                path.points.len() >= 2 && path.points.windows(2).all(grows)
            }
        };
        let Some(path) = follows_path.then(|| self.leader.try_path().ok()).flatten() else { return keyed };
        let PathMotion { pose, speed_m_s, .. } = path.at(0.0);
        LeaderStart { position: pose.position, heading_deg: pose.heading_rad.to_degrees(), speed_m_s }
    }

    /// The place of slot `number` of the whole ring at time 0.
    pub fn start_slot(&self, number: u32) -> Point2<f64> {
        let LeaderStart { position, heading_deg, .. } = self.leader_start();
        let offset = self.formation().slot(number, Point2::origin()).coords;
        position + self.formation.frame.placed(offset, heading_deg.to_radians())
    }
}

/// The leader at time 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LeaderStart {
    /// Where it is.
    pub position: Point2<f64>,
    /// Where it heads.
    pub heading_deg: f64,
    /// How fast it flies.
    pub speed_m_s: f64,
}
