//! What the 3D panel draws: one scene for each topic, each message the whole of it.
//!
//! A viewer that seeks gets only the last message of each topic, so that every message first deletes what was there. Bodies
//! are locked to the frames of `/tf` and written once; what moves within the formation is locked to the leader.

mod craft;
mod ring;
mod surroundings;
mod trails;

pub(crate) use craft::Looks;
pub(crate) use ring::ring;
pub(crate) use surroundings::{formation, obstacles};
pub(crate) use trails::Trails;

use crate::{clock::Clock, frame::Frame, palette::Rgb};
use foxglove::messages::{
    FrameTransform, FrameTransforms, LinePrimitive, Point3, Pose, Quaternion, SceneEntity,
    SceneEntityDeletion, SceneUpdate, TextPrimitive, Vector3, line_primitive, scene_entity_deletion,
};
use nalgebra::Point2;
use ringwing_flight::LeaderState;

/// The frame that everything is in.
pub(crate) const MAP: &str = "map";
/// The frame that moves with the leader and, as the formation does, never turns.
pub(crate) const LEADER: &str = "leader";

/// The frame of UAV number `uav` in a swarm of `count`.
pub(crate) fn uav_frame(uav: u32, count: u32) -> String {
    format!("uav_{}", padded(uav, count))
}

/// The number of a UAV, so wide that names sort as numbers do.
pub(crate) fn padded(uav: u32, count: u32) -> String {
    let width = if count > 999 { 4 } else { 3 };
    format!("{uav:0width$}")
}

/// Where all frames are: `/tf`.
pub(crate) fn transforms(frame: &Frame, clock: Clock) -> FrameTransforms {
    let count = frame.uavs.len() as u32;
    let timestamp = Some(clock.timestamp(frame.tick));
    let transform = |child_frame_id: String, [x, y]: [f64; 2], heading_rad: f64| FrameTransform {
        timestamp,
        parent_frame_id: MAP.into(),
        child_frame_id,
        translation: Some(Vector3 { x, y, z: 0.0 }),
        rotation: Some(turned(heading_rad)),
    };
    let leader = frame.leader.iter().map(|leader| transform(LEADER.into(), leader.position_m, 0.0));
    let uavs = frame.uavs.iter().filter_map(|uav| uav.state.as_ref());
    let uavs = uavs.map(|uav| transform(uav_frame(uav.uav, count), [uav.x_m, uav.y_m], uav.heading_rad));
    FrameTransforms { transforms: leader.chain(uavs).collect() }
}

/// A rotation about the vertical.
pub(crate) fn turned(heading_rad: f64) -> Quaternion {
    Quaternion { x: 0.0, y: 0.0, z: libm::sin(heading_rad / 2.0), w: libm::cos(heading_rad / 2.0) }
}

/// A scene that takes the place of all before it on its topic.
fn whole(entities: Vec<SceneEntity>, clock: Clock, tick: i64) -> SceneUpdate {
    let deletion = SceneEntityDeletion {
        timestamp: Some(clock.timestamp(tick)),
        r#type: scene_entity_deletion::Type::All.into(),
        id: String::new(),
    };
    SceneUpdate { deletions: vec![deletion], entities }
}

fn entity(frame_id: impl Into<String>, id: impl Into<String>, clock: Clock, tick: i64) -> SceneEntity {
    SceneEntity {
        timestamp: Some(clock.timestamp(tick)),
        frame_id: frame_id.into(),
        id: id.into(),
        frame_locked: true,
        ..SceneEntity::default()
    }
}

/// A line of so many pixels.
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

/// A text that faces the viewer, in letters of so many pixels.
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

fn at(x: f64, y: f64, z: f64) -> Pose {
    Pose { position: Some(Vector3 { x, y, z }), orientation: Some(turned(0.0)) }
}

fn flat(x: f64, y: f64) -> Point3 {
    Point3 { x, y, z: 0.0 }
}

fn seen_from(place: Point2<f64>, leader: &LeaderState) -> Point2<f64> {
    Point2::new(place.x - leader.position_m[0], place.y - leader.position_m[1])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing;

    #[test]
    fn all_frames_come_in_one_message() {
        let scenario = testing::ring_of(3, 40.0);
        let mut frame = testing::at_rest(&scenario, 100);
        frame.uavs[1].state = None;
        let message = transforms(&frame, Clock::new(100));
        let names: Vec<_> =
            message.transforms.iter().map(|one| (&*one.parent_frame_id, &*one.child_frame_id)).collect();
        assert_eq!(names, [("map", "leader"), ("map", "uav_001"), ("map", "uav_003")]);
        assert_eq!(message.transforms[0].translation, Some(Vector3 { x: 15.0, y: 0.0, z: 0.0 }));
        assert_eq!((uav_frame(7, 999), uav_frame(7, 1000)), ("uav_007".into(), "uav_0007".into()));
    }

    #[test]
    fn a_scene_begins_with_nothing() {
        let scene = whole(Vec::new(), Clock::new(100), 0);
        assert_eq!(scene.deletions[0].r#type, i32::from(scene_entity_deletion::Type::All));
    }
}
