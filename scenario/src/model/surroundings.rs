//! What else is in the sky: obstacles, listed or drawn, which may move, and aircraft that nobody controls.

use nalgebra::{Point2, Vector2};
use ringwing_flight::{Pose, Route, RoutePoint};
use serde::{Deserialize, Serialize};

/// `[[obstacles]]`: a circle that no UAV may enter. It stands, unless the last four keys say how it moves.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ObstacleSection {
    /// Name in tables and pictures.
    pub name: String,
    /// The centre at time 0.
    pub position_m: [f64; 2],
    /// `R_obs`.
    pub radius_m: f64,
    /// `L_obs`: the distance from the centre within which the obstacle repels, Eq. (13).
    pub braking_distance_m: f64,
    /// Its velocity, east and north, from time 0 or from its last waypoint on.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub velocity_m_s: [f64; 2],
    /// Where it moves first, in straight lines.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub waypoints_m: Vec<[f64; 2]>,
    /// How fast it moves to its waypoints.
    #[serde(default, skip_serializing_if = "is_nothing")]
    pub waypoint_speed_m_s: f64,
    /// Whether it goes back to its start after the last waypoint, and round again.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub repeat: bool,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde passes references")]
fn is_nothing(value: &f64) -> bool {
    *value == 0.0
}

fn is_zero(vector: &[f64; 2]) -> bool {
    *vector == [0.0; 2]
}

impl ObstacleSection {
    /// An obstacle that stands.
    pub fn standing(
        name: impl Into<String>,
        position_m: [f64; 2],
        radius_m: f64,
        braking_distance_m: f64,
    ) -> Self {
        Self {
            name: name.into(),
            position_m,
            radius_m,
            braking_distance_m,
            velocity_m_s: [0.0; 2],
            waypoints_m: Vec::new(),
            waypoint_speed_m_s: 0.0,
            repeat: false,
        }
    }

    /// Whether it ever leaves its place.
    pub fn moves(&self) -> bool {
        self.velocity_m_s != [0.0; 2] || !self.waypoints_m.is_empty()
    }

    /// Its way.
    pub fn route(&self) -> Route {
        let velocity = Vector2::from(self.velocity_m_s);
        // A standing obstacle gets the heading 0, which has no effect at a speed of 0.
        let drift = |position| RoutePoint {
            pose: Pose { position, heading_rad: libm::atan2(velocity.y, velocity.x) },
            speed_m_s: velocity.norm(),
            turn_rate_rad_s: 0.0,
        };
        let after_last = |last: Pose| drift(last.position);
        route(self.position_m, &self.waypoints_m, self.waypoint_speed_m_s, self.repeat, after_last)
    }
}

/// `[obstacle_field]`: a draw of obstacles that stand, in a rectangle on the leader's way. They follow the listed ones.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ObstacleFieldSection {
    /// Number of circles. They may overlap.
    pub circles: u32,
    /// Distance of the rectangle's near side from the leader's start.
    pub ahead_m: f64,
    /// Length along the leader's way.
    pub length_m: f64,
    /// Width across it.
    pub width_m: f64,
    /// The smallest radius.
    pub radius_min_m: f64,
    /// The largest radius.
    pub radius_max_m: f64,
    /// Distance from an edge within which a circle repels: `L_obs` less `R_obs`.
    pub braking_m: f64,
}

impl ObstacleFieldSection {
    /// Whether it has no circle.
    pub fn is_empty(&self) -> bool {
        self.circles == 0
    }
}

impl Default for ObstacleFieldSection {
    fn default() -> Self {
        Self {
            circles: 0,
            // Far enough that a swarm from drawn starts has formed its ring.
            ahead_m: 200.0,
            length_m: 1000.0,
            // A ring of six, 40 m apart, is 80 m wide.
            width_m: 160.0,
            radius_min_m: 5.0,
            radius_max_m: 20.0,
            braking_m: 20.0,
        }
    }
}

