//! Draws the wind as an arrow beside the formation: `/scene/wind`.
//!
//! One arrow stands for the whole swarm: the mean of the air at its UAVs. Never draws still air.

use super::{LEADER, entity, flat, line, relative_to, text, whole};
use crate::{
    clock::Clock,
    metrics::Frame,
    show::{arrow, palette},
};
use foxglove::messages::{Point3, SceneUpdate, line_primitive::Type::LineStrip};

/// Width of the arrow.
const PIXELS: f64 = 4.0;
/// Height of the text. Smaller than the names of UAVs, so that these stand out.
const TEXT_PIXELS: f64 = 14.0;

/// The arrow of `frame` for a formation of this spacing and reach; `None` in still air, and without a leader, whose coordinate frame it
/// follows.
pub(crate) fn wind(frame: &Frame, spacing_m: f64, reach_m: f64, clock: Clock) -> Option<SceneUpdate> {
    let (leader, wind_m_s) = (frame.leader?, frame.wind_m_s()?);
    let frame_rad = frame.ring.frame_rad(&leader);
    let places = arrow::of_wind(wind_m_s, leader.position_m.into(), spacing_m, reach_m);
    let seen = places.map(|place| relative_to(place, &leader, frame_rad));
    let mut drawn = entity(LEADER, "wind", clock, frame.tick);
    let strokes = seen.map(|place| flat(place.x, place.y));
    drawn.lines.push(line(LineStrip, strokes.into(), PIXELS, palette::CALM, 1.0));
    let above = Point3 { z: spacing_m / 4.0, ..flat(seen[0].x, seen[0].y) };
    let label = format!("wind {:.1} m/s", wind_m_s.norm());
    drawn.texts.push(text(label, above, TEXT_PIXELS, palette::BRIGHT));
    Some(whole(vec![drawn], clock, frame.tick))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing;

    #[test]
    fn the_arrow_is_that_of_the_mean_of_the_air_and_stands_beside_the_leader() {
        let mut frame = testing::at_rest(&testing::ring_of(3, 40.0), 10);
        assert_eq!(wind(&frame, 40.0, 23.0, Clock::new(100)), None, "the air is still");
        for (uav, speed_m_s) in frame.uavs.iter_mut().zip([4.0, 6.0, 8.0]) {
            uav.state.as_mut().unwrap().wind_m_s = Some([0.0, -speed_m_s]);
        }
        let scene = wind(&frame, 40.0, 23.0, Clock::new(100)).unwrap();
        assert_eq!(scene.entities[0].frame_id, "leader");
        let [tail, tip, ..] = &scene.entities[0].lines[0].points[..] else { panic!("an arrow") };
        assert!((tip.x - tail.x).abs() < 1e-9 && tip.y < tail.y && tail.x < 0.0 && tail.y > 0.0);
        assert_eq!(scene.entities[0].texts[0].text, "wind 6.0 m/s");
        frame.leader = None;
        assert_eq!(wind(&frame, 40.0, 23.0, Clock::new(100)), None);
    }
}
