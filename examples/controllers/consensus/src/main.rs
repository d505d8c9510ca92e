//! A second-order consensus law after Ren and Beard, *Distributed Consensus in Multi-vehicle Cooperative Control* (2008): a UAV
//! steers for its own slot, and for the place where its neighbours, in their slots, would see it.
//!
//! Start it with `ringwing run paper-4.1 --agent "all=./target/release/consensus"`. `--gain` sets how hard it pulls.

use ringwing_controller::{Controller, Point2, Situation, Vector2, Wish, direction};
use std::process::ExitCode;

/// Share of the disagreement with the neighbours that is added to the error in the slot. More keeps the shape better while all are
/// off; too much lets a ring oscillate.
const NEIGHBOUR_SHARE: f64 = 0.3;
/// The largest correction, as a share of the speed of the slot. From 1 on, a UAV far ahead of its slot flies back to it.
const CORRECTION_SHARE: f64 = 0.5;
/// From the angle between heading and wanted velocity to turn rate. More turns faster; above the tick rate it would oscillate.
const HEADING_GAIN_PER_S: f64 = 2.0;

struct Consensus {
    /// From an error in metres to a velocity.
    gain_per_s: f64,
}

impl Consensus {
    /// What to add to the velocity of the slot, in m/s: towards the slot, and towards the distance to each neighbour.
    fn correction(&self, situation: &Situation, slot: Point2<f64>) -> Vector2<f64> {
        let mut error_m = slot - situation.own.position;
        for neighbour in situation.neighbours.iter().flatten() {
            let Some(track) = neighbour.track else { continue };
            // A state takes a tick to arrive, so predict where the neighbour is now.
            let there = track.after(situation.age_s(track.tick)).position;
            let apart = there - situation.own.position;
            let distance_m = apart.norm().max(1.0);
            error_m += apart / distance_m * (distance_m - neighbour.rest_m) * NEIGHBOUR_SHARE;
        }
        error_m * self.gain_per_s
    }
}

impl Controller for Consensus {
    fn step(&mut self, situation: &Situation) -> Wish {
        let (Some(slot), Some(motion)) = (situation.slot_m(), situation.slot_motion()) else {
            return Wish::new(situation.sensed.speed_m_s, 0.0);
        };
        // A UAV that is far ahead has to wait for its slot. A larger correction would turn it round.
        let most_m_s = CORRECTION_SHARE * motion.velocity_m_s.norm();
        let correction = self.correction(situation, slot);
        let wanted = motion.velocity_m_s + correction.cap_magnitude(most_m_s);
        let along = direction(situation.own.heading_rad);
        let angle_rad = along.perp(&wanted).atan2(along.dot(&wanted));
        let turn_rate_rad_s = motion.turn_rate_rad_s + HEADING_GAIN_PER_S * angle_rad;
        // The log then shows when the correction is cut.
        Wish::new(wanted.norm(), turn_rate_rad_s).with_note("correction_m_s", correction.norm())
    }
}

fn main() -> ExitCode {
    ringwing_controller::main(|start| {
        let gain = start.arguments.iter().skip_while(|word| *word != "--gain").nth(1);
        let gain = gain.and_then(|gain| gain.to_str()?.parse().ok());
        Consensus { gain_per_s: gain.unwrap_or(0.5) }
    })
}
