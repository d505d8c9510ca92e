//! The shapes of a formation: where the slots of each lie around the leader (Remark 2 of the paper).
//!
//! A shape has two coordinates: ahead and to the left, seen in its own direction. Must never know how the formation is
//! turned, or which UAVs are alive.

use nalgebra::Vector2;
use std::f64::consts::TAU;

/// The shape of a formation.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// Evenly on a circle (Definition 1).
    Ring,
    /// The ring, stretched. `aspect` is its width divided by its length; the shorter half-axis is R.
    Ellipse {
        /// Width divided by length, above 0.
        aspect: f64,
    },
    /// The ring with every second slot nearer to the centre.
    Star {
        /// Distance of the inner slots from the centre as a share of that of the outer ones.
        inner_ratio: f64,
    },
    /// Two straight arms from a tip in front. With an even number of slots, the left arm is longer by one.
    Vee {
        /// The angle by which the arms lie behind the line across.
        sweep_rad: f64,
    },
    /// A straight line, slot 1 at its left end.
    Echelon {
        /// The angle by which the right end lies behind the line across; negative is ahead.
        sweep_rad: f64,
    },
    /// Rows across, filled from the front, every second one from right to left.
    Grid {
        /// The number of slots in a row.
        columns: u32,
    },
    /// Any places, one for each slot, ahead and to the left of the leader in metres.
    Offsets(Vec<Vector2<f64>>),
}

impl Shape {
    /// Whether the slots are places along an open path. The slots of all other shapes go round the centre.
    pub fn is_path(&self) -> bool {
        !matches!(self, Self::Ring | Self::Ellipse { .. } | Self::Star { .. })
    }

    /// The places of `count` slots along the path, `spacing_m` apart; empty for a shape that goes round the centre.
    ///
    /// The centre is the mean of the places, so that the swarm keeps its leader in the middle. Listed offsets count from
    /// the leader.
    pub(crate) fn path(&self, count: u32, spacing_m: f64) -> Vec<Vector2<f64>> {
        let places =
            |place: &dyn Fn(u32) -> Vector2<f64>| centred((0..count).map(place).collect(), spacing_m);
        match self {
            Self::Ring | Self::Ellipse { .. } | Self::Star { .. } => Vec::new(),
            Self::Vee { sweep_rad } => places(&|index| vee(index, count, *sweep_rad)),
            Self::Echelon { sweep_rad } => places(&|index| arm(f64::from(index), *sweep_rad)),
            Self::Grid { columns } => places(&|index| grid(index, *columns)),
            Self::Offsets(offsets) => offsets.clone(),
        }
    }

    /// How much farther from the centre than in a ring slot `number` of `count` lies. Only a star differs from a ring.
    pub(crate) fn reach(&self, number: u32, count: u32) -> f64 {
        let Self::Star { inner_ratio } = *self else { return 1.0 };
        let step_rad = TAU / f64::from(count);
        // Shares of the outer distance: from an outer slot to the inner one beside it, between two inner slots, and
        // between the two outer slots that are neighbours where the count is odd. The shortest of them becomes L.
        let across = (1.0 + inner_ratio * (inner_ratio - 2.0 * libm::cos(step_rad))).sqrt();
        let between = if count < 4 { across } else { 2.0 * inner_ratio * libm::sin(step_rad) };
        let chord = 2.0 * libm::sin(step_rad / 2.0);
        let closing = if count % 2 == 1 { chord } else { across };
        let outer = chord / across.min(between).min(closing);
        if number % 2 == 1 { outer } else { outer * inner_ratio }
    }
}

/// A place one spacing times `steps` along an arm to the right.
fn arm(steps: f64, sweep_rad: f64) -> Vector2<f64> {
    Vector2::new(-libm::sin(sweep_rad), -libm::cos(sweep_rad)) * steps
}

fn vee(index: u32, count: u32, sweep_rad: f64) -> Vector2<f64> {
    // From the end of the left arm over the tip to the end of the right one, so that ring neighbours are neighbours in
    // the arms.
    let steps = f64::from(index) - f64::from(count / 2);
    let place = arm(steps.abs(), sweep_rad);
    Vector2::new(place.x, if steps < 0.0 { -place.y } else { place.y })
}

fn grid(index: u32, columns: u32) -> Vector2<f64> {
    let (row, place) = (index / columns, index % columns);
    // Every second row runs back, so that the last slot of a row is beside the first one of the next.
    let column = if row % 2 == 0 { place } else { columns - 1 - place };
    Vector2::new(-f64::from(row), -f64::from(column))
}

/// `places` in spacings, as metres around their mean.
fn centred(places: Vec<Vector2<f64>>, spacing_m: f64) -> Vec<Vector2<f64>> {
    let mean = places.iter().sum::<Vector2<f64>>() / places.len() as f64;
    places.into_iter().map(|place| (place - mean) * spacing_m).collect()
}
