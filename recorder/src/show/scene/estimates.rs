//! Draws where agents believe that their UAVs are: `/scene/estimates`.
//!
//! A thin outline in the colour of the UAV, and a line to it from where the UAV is. Never draws the estimate of an agent that knows exactly
//! where its UAV is.

use super::{craft::outline, entity, flat, line, uav_frame, whole};
use crate::{
    clock::Clock,
    metrics::{Frame, TrueState, UavFrame},
    schema::{rounded, topics::padded},
    show::palette,
};
use foxglove::messages::{
    Point3, SceneEntity, SceneUpdate,
    line_primitive::Type::{LineList, LineLoop},
};
use ringwing_flight::{Pose, turned};

/// Width of the outline and of the line. Wider ones hide the body of the UAV.
const PIXELS: f64 = 1.5;

/// The estimates of `frame` as outlines of this span; an empty scene if every agent knows where its UAV is.
pub(crate) fn estimates(frame: &Frame, span_m: f64, clock: Clock) -> SceneUpdate {
    let count = frame.uavs.len() as u32;
    let drawn = |uav: &UavFrame| {
        let (state, estimate) = (uav.commanded()?, uav.control?.estimate?);
        Some(ghost(state, &estimate, span_m, count, clock, frame.tick))
    };
    whole(frame.uavs.iter().filter_map(drawn).collect(), clock, frame.tick)
}

/// The outline, in the coordinate frame of the UAV: so it moves with the UAV until the next message.
fn ghost(
    state: &TrueState,
    estimate: &Pose,
    span_m: f64,
    count: u32,
    clock: Clock,
    tick: i64,
) -> SceneEntity {
    let offset = turned(estimate.position - state.position(), -state.heading_rad);
    let turn_rad = estimate.heading_rad - state.heading_rad;
    let corner = |(ahead, left): (f64, f64)| -> Point3 {
        let place = offset + turned([ahead * span_m, left * span_m].into(), turn_rad);
        flat(rounded(place.x), rounded(place.y))
    };
    let colour = palette::colour(state.uav);
    let mut ghost =
        entity(uav_frame(state.uav, count), format!("estimate {}", padded(state.uav, count)), clock, tick);
    ghost.lines.push(line(LineLoop, outline().map(corner).collect(), PIXELS, colour, 0.9));
    let way = vec![flat(0.0, 0.0), flat(rounded(offset.x), rounded(offset.y))];
    ghost.lines.push(line(LineList, way, PIXELS, colour, 0.9));
    ghost
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing;
    use nalgebra::Vector2;

    #[test]
    fn an_outline_stands_where_the_agent_takes_its_uav_to_be() {
        let mut frame = testing::at_rest(&testing::ring_of(3, 40.0), 10);
        assert!(estimates(&frame, 8.0, Clock::new(100)).entities.is_empty());
        let state = frame.uavs[1].state.as_mut().unwrap();
        state.heading_rad = std::f64::consts::FRAC_PI_2;
        let estimate = Pose { position: state.position() + Vector2::new(0.0, 3.0), ..state.pose() };
        frame.uavs[1].control.as_mut().unwrap().estimate = Some(estimate);
        let scene = estimates(&frame, 8.0, Clock::new(100));
        let [ghost] = &scene.entities[..] else { panic!("one estimate") };
        assert_eq!(ghost.frame_id, "uav_002");
        // The UAV heads north, so 3 m to the north are 3 m ahead; its nose is 0.55 spans ahead of that.
        assert_eq!(ghost.lines[1].points[1], flat(3.0, 0.0));
        assert!((ghost.lines[0].points[0].x - 7.4).abs() < 1e-3 && ghost.lines[0].points[0].y.abs() < 1e-3);
    }
}
