//! Draws what rarely changes: obstacles and intruders, the leader's path, and the formation that moves with the leader.
//!
//! Never knows where UAVs are. Obstacles, intruders and the path are drawn once, the formation again when the ring of living
//! UAVs changes. An intruder, or an obstacle that moves, has a coordinate frame of its own, which `/tf` moves.

use super::{
    LEADER, MAP, at, entity, flat, line,
    movers::{intruder_frame, obstacle_frame},
    text, whole,
};
use crate::{
    clock::Clock,
    metrics::FlownRing,
    show::{circle, palette},
};
use foxglove::messages::{
    CylinderPrimitive, LinePrimitive, Point3, SceneEntity, SceneUpdate, TriangleListPrimitive, Vector3,
    line_primitive::Type::{LineLoop, LineStrip},
};
use nalgebra::Point2;
use ringwing_flight::LeaderPath;
use ringwing_scenario::{ObstacleSection, Scenario};

/// Height of names. Smaller than the names of UAVs, so that these stand out.
const NAME_PIXELS: f64 = 14.0;
/// Length of an intruder as a share of the distance between neighbours: about that of a UAV.
const INTRUDER: f64 = 0.22;
/// Corners of an intruder of length 1 as (ahead, left): nose, left, tail, right.
const DART: [(f64, f64); 4] = [(0.5, 0.0), (-0.5, 0.4), (-0.25, 0.0), (-0.5, -0.4)];
/// Half the width of a slot's mark as a share of the distance between neighbours. Larger marks hide the aircraft in
/// them.
const SLOT: f64 = 0.06;

/// Most places of the line of the leader's path. Fewer show corners in tight turns of long flights; more make the message
/// larger.
const PATH_PLACES: u32 = 1000;

/// The obstacles, each with its name and the circle within which it repels, and the intruders: `/scene/obstacles`.
pub(crate) fn obstacles(scenario: &Scenario, clock: Clock, tick: i64) -> SceneUpdate {
    let obstacles = scenario.all_obstacles();
    // The listed obstacles come first, so their numbers are those of their coordinate frames, which `movers` counts.
    let obstacles = (1..).zip(&obstacles);
    let obstacles = obstacles.map(|(number, obstacle)| body(number, obstacle, clock, tick));
    let size_m = INTRUDER * scenario.formation.spacing_m;
    let intruders = (1..=scenario.intruders.len()).map(|number| craft(number, size_m, clock, tick));
    whole(obstacles.chain(intruders).collect(), clock, tick)
}

/// The leader's path over the flight as a line: `/scene/path`.
pub(crate) fn leader_path(path: &LeaderPath, duration_s: f64, clock: Clock, tick: i64) -> SceneUpdate {
    let places = path.places(duration_s, PATH_PLACES).map(|place| flat(place.x, place.y));
    let mut entity = entity(MAP, "path", clock, tick);
    entity.lines.push(line(LineStrip, places.collect(), 1.0, palette::QUIET, 0.8));
    whole(vec![entity], clock, tick)
}

/// An intruder: a filled dart, so that nobody takes it for a UAV of the swarm.
fn craft(number: usize, size_m: f64, clock: Clock, tick: i64) -> SceneEntity {
    let name = format!("intruder {number}");
    let mut craft = entity(intruder_frame(number), &name, clock, tick);
    let corner = |(ahead, left): (f64, f64)| flat(ahead * size_m, left * size_m);
    let [nose, left, tail, right] = DART.map(corner);
    craft.triangles.push(TriangleListPrimitive {
        pose: Some(at(0.0, 0.0, 0.0)),
        // Split from nose to tail: the dart is not convex, and split across it would fill the notch at its tail.
        points: vec![nose, left, tail, nose, tail, right],
        color: Some(palette::ALARM.in_scene(1.0)),
        ..TriangleListPrimitive::default()
    });
    let above = Point3 { x: 0.0, y: 0.0, z: 0.9 * size_m };
    craft.texts.push(text(name, above, NAME_PIXELS, palette::BRIGHT));
    craft
}

