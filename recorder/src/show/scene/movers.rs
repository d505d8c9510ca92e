//! The coordinate frames of what moves by itself, so that its body is drawn once and `/tf` moves it.
//!
//! Never knows what its owner looks like.

use super::{MAP, turned};
use crate::clock::Clock;
use foxglove::messages::{FrameTransform, Vector3};
use ringwing_flight::{Route, RoutePoint, Tick};
use ringwing_scenario::Scenario;

/// Something that moves by itself.
#[derive(Debug, Clone)]
pub(crate) struct Mover {
    frame: String,
    route: Route,
    /// Whether its coordinate frame turns with it. A circle needs no heading, and the name above it should not turn.
    turns: bool,
}

/// The coordinate frame of the `number`th obstacle, counted from 1.
pub(crate) fn obstacle_frame(number: usize) -> String {
    format!("obstacle_{number}")
}

/// The coordinate frame of the `number`th intruder, counted from 1.
pub(super) fn intruder_frame(number: usize) -> String {
    format!("intruder_{number}")
}

/// Everything in `scenario` that moves by itself.
pub(crate) fn movers(scenario: &Scenario) -> Vec<Mover> {
    // Numbered before they are filtered: the number is that in the scenario, as `surroundings` draws it.
    let obstacles = (1..).zip(&scenario.obstacles).filter(|(_, obstacle)| obstacle.moves());
    let obstacles = obstacles.map(|(number, one)| (obstacle_frame(number), one.route(), false));
    let intruders = (1..).zip(&scenario.intruders);
    let intruders = intruders.map(|(number, one)| (intruder_frame(number), one.route(), true));
    obstacles.chain(intruders).map(|(frame, route, turns)| Mover { frame, route, turns }).collect()
}

impl Mover {
    /// Where its coordinate frame is at `tick`.
    pub(super) fn transform(&self, tick: i64, clock: Clock) -> FrameTransform {
        let RoutePoint { pose, .. } = self.route.at(Tick(tick).seconds(clock.rate_hz()));
        FrameTransform {
            timestamp: Some(clock.timestamp(tick)),
            parent_frame_id: MAP.into(),
            child_frame_id: self.frame.clone(),
            translation: Some(Vector3 { x: pose.position.x, y: pose.position.y, z: 0.0 }),
            rotation: Some(turned(if self.turns { pose.heading_rad } else { 0.0 })),
        }
    }
}
