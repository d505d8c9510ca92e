//! The control law of the paper: one small function for each equation.
//!
//! Knows points, vectors and numbers. Never knows messages, ticks or files.

mod control;
mod lyapunov;
mod potential;
mod repulsion;

pub use control::{
    ControlInput, Limits, LimitsError, formation_control, saturate, saturated_control, speed_force,
};
pub use lyapunov::{Flyer, lyapunov_candidate, lyapunov_rate};
pub use potential::{Bond, Field, Forces, potential, potential_forces};
pub use repulsion::{RepulsiveObstacle, repulsion};

use nalgebra::{Point2, Vector2};

/// Bound on every component of a displacement. Nothing flies this far; the bound keeps all products finite, whatever
/// was received. Beyond about 1e150 their squares would overflow.
const FARTHEST_M: f64 = 1e12;

/// The vector from `from` to `to`, each component within [`FARTHEST_M`].
fn displacement(from: &Point2<f64>, to: &Point2<f64>) -> Vector2<f64> {
    // Finite coordinates of about 1e308 m can differ by infinity. The clamp makes that finite, too.
    (to - from).map(|component| component.clamp(-FARTHEST_M, FARTHEST_M))
}

/// Length and unit vector of `vector`; `None` if its length is zero.
fn polar(vector: &Vector2<f64>) -> Option<(f64, Vector2<f64>)> {
    let length = vector.norm();
    (length > 0.0).then(|| (length, vector / length))
}