fn body(number: usize, obstacle: &ObstacleSection, clock: Clock, tick: i64) -> SceneEntity {
    // The frame of one that moves is where it is, so its body stands at the origin there.
    let (frame, [x, y]) = if obstacle.moves() {
        (obstacle_frame(number), [0.0; 2])
    } else {
        (MAP.to_owned(), obstacle.position_m)
    };
    let (height, width) = (obstacle.radius_m, 2.0 * obstacle.radius_m);
    let mut body = entity(frame, &obstacle.name, clock, tick);
    body.cylinders.push(CylinderPrimitive {
        pose: Some(at(x, y, height / 2.0)),
        size: Some(Vector3 { x: width, y: width, z: height }),
        bottom_scale: 1.0,
        top_scale: 1.0,
        color: Some(palette::ALARM.in_scene(0.7)),
    });
    let circle = |radius| circle(Point2::new(x, y), radius);
    body.lines.push(line(LineLoop, circle(obstacle.braking_distance_m), 1.5, palette::ALARM, 0.9));
    body.lines.push(line(LineLoop, circle(obstacle.radius_m), 2.0, palette::ALARM, 1.0));
    let above = Point3 { x, y, z: 1.4 * height };
    body.texts.push(text(&obstacle.name, above, NAME_PIXELS, palette::BRIGHT));
    body
}

/// The leader, and the formation that is flown with its slots around it: `/scene/formation`.
///
/// Marks have their size from `spacing_m`, the distance between neighbours in the whole ring.
pub(crate) fn formation(flown: &FlownRing, spacing_m: f64, clock: Clock, tick: i64) -> SceneUpdate {
    let mark_m = SLOT * spacing_m;
    let mut ring = entity(LEADER, "ring", clock, tick);
    ring.lines.push(outline(flown));
    for (number, offset) in flown.slots() {
        let mark = diamond(Point2::from(offset), mark_m);
        ring.lines.push(line(LineLoop, mark, 2.0, palette::colour(number), 0.9));
    }
    let mut leader = entity(LEADER, "leader", clock, tick);
    leader.lines.push(line(LineLoop, diamond(Point2::origin(), mark_m), 2.0, palette::BRIGHT, 1.0));
    let above = Point3 { x: 0.0, y: 0.0, z: 3.0 * mark_m };
    leader.texts.push(text("leader", above, NAME_PIXELS, palette::BRIGHT));
    whole(vec![ring, leader], clock, tick)
}

/// The circle of a ring, or the line through the slots of another shape.
fn outline(flown: &FlownRing) -> LinePrimitive {
    if let Some(radius_m) = flown.radius_m() {
        return line(LineLoop, circle(Point2::origin(), radius_m), 1.0, palette::QUIET, 0.8);
    }
    let (slots, is_closed) = flown.outline();
    let points = slots.iter().map(|slot| flat(slot.x, slot.y)).collect();
    line(if is_closed { LineLoop } else { LineStrip }, points, 1.0, palette::QUIET, 0.8)
}

fn circle(centre: Point2<f64>, radius_m: f64) -> Vec<Point3> {
    circle::polygon(centre, radius_m, circle::CORNERS).map(|corner| flat(corner.x, corner.y)).collect()
}

