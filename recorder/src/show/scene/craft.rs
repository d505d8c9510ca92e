//! Draws the UAVs as small aircraft that show heading, number and condition: `/scene/uavs`.
//!
//! Never repeats an unchanged scene: bodies follow their coordinate frames, so a message is due only when a UAV begins
//! to look different. In a large swarm only UAVs with news have a name, because forty names hide forty aircraft.

use super::{MAP, at, entity, flat, line, text, uav_frame, whole};
use crate::{
    clock::Clock,
    metrics::Frame,
    schema::topics::padded,
    show::{
        faults::{Condition, CurrentFaults},
        palette::{self, Rgb},
    },
};
use foxglove::messages::{
    Point3, SceneEntity, SceneUpdate, TriangleListPrimitive,
    line_primitive::Type::{LineList, LineLoop},
};
use nalgebra::Point2;
use ringwing_flight::FlightMode;

/// Wing span as a share of the distance between neighbours. Smaller aircraft are hard to see when the whole ring is in
/// view; larger ones hide their neighbours.
pub(crate) const SPAN: f64 = 0.2;
/// Height of names. Larger names of neighbours overlap when the whole ring is in view.
const NAME_PIXELS: f64 = 15.0;

/// Largest swarm in which every UAV always has its name. In larger ones names cover the aircraft beside them.
const NAMED_UAVS: u32 = 12;
/// Simulated time for which a UAV of a larger swarm is named after its condition changed. Longer, and the names of many losses
/// pile up; shorter, and a viewer at a higher playback speed misses them.
const NEWS_S: f64 = 8.0;

/// Corners of an aircraft of span 1 as (ahead, left), from nose to tail along its left side. The right side mirrors it.
const OUTLINE: [(f64, f64); 9] = [
    (0.55, 0.0),
    (0.30, 0.07),
    (0.16, 0.07),
    (-0.08, 0.5),
    (-0.20, 0.5),
    (-0.10, 0.07),
    (-0.36, 0.05),
    (-0.48, 0.2),
    (-0.55, 0.0),
];
/// The triangles between these corners: fuselage, wing, tail.
const TRIANGLES: [[usize; 3]; 7] =
    [[0, 1, 8], [1, 2, 8], [2, 5, 8], [2, 3, 4], [2, 4, 5], [5, 6, 8], [6, 7, 8]];

/// How one UAV looks.
#[derive(Debug, Clone, PartialEq)]
enum CraftLook {
    /// In the sky, controlled by its agent or a failsafe.
    Flying { condition: Condition, mode: FlightMode },
    /// No longer in the sky; marked at its last position.
    Gone(Point2<f64>),
}

/// How one UAV is drawn.
#[derive(Debug, Clone, PartialEq)]
struct DrawnCraft {
    look: CraftLook,
    /// Whether its name stands beside it.
    named: bool,
}

/// Remembers how the UAVs looked in the last scene, to tell when the next one is due.
#[derive(Debug, Clone)]
pub(crate) struct CraftScene {
    span_m: f64,
    /// Last known position of each UAV, UAV 1 first.
    places: Vec<Option<Point2<f64>>>,
    /// The tick at which each UAV last changed its look.
    news: Vec<Option<i64>>,
    /// How each UAV is drawn in the last scene; `None` before it was seen.
    written: Vec<Option<DrawnCraft>>,
}

impl CraftScene {
    /// For a ring of `uavs`, `spacing_m` apart, none of them seen yet.
    pub(crate) fn new(uavs: u32, spacing_m: f64) -> Self {
        let uavs = uavs as usize;
        let (places, news, written) = (vec![None; uavs], vec![None; uavs], vec![None; uavs]);
        Self { span_m: SPAN * spacing_m, places, news, written }
    }

    /// Notes the position of every UAV in the sky.
    pub(crate) fn observe(&mut self, frame: &Frame) {
        for (place, uav) in self.places.iter_mut().zip(&frame.uavs) {
            *place = uav.state.as_ref().map(|state| Point2::new(state.x_m, state.y_m)).or(*place);
        }
    }

