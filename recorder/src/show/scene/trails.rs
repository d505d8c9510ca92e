//! Draws a line through the last 45 s of each UAV's flight: `/scene/trails`.
//!
//! Never stores positions more exactly than a screen shows: rounding keeps the largest scene of the log small.

use super::{MAP, entity, flat, line, whole};
use crate::{clock::Clock, metrics::Frame, schema::topics::padded, show::palette};
use foxglove::messages::{Point3, SceneUpdate, line_primitive::Type::LineStrip};
use nalgebra::Point2;
use std::collections::VecDeque;

/// Simulated time that a trail goes back. A longer one makes every trail message larger, and trails of a turning swarm
/// cover each other.
const LENGTH_S: f64 = 45.0;
/// Positions kept per simulated second. More make the messages larger; fewer show corners in turns.
const PLACES_HZ: u32 = 2;

/// The past positions of every UAV.
#[derive(Debug, Clone)]
pub(crate) struct Trails {
    clock: Clock,
    /// UAV 1 first; of each, the oldest position first, with its tick.
    places: Vec<VecDeque<(i64, Point2<f64>)>>,
}

impl Trails {
    /// The empty trails of a swarm of `uavs`.
    pub(crate) fn new(uavs: u32, clock: Clock) -> Self {
        Self { clock, places: vec![VecDeque::new(); uavs as usize] }
    }

    /// Adds the position of every UAV in the sky, if one is due at this tick.
    pub(crate) fn observe(&mut self, frame: &Frame) {
        if !self.clock.is_due(frame.tick, PLACES_HZ) {
            return;
        }
        let oldest = frame.tick - (LENGTH_S * f64::from(self.clock.rate_hz())) as i64;
        for (places, uav) in self.places.iter_mut().zip(&frame.uavs) {
            // By age, not by number: the trail of a UAV that has left the sky has to end, too.
            while places.front().is_some_and(|(tick, _)| *tick < oldest) {
                places.pop_front();
            }
            if let Some(state) = &uav.state {
                places.push_back((frame.tick, rounded(Point2::new(state.x_m, state.y_m))));
            }
        }
    }

    /// The trails as a scene, without those too short to be a line.
    pub(crate) fn scene(&self, frame: &Frame) -> SceneUpdate {
        let count = self.places.len() as u32;
        let trail = |(uav, places): (u32, &VecDeque<(i64, Point2<f64>)>)| {
            let mut trail = entity(MAP, format!("trail {}", padded(uav, count)), self.clock, frame.tick);
            let points: Vec<Point3> = places.iter().map(|(_, place)| flat(place.x, place.y)).collect();
            trail.lines.push(line(LineStrip, points, 1.5, palette::colour(uav), 0.6));
            trail
        };
        let trails = (1..).zip(&self.places).filter(|(_, places)| places.len() > 1).map(trail);
        whole(trails.collect(), self.clock, frame.tick)
    }
}

/// Rounds to 1/16 m: no screen shows more, and most of a double's bytes are zero then, which compresses well.
fn rounded(place: Point2<f64>) -> Point2<f64> {
    place.map(|value| (value * 16.0).round() / 16.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing;

    #[test]
    fn a_trail_shows_the_last_45_seconds() {
        let scenario = testing::slow_ring();
        let mut trails = Trails::new(3, Clock::new(4));
        let mut last = None;
        for mut frame in testing::flight(&scenario, 0..400) {
            if frame.tick > 300 {
                frame.uavs[2].state = None;
            }
            trails.observe(&frame);
            last = Some(trails.scene(&frame));
        }
        let points: Vec<_> = last.unwrap().entities.iter().map(|trail| trail.lines[0].points.len()).collect();
        // 45 s twice a second, both ends counted; UAV 3 left 25 s ago.
        assert_eq!(points, [91, 91, 42]);
    }
}