fn diamond(centre: Point2<f64>, half: f64) -> Vec<Point3> {
    let corners = [(half, 0.0), (0.0, half), (-half, 0.0), (0.0, -half)];
    corners.map(|(x, y)| flat(centre.x + x, centre.y + y)).into()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing;
    use ringwing_scenario::ShapeName;

    #[test]
    fn an_obstacle_shows_its_body_its_braking_circle_and_its_name() {
        let scenario =
            Scenario { obstacles: vec![testing::obstacle([5.0, 6.0])], ..testing::ring_of(3, 40.0) };
        let scene = obstacles(&scenario, Clock::new(100), 0);
        let [tower] = &scene.entities[..] else { panic!("one obstacle") };
        assert_eq!((&*tower.frame_id, &*tower.id, &*tower.texts[0].text), ("map", "tower", "tower"));
        let reach = tower.lines[0].points[0].x - 5.0;
        assert_eq!((reach, tower.cylinders[0].size.unwrap().x), (30.0, 20.0));
    }

    #[test]
    fn what_moves_is_drawn_in_its_own_coordinate_frame() {
        let drifting = ObstacleSection { velocity_m_s: [1.0, 0.0], ..testing::obstacle([5.0, 6.0]) };
        let mut scenario = testing::ring_of(3, 40.0);
        scenario.obstacles = vec![testing::obstacle([5.0, 6.0]), drifting];
        scenario.intruders = vec![testing::intruder([0.0, 0.0])];
        let scene = obstacles(&scenario, Clock::new(100), 0);
        let frames: Vec<_> = scene.entities.iter().map(|one| (&*one.frame_id, &*one.texts[0].text)).collect();
        assert_eq!(frames, [("map", "tower"), ("obstacle_2", "tower"), ("intruder_1", "intruder 1")]);
        assert_eq!(scene.entities[1].lines[0].points[0].x, 30.0, "round the origin of its frame");
    }

    #[test]
    fn the_path_is_drawn_from_the_start_to_the_end_of_the_flight() {
        let mut scenario = testing::ring_of(3, 40.0);
        scenario.leader.path.kind = ringwing_scenario::PathKind::Circle;
        let scene = leader_path(&scenario.leader_path(), 50.0, Clock::new(100), 0);
        let points = &scene.entities[0].lines[0].points;
        let end = scenario.leader_path().at(50.0).pose.position;
        assert_eq!((points[0].x, points[0].y), (0.0, 0.0));
        assert_eq!(points.last().map(|last| (last.x, last.y)), Some((end.x, end.y)));
        assert!(points.iter().all(|point| ((point.x).hypot(point.y - 300.0) - 300.0).abs() < 1e-9));
    }

    #[test]
    fn the_formation_is_drawn_around_the_leader() {
        let scenario = testing::ring_of(5, 40.0);
        let ring = scenario.formation();
        let scene = formation(&FlownRing::new(&scenario), 40.0, Clock::new(100), 0);
        assert!(scene.entities.iter().all(|one| one.frame_id == "leader" && one.frame_locked));
        assert_eq!(scene.entities[0].lines.len(), 6);
        let radius = scene.entities[0].lines[0].points[0].x;
        assert!((radius - ring.radius_m()).abs() < 1e-12);
    }

    #[test]
    fn another_shape_is_drawn_as_the_line_through_its_slots() {
        let mut scenario = testing::ring_of(6, 40.0);
        for (shape, kind) in [(ShapeName::Vee, LineStrip), (ShapeName::Star, LineLoop)] {
            scenario.formation.shape = shape;
            let scene = formation(&FlownRing::new(&scenario), 40.0, Clock::new(100), 0);
            let outline = &scene.entities[0].lines[0];
            assert_eq!((outline.r#type, outline.points.len()), (kind as i32, 6), "{shape:?}");
            let slot = scenario.formation().slot(3, Point2::origin());
            assert_eq!((outline.points[2].x, outline.points[2].y), (slot.x, slot.y));
        }
    }

    #[test]
    fn after_a_loss_the_ring_is_drawn_as_the_survivors_fly_it() {
        let mut scenario = testing::ring_of(6, 40.0);
        scenario.control.ring_closes = true;
        let mut flown = FlownRing::new(&scenario);
        flown.follow(0, |number| number != 2);
        let scene = formation(&flown, 40.0, Clock::new(100), 0);
        let [circle, slots @ ..] = &scene.entities[0].lines[..] else { panic!("a circle and slots") };
        // Five UAVs 40 m apart lie on a circle of 20 m / sin(36 deg).
        assert!((circle.points[0].x - 20.0 / libm::sin(36.0_f64.to_radians())).abs() < 1e-9);
        let colours: Vec<_> = slots.iter().map(|slot| slot.color).collect();
        assert_eq!(colours, [1, 3, 4, 5, 6].map(|uav| Some(palette::colour(uav).in_scene(0.9))));
    }
}
