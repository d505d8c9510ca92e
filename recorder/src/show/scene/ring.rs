//! Draws the links between ring neighbours: `/scene/ring`.
//!
//! Each half of a link has the colour of the age of the data that its UAV used of the other one.

use super::{LEADER, entity, flat, line, relative_to, whole};
use crate::{
    clock::Clock,
    metrics::{Frame, TrueState, UavFrame},
    schema::rounded,
    show::palette::{self, Rgb},
};
use foxglove::messages::{Color, LinePrimitive, Point3, SceneUpdate, line_primitive::Type::LineList};
use nalgebra::Point2;

/// Width of a link. Thinner lines hardly show their colour; thicker ones cover the trails.
const PIXELS: f64 = 3.0;

/// The links of `frame`; `None` without a leader, whose coordinate frame they follow.
///
/// If the ring `closes` after a loss, links join the UAVs that fly on command and skip the others. Data as old as
/// `stale_s` or older have the colour of alarm.
pub(crate) fn ring(frame: &Frame, closes: bool, stale_s: f64, clock: Clock) -> Option<SceneUpdate> {
    let leader = frame.leader?;
    let frame_rad = frame.ring.frame_rad(&leader);
    let mut links = line(LineList, Vec::new(), PIXELS, palette::CALM, 1.0);
    let is_in = |uav: &&UavFrame| !closes || uav.state.as_ref().is_some_and(TrueState::is_commanded);
    let members: Vec<&UavFrame> = frame.round_the_ring().filter(is_in).collect();
    for (one, next) in members.iter().zip(members.iter().cycle().skip(1)) {
        // No link ends where there is no airframe.
        let (Some(here), Some(there)) = (&one.state, &next.state) else { continue };
        let relative = |state: &TrueState| relative_to(state.position(), &leader, frame_rad);
        let (from, to) = (relative(here), relative(there));
        let middle = nalgebra::center(&from, &to);
        let next_age_s = one.control.as_ref().and_then(|control| control.next_age_s);
        let previous_age_s = next.control.as_ref().and_then(|control| control.previous_age_s);
        // An airframe in its failsafe uses no data, whatever its agent still receives.
        add(&mut links, from, middle, next_age_s.filter(|_| here.is_commanded()), stale_s);
        add(&mut links, middle, to, previous_age_s.filter(|_| there.is_commanded()), stale_s);
    }
    let mut ring = entity(LEADER, "links", clock, frame.tick);
    ring.lines.push(links);
    Some(whole(vec![ring], clock, frame.tick))
}

/// Adds half a link; without an age its UAV used no data of the other one, and the half stays empty.
fn add(links: &mut LinePrimitive, from: Point2<f64>, to: Point2<f64>, age_s: Option<f64>, stale_s: f64) {
    let Some(age_s) = age_s else { return };
    let colour: Color = age_colour(age_s / stale_s).in_scene(1.0);
    links.points.extend([point(from), point(to)]);
    links.colors.extend([colour, colour]);
}

/// The colour for an age that is `share` of the stale age: from calm through white to alarm. Lightness changes along with
/// hue, so colour-blind people see the difference too.
fn age_colour(share: f64) -> Rgb {
    if share < 0.5 {
        palette::CALM.mixed_with(palette::BRIGHT, 2.0 * share)
    } else {
        palette::BRIGHT.mixed_with(palette::ALARM, 2.0 * share - 1.0)
    }
}

fn point(place: Point2<f64>) -> Point3 {
    flat(rounded(place.x), rounded(place.y))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing;

    #[test]
    fn each_half_of_a_link_shows_the_age_at_one_end() {
        let scenario = testing::ring_of(3, 40.0);
        let mut frame = testing::at_rest(&scenario, 10);
        frame.uavs[0].control.as_mut().unwrap().next_age_s = Some(0.5);
        frame.uavs[1].control.as_mut().unwrap().next_age_s = None;
        let scene = ring(&frame, false, 0.5, Clock::new(100)).unwrap();
        let links = &scene.entities[0].lines[0];
        assert_eq!((links.points.len(), links.colors.len()), (10, 10));
        assert_eq!(links.colors[0], palette::ALARM.in_scene(1.0));
        assert_eq!(scene.entities[0].frame_id, "leader");
    }

    #[test]
    fn a_link_needs_both_neighbours_and_the_leader() {
        let scenario = testing::ring_of(4, 40.0);
        let mut frame = testing::at_rest(&scenario, 10);
        frame.uavs[0].state = None;
        let scene = ring(&frame, false, 0.5, Clock::new(100)).unwrap();
        assert_eq!(scene.entities[0].lines[0].points.len(), 8);
        let closed = ring(&frame, true, 0.5, Clock::new(100)).unwrap();
        assert_eq!(
            closed.entities[0].lines[0].points.len(),
            12,
            "the three that are left are linked all round"
        );
        frame.leader = None;
        assert_eq!(ring(&frame, false, 0.5, Clock::new(100)), None);
    }
}
