//! Bounds of positions: obstacles, listed starts, and the box that starts are drawn from.

use super::{
    angle,
    violation::{CheckedQuantity, Violation, quantity},
};
use crate::{ObstacleSection, Scenario, StartState, field::CIRCLE_NAME};
use nalgebra::{Point2, distance};
use ringwing_flight::counted;

/// Most obstacles of a scenario. Every UAV is checked against every obstacle in every tick, so many more make the
/// world slow.
const OBSTACLES_MAX: usize = 1000;
/// Most waypoints of one obstacle or intruder. Every tick searches through them, so many more make the world slow.
const WAYPOINTS_MAX: usize = 1000;
/// Longest name of an obstacle, in characters. A longer one does not fit the tables and pictures that show it.
const OBSTACLE_NAME_MAX: usize = 40;

pub(super) fn draw(scenario: &Scenario) -> impl Iterator<Item = Violation> {
    let draw = &scenario.start.draw;
    [
        quantity("start.draw.length_radii", draw.length_radii).above_zero(),
        quantity("start.draw.width_radii", draw.width_radii).above_zero(),
        quantity("start.draw.separation_m", draw.separation_m).not_below_zero(),
        quantity("start.draw.heading_spread_deg", draw.heading_spread_deg).within(0.0..=180.0),
    ]
    .into_iter()
    .flatten()
}

/// The bounds of the field count only if it has circles.
pub(super) fn obstacle_field(scenario: &Scenario) -> impl Iterator<Item = Violation> {
    let field = &scenario.obstacle_field;
    let smallest = quantity("obstacle_field.radius_min_m", field.radius_min_m);
    let braking = quantity("obstacle_field.braking_m", field.braking_m);
    [
        quantity("obstacle_field.length_m", field.length_m).above_zero(),
        quantity("obstacle_field.width_m", field.width_m).above_zero(),
        smallest.above_zero(),
        smallest.at_most(quantity("obstacle_field.radius_max_m", field.radius_max_m)),
        braking.above_zero(),
        // A circle must be sensed before it repels.
        braking.at_most(quantity("sensing.range_m", scenario.sensing.range_m)),
    ]
    .into_iter()
    .flatten()
    .filter(|_| !scenario.obstacle_field.is_empty())
}

pub(super) fn obstacles(scenario: &Scenario) -> Vec<Violation> {
    let field = &scenario.obstacle_field;
    let count = scenario.obstacles.len() + field.circles as usize;
    let range = quantity("sensing.range_m", scenario.sensing.range_m);
    let too_many = (count > OBSTACLES_MAX).then(|| {
        let message = format!("{count} obstacles are more than {OBSTACLES_MAX}: remove some");
        Violation::at("obstacles", &*message).or_at("obstacle_field.circles", message)
    });
    let mut violations: Vec<_> = [range.above_zero(), too_many].into_iter().flatten().collect();
    for (index, obstacle) in scenario.obstacles.iter().enumerate() {
        let key = |name| format!("obstacles.{index}.{name}");
        let (radius_key, braking_key) = (key("radius_m"), key("braking_distance_m"));
        let radius = quantity(&radius_key, obstacle.radius_m);
        violations.extend(obstacle_name(scenario, index, obstacle));
        violations.extend(radius.above_zero());
        violations.extend(radius.below(quantity(&braking_key, obstacle.braking_distance_m)));
        let speed = ("waypoint_speed_m_s", obstacle.waypoint_speed_m_s);
        violations.extend(waypoints(&key("waypoints_m"), &obstacle.waypoints_m, &key(speed.0), speed.1));
        violations.extend(
            // The distance from the edge depends on the radius, so it means nothing if that is wrong.
            sensed_too_late(range, &braking_key, obstacle).map(|late| late.depending_on(&radius_key)),
        );
    }
    violations
}

/// Waypoints need a speed to be reached.
pub(super) fn waypoints(
    key: &str,
    waypoints_m: &[[f64; 2]],
    speed_key: &str,
    speed_m_s: f64,
) -> Vec<Violation> {
    let speed = quantity(speed_key, speed_m_s);
    let count = waypoints_m.len();
    let too_many = (count > WAYPOINTS_MAX)
        .then(|| Violation::at(key, format!("{count} waypoints are more than {WAYPOINTS_MAX}: remove some")));
    // Without waypoints nothing uses the speed, but a negative one is still a mistake.
    let too_slow = if count > 0 {
        speed.above_zero().map(|slow| slow.depending_on(key))
    } else {
        speed.not_below_zero()
    };
    [too_many, too_slow].into_iter().flatten().collect()
}

fn obstacle_name(scenario: &Scenario, index: usize, obstacle: &ObstacleSection) -> Option<Violation> {
    let key = |index| format!("obstacles.{index}.name");
    let name = &obstacle.name;
    let is_plain = name.chars().all(|c| c.is_ascii_graphic() || c == ' ');
    // Bytes count characters here, because all other characters than ASCII are refused.
    if name.trim().is_empty() || name.len() > OBSTACLE_NAME_MAX || !is_plain {
        let message = format!(
            "{name:?} is not a name of 1 to {OBSTACLE_NAME_MAX} ASCII characters: give one, such as \"Obstacle 1\""
        );
        return Some(Violation::at(key(index), message));
    }
    // Tables and metrics tell obstacles apart by their names.
    let drawn = name.strip_prefix(CIRCLE_NAME).and_then(|number| number.parse().ok());
    if drawn.is_some_and(|number: u32| number <= scenario.obstacle_field.circles) {
        let message = format!("{name:?} is also the name of a circle of obstacle_field: give another name");
        return Some(Violation::at(key(index), message).depending_on("obstacle_field.circles"));
    }
    let same = scenario.obstacles[..index].iter().position(|other| other.name == *name)?;
    let message = format!("{name:?} is also the name of obstacles.{same}: give each obstacle its own name");
    Some(Violation::at(key(index), message).depending_on(key(same)))
}