    /// The scene, if any UAV looks different than in the last one.
    pub(crate) fn scene(
        &mut self,
        frame: &Frame,
        faults: &CurrentFaults,
        clock: Clock,
    ) -> Option<SceneUpdate> {
        let drawn: Vec<_> =
            (1..).zip(&self.places).map(|(uav, place)| look(frame, uav, *place, faults)).collect();
        let drawn = self.named(drawn, clock, frame.tick);
        if drawn == self.written {
            return None;
        }
        self.written = drawn;
        let count = self.written.len() as u32;
        let drawn = (1..).zip(&self.written).filter_map(|(uav, drawn)| Some((uav, drawn.as_ref()?)));
        let entities = drawn.map(|(uav, drawn)| self.drawn(uav, count, drawn, clock, frame.tick)).collect();
        Some(whole(entities, clock, frame.tick))
    }

    /// Decides which of the UAVs with these `looks` have names at `tick`.
    fn named(&mut self, looks: Vec<Option<CraftLook>>, clock: Clock, tick: i64) -> Vec<Option<DrawnCraft>> {
        let all = looks.len() as u32 <= NAMED_UAVS;
        let oldest = tick - (NEWS_S * f64::from(clock.rate_hz())) as i64;
        let mut drawn = Vec::with_capacity(looks.len());
        for ((look, before), news) in looks.into_iter().zip(&self.written).zip(&mut self.news) {
            // To be seen for the first time is no news.
            if let (Some(look), Some(before)) = (&look, before)
                && *look != before.look
            {
                *news = Some(tick);
            }
            let named = all || news.is_some_and(|changed| changed > oldest);
            drawn.push(look.map(|look| DrawnCraft { look, named }));
        }
        drawn
    }

    fn drawn(&self, uav: u32, count: u32, drawn: &DrawnCraft, clock: Clock, tick: i64) -> SceneEntity {
        let id = format!("uav {}", padded(uav, count));
        let colour = palette::colour(uav);
        let (mut body, name, above) = match &drawn.look {
            CraftLook::Gone(place) => {
                // On the map, because `/tf` may no longer have the coordinate frame of this UAV.
                let mut mark = entity(MAP, id, clock, tick);
                mark.lines.push(line(LineList, self.cross(*place), 3.0, colour, 1.0));
                (mark, format!("{uav} vanished"), Point3 { x: place.x, y: place.y, z: self.span_m })
            }
            CraftLook::Flying { condition, mode } => {
                let mut body = entity(uav_frame(uav, count), id, clock, tick);
                self.add_body(&mut body, *condition, colour);
                (body, name(uav, *condition, *mode), Point3 { x: 0.0, y: 0.0, z: 0.9 * self.span_m })
            }
        };
        if drawn.named {
            body.texts.push(text(name, above, NAME_PIXELS, palette::BRIGHT));
        }
        body
    }

    /// Adds the body: filled while all is well, hollow without an agent, crossed out after a collision.
    fn add_body(&self, body: &mut SceneEntity, condition: Condition, colour: Rgb) {
        let outline: Vec<_> = outline().map(|(x, y)| flat(x * self.span_m, y * self.span_m)).collect();
        match condition {
            Condition::Sound => body.triangles.push(self.filled(colour)),
            Condition::Lost | Condition::Failsafe => {
                body.lines.push(line(LineLoop, outline, 2.0, colour, 1.0));
            }
            Condition::Collided => {
                body.lines.push(line(LineLoop, outline, 2.0, colour, 1.0));
                body.lines.push(line(LineList, self.cross(Point2::origin()), 4.0, palette::ALARM, 1.0));
            }
        }
    }

    fn filled(&self, colour: Rgb) -> TriangleListPrimitive {
        let corner = |index: usize, side: f64| {
            let (x, y) = OUTLINE[index];
            flat(x * self.span_m, side * y * self.span_m)
        };
        // The outline lists one side only, so draw the triangles of both.
        let side =
            |side: f64| TRIANGLES.iter().flat_map(move |corners| corners.map(|index| corner(index, side)));
        TriangleListPrimitive {
            pose: Some(at(0.0, 0.0, 0.0)),
            points: side(1.0).chain(side(-1.0)).collect(),
            color: Some(colour.in_scene(1.0)),
            ..TriangleListPrimitive::default()
        }
    }

    fn cross(&self, place: Point2<f64>) -> Vec<Point3> {
        let half = 0.6 * self.span_m;
        [(-1.0, -1.0), (1.0, 1.0), (-1.0, 1.0), (1.0, -1.0)]
            .map(|(x, y)| flat(place.x + x * half, place.y + y * half))
            .into()
    }
}