/// `[[intruders]]`: an aircraft that nobody controls, and that gives way to nobody.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct IntruderSection {
    /// Position at time 0.
    pub position_m: [f64; 2],
    /// Heading at time 0; with waypoints, the first leg decides.
    pub heading_deg: f64,
    /// Speed along the heading.
    pub speed_m_s: f64,
    /// Whether it reports where it is and how it flies, so that every UAV near knows that at once. The radar of a UAV sees
    /// one that does not.
    pub cooperative: bool,
    /// Rate of the heading, from time 0 or from the last waypoint on: it circles.
    #[serde(default, skip_serializing_if = "is_nothing")]
    pub turn_rate_rad_s: f64,
    /// Where it flies first, in straight lines.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub waypoints_m: Vec<[f64; 2]>,
    /// Whether it flies back to its start after the last waypoint, and round again. Else it flies on from there.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub repeat: bool,
}

impl IntruderSection {
    /// Its way.
    pub fn route(&self) -> Route {
        let on = |pose| RoutePoint { pose, speed_m_s: self.speed_m_s, turn_rate_rad_s: self.turn_rate_rad_s };
        if self.waypoints_m.is_empty() {
            let heading_rad = ringwing_flight::wrap(self.heading_deg.to_radians());
            return Route::steady(on(Pose { position: self.position_m.into(), heading_rad }));
        }
        route(self.position_m, &self.waypoints_m, self.speed_m_s, self.repeat, on)
    }
}

/// The way from `start_m` through the waypoints, and round again or on as `after_last` says.
fn route(
    start_m: [f64; 2],
    waypoints_m: &[[f64; 2]],
    speed_m_s: f64,
    repeat: bool,
    after_last: impl FnOnce(Pose) -> RoutePoint,
) -> Route {
    let waypoints: Vec<Point2<f64>> = waypoints_m.iter().copied().map(Point2::from).collect();
    if repeat && !waypoints.is_empty() {
        Route::round(start_m.into(), &waypoints, speed_m_s)
    } else {
        Route::through(start_m.into(), &waypoints, speed_m_s, after_last)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn intruder() -> IntruderSection {
        IntruderSection {
            position_m: [0.0, 0.0],
            heading_deg: 90.0,
            speed_m_s: 10.0,
            cooperative: true,
            turn_rate_rad_s: 0.0,
            waypoints_m: Vec::new(),
            repeat: false,
        }
    }

    fn place(route: &Route, time_s: f64) -> [f64; 2] {
        route.at(time_s).pose.position.map(|at_m| (at_m * 1e6).round() / 1e6).into()
    }

    #[test]
    fn an_obstacle_moves_on_with_its_velocity_after_its_last_waypoint() {
        let mast = ObstacleSection::standing("mast", [0.0, 0.0], 1.0, 2.0);
        assert_eq!((mast.moves(), place(&mast.route(), 9.0)), (false, [0.0, 0.0]));
        let drifting = ObstacleSection { velocity_m_s: [1.0, -2.0], ..mast };
        assert_eq!((drifting.moves(), place(&drifting.route(), 3.0)), (true, [3.0, -6.0]));
        let waypoints_m = vec![[0.0, 10.0]];
        let driven = ObstacleSection { waypoints_m, waypoint_speed_m_s: 5.0, ..drifting };
        assert_eq!([1.0, 3.0].map(|at| place(&driven.route(), at)), [[0.0, 5.0], [1.0, 8.0]]);
        let patrol = ObstacleSection { repeat: true, ..driven };
        assert_eq!(
            [3.0, 4.0, 5.0].map(|at| place(&patrol.route(), at)),
            [[0.0, 5.0], [0.0, 0.0], [0.0, 5.0]]
        );
    }

    #[test]
    fn an_intruder_flies_straight_in_a_circle_or_to_its_waypoints_and_on() {
        assert_eq!(place(&intruder().route(), 2.0), [0.0, 20.0]);
        let circling = IntruderSection { turn_rate_rad_s: 0.5, ..intruder() };
        let (there, round_s) = (circling.route(), 4.0 * std::f64::consts::PI);
        assert_eq!(place(&there, round_s), [0.0, 0.0]);
        assert!((place(&there, round_s / 2.0)[0] + 40.0).abs() < 1e-6, "a radius of 20 m, to the left");
        let guided = IntruderSection { waypoints_m: vec![[10.0, 0.0]], ..intruder() };
        assert_eq!([0.5, 2.0].map(|at| place(&guided.route(), at)), [[5.0, 0.0], [20.0, 0.0]]);
    }
}
