//! What the 3D panel draws: one scene for each `/scene/...` topic.
//!
//! Never sends an incremental update: a viewer that seeks gets only the last message of each topic, so every message
//! deletes what was there and holds the complete scene. Bodies are locked to the coordinate frames of `/tf` and
//! written only when they change; the formation and the links are locked to the leader's frame.

mod craft;
mod estimates;
mod movers;
mod ring;
mod surroundings;
mod trails;
mod wind;

pub(crate) use craft::{CraftScene, SPAN};
pub(crate) use estimates::estimates;
pub(crate) use movers::{Mover, movers, obstacle_frame};
pub(crate) use ring::ring;
pub(crate) use surroundings::{formation, leader_path, obstacles};
pub(crate) use trails::Trails;
pub(crate) use wind::wind;

use super::palette::Rgb;
use crate::{clock::Clock, metrics::Frame, schema::topics::padded};
use foxglove::messages::{
    FrameTransform, FrameTransforms, LinePrimitive, Point3, Pose, Quaternion, SceneEntity,
    SceneEntityDeletion, SceneUpdate, TextPrimitive, Vector3, line_primitive, scene_entity_deletion,
};
use nalgebra::Point2;
use ringwing_flight::{LeaderState, turned as turned_by};

/// The fixed coordinate frame of the scenario.
pub(crate) const MAP: &str = "map";
/// The coordinate frame that moves with the leader, and turns with it if the formation does.
pub(crate) const LEADER: &str = "leader";

/// The coordinate frame of UAV number `uav` in a swarm of `count`.
pub(crate) fn uav_frame(uav: u32, count: u32) -> String {
    format!("uav_{}", padded(uav, count))
}

/// The position and rotation of all coordinate frames: `/tf`.
pub(crate) fn transforms(frame: &Frame, movers: &[Mover], clock: Clock) -> FrameTransforms {
    let count = frame.uavs.len() as u32;
    let timestamp = Some(clock.timestamp(frame.tick));
    let transform = |child_frame_id: String, [x, y]: [f64; 2], heading_rad: f64| FrameTransform {
        timestamp,
        parent_frame_id: MAP.into(),
        child_frame_id,
        translation: Some(Vector3 { x, y, z: 0.0 }),
        rotation: Some(turned(heading_rad)),
    };
    // All frames in one message: after a seek, a viewer has only the last message of a topic.
    let turned_rad = |leader| frame.ring.frame_rad(leader);
    let leader =
        frame.leader.iter().map(|leader| transform(LEADER.into(), leader.position_m, turned_rad(leader)));
    let uavs = frame.uavs.iter().filter_map(|uav| uav.state.as_ref());
    let uavs = uavs.map(|uav| transform(uav_frame(uav.uav, count), [uav.x_m, uav.y_m], uav.heading_rad));
    let movers = movers.iter().map(|mover| mover.transform(frame.tick, clock));
    FrameTransforms { transforms: leader.chain(uavs).chain(movers).collect() }
}

/// A rotation about the vertical axis.
pub(crate) fn turned(heading_rad: f64) -> Quaternion {
    Quaternion { x: 0.0, y: 0.0, z: libm::sin(heading_rad / 2.0), w: libm::cos(heading_rad / 2.0) }
}

/// A scene that replaces everything shown on its topic before.
fn whole(entities: Vec<SceneEntity>, clock: Clock, tick: i64) -> SceneUpdate {
    let deletion = SceneEntityDeletion {
        timestamp: Some(clock.timestamp(tick)),
        r#type: scene_entity_deletion::Type::All.into(),
        id: String::new(),
    };
    SceneUpdate { deletions: vec![deletion], entities }
}

/// An empty entity that follows the coordinate frame `frame_id`.
fn entity(frame_id: impl Into<String>, id: impl Into<String>, clock: Clock, tick: i64) -> SceneEntity {
    SceneEntity {
        timestamp: Some(clock.timestamp(tick)),
        frame_id: frame_id.into(),
        id: id.into(),
        // The viewer moves the entity with its frame until the next message, instead of leaving it where it was
        // drawn.
        frame_locked: true,
        ..SceneEntity::default()
    }
}

/// A line `pixels` wide at any distance.
fn line(
    kind: line_primitive::Type,
    points: Vec<Point3>,
    pixels: f64,
    colour: Rgb,
    opacity: f64,
) -> LinePrimitive {
    LinePrimitive {
        r#type: kind.into(),
        pose: Some(at(0.0, 0.0, 0.0)),
        thickness: pixels,
        scale_invariant: true,
        points,
        color: Some(colour.in_scene(opacity)),
        ..LinePrimitive::default()
    }
}

/// A text that faces the viewer, its letters `pixels` high at any distance.
fn text(text: impl Into<String>, place: Point3, pixels: f64, colour: Rgb) -> TextPrimitive {
    TextPrimitive {
        pose: Some(at(place.x, place.y, place.z)),
        billboard: true,
        font_size: pixels,
        scale_invariant: true,
        color: Some(colour.in_scene(1.0)),
        text: text.into(),
    }
}

/// A pose without rotation.
fn at(x: f64, y: f64, z: f64) -> Pose {
    Pose { position: Some(Vector3 { x, y, z }), orientation: Some(turned(0.0)) }
}

/// A point on the ground.
fn flat(x: f64, y: f64) -> Point3 {
    Point3 { x, y, z: 0.0 }
}

/// `place` in the leader's coordinate frame, which is turned by `frame_rad`.
fn relative_to(place: Point2<f64>, leader: &LeaderState, frame_rad: f64) -> Point2<f64> {
    turned_by(place - Point2::from(leader.position_m), -frame_rad).into()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing;
    use ringwing_scenario::ObstacleSection;

    #[test]
    fn one_message_holds_all_coordinate_frames() {
        let mut scenario = testing::ring_of(3, 40.0);
        let drifting = ObstacleSection { velocity_m_s: [0.0, 2.0], ..testing::obstacle([5.0, 6.0]) };
        scenario.obstacles = vec![testing::obstacle([9.0, 9.0]), drifting];
        scenario.intruders = vec![testing::intruder([7.0, 0.0])];
        let mut frame = testing::at_rest(&scenario, 100);
        frame.uavs[1].state = None;
        let message = transforms(&frame, &movers(&scenario), Clock::new(100));
        let names: Vec<_> =
            message.transforms.iter().map(|one| (&*one.parent_frame_id, &*one.child_frame_id)).collect();
        assert_eq!(
            names,
            ["leader", "uav_001", "uav_003", "obstacle_2", "intruder_1"].map(|frame| ("map", frame))
        );
        assert_eq!(message.transforms[3].translation, Some(Vector3 { x: 5.0, y: 8.0, z: 0.0 }));
        let north = turned(std::f64::consts::FRAC_PI_2);
        assert_eq!(message.transforms[4].rotation, Some(north));
        assert_eq!(message.transforms[0].translation, Some(Vector3 { x: 15.0, y: 0.0, z: 0.0 }));
        assert_eq!((uav_frame(7, 999), uav_frame(7, 1000)), ("uav_007".into(), "uav_0007".into()));
    }

    #[test]
    fn every_scene_first_deletes_everything() {
        let scene = whole(Vec::new(), Clock::new(100), 0);
        assert_eq!(scene.deletions[0].r#type, i32::from(scene_entity_deletion::Type::All));
    }
}