fn look(frame: &Frame, uav: u32, place: Option<Point2<f64>>, faults: &CurrentFaults) -> Option<CraftLook> {
    let state = frame.uavs.get(uav as usize - 1).and_then(|uav| uav.state.as_ref());
    // A vanished UAV is marked where it was last seen; one that was never seen is not drawn.
    match state.filter(|state| state.mode != FlightMode::VANISHED) {
        Some(state) => Some(CraftLook::Flying { condition: faults.condition(uav), mode: state.mode }),
        None => place.map(CraftLook::Gone),
    }
}

fn name(uav: u32, condition: Condition, mode: FlightMode) -> String {
    match condition {
        Condition::Sound => uav.to_string(),
        Condition::Lost => format!("{uav} lost"),
        Condition::Failsafe => format!("{uav} {}", mode.name()),
        Condition::Collided => format!("{uav} collided"),
    }
}

/// The complete outline of an aircraft of span 1.
pub(super) fn outline() -> impl Iterator<Item = (f64, f64)> {
    let right = OUTLINE[1..OUTLINE.len() - 1].iter().rev().map(|(x, y)| (*x, -y));
    OUTLINE.iter().copied().chain(right)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{show::faults::FaultWatch, testing};
    use ringwing_flight::{Event, Part, UavId};

    fn names(scene: &SceneUpdate) -> Vec<(&str, &str)> {
        scene.entities.iter().map(|one| (&*one.frame_id, &*one.texts[0].text)).collect()
    }

    #[test]
    fn every_change_gives_a_scene_of_all_uavs() {
        let scenario = testing::ring_of(3, 40.0);
        let (mut craft, mut faults) = (CraftScene::new(3, 40.0), FaultWatch::default());
        let mut frame = testing::at_rest(&scenario, 0);
        let mut scene = |frame: &Frame, faults: &CurrentFaults| {
            craft.observe(frame);
            craft.scene(frame, faults, Clock::new(100))
        };
        let first = scene(&frame, faults.now()).unwrap();
        assert_eq!(names(&first), [("uav_001", "1"), ("uav_002", "2"), ("uav_003", "3")]);
        assert_eq!(scene(&frame, faults.now()), None);
        faults.on_event(&Event::ProcessFrozen { part: Part::Agent(UavId(2)) });
        assert_eq!(names(&scene(&frame, faults.now()).unwrap())[1], ("uav_002", "2 lost"));
        frame.uavs[0].state.as_mut().unwrap().mode = FlightMode::HOLD;
        faults.observe(&frame);
        let held = scene(&frame, faults.now()).unwrap();
        assert_eq!((names(&held)[0], held.entities[0].triangles.len()), (("uav_001", "1 hold"), 0));
        frame.uavs[2].state = None;
        faults.observe(&frame);
        assert_eq!(names(&scene(&frame, faults.now()).unwrap())[2], ("map", "3 vanished"));
    }

    #[test]
    fn in_a_large_swarm_a_uav_is_named_only_while_it_has_news() {
        let scenario = testing::ring_of(13, 40.0);
        let (mut craft, mut faults) = (CraftScene::new(13, 40.0), FaultWatch::default());
        let mut named_at = |tick: i64, faults: &CurrentFaults| {
            let frame = testing::at_rest(&scenario, tick);
            craft.observe(&frame);
            let scene = craft.scene(&frame, faults, Clock::new(100))?;
            let names = scene.entities.iter().flat_map(|one| &one.texts).map(|text| text.text.clone());
            Some(names.collect::<Vec<_>>())
        };
        assert_eq!(named_at(0, faults.now()), Some(vec![]));
        faults.on_event(&Event::ProcessFrozen { part: Part::Agent(UavId(7)) });
        assert_eq!(named_at(100, faults.now()), Some(vec!["7 lost".to_owned()]));
        assert_eq!(named_at(899, faults.now()), None, "still named");
        assert_eq!(named_at(900, faults.now()), Some(vec![]), "8 s later");
    }

    #[test]
    fn an_aircraft_is_longer_ahead_than_behind_and_as_wide_as_its_span() {
        let widest = outline().map(|(_, y)| y).fold(0.0, f64::max);
        assert_eq!((widest, outline().count()), (0.5, 16));
        let craft = CraftScene::new(3, 100.0);
        let nose = craft.filled(palette::BRIGHT).points.iter().map(|point| point.x).fold(0.0, f64::max);
        assert!((nose - 0.55 * craft.span_m).abs() < 1e-9);
    }
}