/// An obstacle must be sensed before it repels, or it would repel later than Eq. (13) says.
fn sensed_too_late(
    range: CheckedQuantity<'_>,
    braking_key: &str,
    obstacle: &ObstacleSection,
) -> Option<Violation> {
    let from_edge = quantity(braking_key, obstacle.braking_distance_m - obstacle.radius_m);
    let (name, needed) = (&obstacle.name, from_edge.measure());
    (range.value < from_edge.value).then(|| {
        let short = format!(
            "{} is less than {needed}, the distance from its edge at which {name:?} begins to repel",
            range.measure()
        );
        let far =
            format!("{name:?} begins to repel {needed} from its edge, beyond {}", range.beside(braking_key));
        Violation::at(range.key, format!("{short}: give a larger range"))
            .or_at(braking_key, format!("{far}: give a smaller distance or a larger range"))
    })
}

pub(super) fn starts(scenario: &Scenario) -> Vec<Violation> {
    let mut violations: Vec<_> = number_of_starts(scenario).into_iter().collect();
    // Too many circles have a message of their own, and would take too long to draw.
    let is_drawn = scenario.obstacle_field.circles as usize <= OBSTACLES_MAX;
    let obstacles = if is_drawn { scenario.all_obstacles() } else { scenario.obstacles.clone() };
    for (index, state) in scenario.start.uavs.iter().enumerate() {
        violations.extend(angle(&format!("start.uavs.{index}.heading_deg"), state.heading_deg));
        violations.extend(start_speed(scenario, index, state));
        violations.extend(too_close(scenario, index));
        violations.extend(inside_obstacles(scenario, &obstacles, index));
    }
    violations
}

fn number_of_starts(scenario: &Scenario) -> Option<Violation> {
    let (listed, uavs) = (scenario.start.uavs.len(), scenario.formation.uavs);
    (listed != 0 && listed != uavs as usize).then(|| {
        let remedy = format!("list {uavs} starts, or none to draw them");
        let (starts, are) = (counted(listed, "start"), if listed == 1 { "is" } else { "are" });
        let from_list = format!("{starts} {are} listed, but formation.uavs is {uavs}: {remedy}");
        let from_count = format!("{uavs} UAVs are asked for, but start.uavs lists {starts}: {remedy}");
        Violation::at("start.uavs", from_list).or_at("formation.uavs", from_count)
    })
}

fn start_speed(scenario: &Scenario, index: usize, state: &StartState) -> impl Iterator<Item = Violation> {
    let key = format!("start.uavs.{index}.speed_m_s");
    let speed = quantity(&key, state.speed_m_s);
    [
        quantity("airframe.speed_min_m_s", scenario.airframe.speed_min_m_s).at_most(speed),
        speed.at_most(quantity("airframe.speed_max_m_s", scenario.airframe.speed_max_m_s)),
    ]
    .into_iter()
    .flatten()
}

pub(super) fn position_key(index: usize) -> String {
    format!("start.uavs.{index}.position_m")
}

pub(super) fn position(state: &StartState) -> Point2<f64> {
    Point2::from(state.position_m)
}

/// Reports only the first UAV that this one is too close to: the whole swarm in one spot would fill a page.
fn too_close(scenario: &Scenario, index: usize) -> Option<Violation> {
    let key = position_key(index);
    let states = &scenario.start.uavs;
    let collision = quantity("airframe.collision_distance_m", scenario.airframe.collision_distance_m);
    let gap = |other: &StartState| distance(&position(other), &position(&states[index]));
    // Look at earlier UAVs only, so that each pair is reported once.
    let other = states[..index].iter().position(|other| gap(other) < collision.value)?;
    let close = format!(
        "UAV {} starts {:.2} m from UAV {}, within {}",
        index + 1,
        gap(&states[other]),
        other + 1,
        collision.beside(&key)
    );
    Some(
        Violation::at(key, format!("{close}: move one of them away"))
            .or_at(position_key(other), format!("{close}: move one of them away"))
            .or_at(collision.key, format!("{close}: give a smaller value")),
    )
}

fn inside_obstacles(
    scenario: &Scenario,
    obstacles: &[ObstacleSection],
    index: usize,
) -> impl Iterator<Item = Violation> {
    let start = position(&scenario.start.uavs[index]);
    let is_around = move |obstacle: &ObstacleSection| {
        distance(&start, &Point2::from(obstacle.position_m)) <= obstacle.radius_m
    };
    let listed = scenario.obstacles.len();
    obstacles.iter().enumerate().filter(move |(_, obstacle)| is_around(obstacle)).map(
        move |(number, obstacle)| {
            let message = format!("UAV {} starts inside {:?}: move one of them", index + 1, obstacle.name);
            let obstacle_key = |name| format!("obstacles.{number}.{name}");
            let here = Violation::at(position_key(index), &*message);
            // The circles of the field follow the listed obstacles and have no key of their own.
            if number >= listed {
                return here.or_at("obstacle_field.ahead_m", message).depending_on("obstacle_field");
            }
            here.or_at(obstacle_key("position_m"), &*message)
                .or_at(obstacle_key("radius_m"), &*message)
                .depending_on(obstacle_key("name"))
        },
    )
}
