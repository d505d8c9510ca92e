//! The forces of Eq. (4) near a rest of the formation, as matrices: K of the UAVs themselves, and of their neighbours.
//!
//! Coordinates are relative to the slots, x along the leader's heading and y across it: x and y of UAV 1, x and y of
//! UAV 2, and so on. Never knows frequencies.

use super::{Late, Linearised};
use nalgebra::{DMatrix, DVector, Matrix2, Vector2};
use std::f64::consts::{PI, TAU};

/// Most steps of Newton's method. From the rest of a slightly shorter delay it needs about four; if there is no rest, more
/// steps only take longer.
const STEPS_MAX: usize = 50;
/// A force below this share of L counts as zero. A smaller one is below rounding errors.
const ZERO_FORCE: f64 = 1e-11;

/// How the forces change with the positions of the UAVs.
pub(super) struct Stiffness {
    /// Change of each UAV's force with its own position: 2 x 2 blocks on the diagonal.
    pub(super) own: DMatrix<f64>,
    /// Minus the change of each UAV's force with its neighbours' positions.
    pub(super) neighbours: DMatrix<f64>,
}

impl Stiffness {
    /// Where the UAVs are at `rest`, relative to their slots.
    pub(super) fn new(swarm: &Linearised, late: Late, delay_s: f64, rest: &[f64]) -> Self {
        forces(swarm, late, delay_s, rest).1
    }

    /// The spectral radius of the neighbours' stiffness along the leader's heading.
    pub(super) fn radius_along(&self) -> f64 {
        let count = self.neighbours.nrows() / 2;
        let along = DMatrix::from_fn(count, count, |row, column| self.neighbours[(2 * row, 2 * column)]);
        along.symmetric_eigenvalues().amax()
    }
}

/// Where the UAVs are relative to their slots while all forces are zero, by Newton's method from `near` (from the slots if
/// that is empty). `None` if there is no rest near there.
pub(super) fn rest(swarm: &Linearised, late: Late, delay_s: f64, near: &[f64]) -> Option<Vec<f64>> {
    let mut at = if near.is_empty() { vec![0.0; 2 * swarm.uavs as usize] } else { near.to_vec() };
    for _ in 0..STEPS_MAX {
        let (force, stiffness) = forces(swarm, late, delay_s, &at);
        if force.amax() <= ZERO_FORCE * swarm.spacing_m {
            return Some(at);
        }
        let step = (stiffness.own - stiffness.neighbours).lu().solve(&force)?;
        at.iter_mut().zip(step.iter()).for_each(|(at, step)| *at -= step);
        // Where a rest has vanished, the method goes far away and back.
        if step.amax() > swarm.spacing_m {
            return None;
        }
    }
    None
}

/// The forces f of Eq. (4) on all UAVs at `at`, and how they change.
fn forces(swarm: &Linearised, late: Late, delay_s: f64, at: &[f64]) -> (DVector<f64>, Stiffness) {
    let count = swarm.uavs as usize;
    let size = 2 * count;
    let (mut force, mut own, mut neighbours) =
        (DVector::zeros(size), DMatrix::zeros(size, size), DMatrix::zeros(size, size));
    for uav in 0..count {
        let UavForces { sum, stiffness, bonds } = forces_on(swarm, late, delay_s, at, uav);
        force.fixed_rows_mut::<2>(2 * uav).copy_from(&sum);
        own.fixed_view_mut::<2, 2>(2 * uav, 2 * uav).copy_from(&stiffness);
        // Three UAVs are all neighbours of each other; no two bonds of one UAV are the same.
        for (other, bond) in bonds {
            neighbours.fixed_view_mut::<2, 2>(2 * uav, 2 * other).copy_from(&bond);
        }
    }
    (force, Stiffness { own, neighbours })
}

/// The forces on one UAV.
struct UavForces {
    sum: Vector2<f64>,
    /// The change of the sum with the UAV's own position.
    stiffness: Matrix2<f64>,
    /// Minus its changes with the positions of both neighbours, each with the neighbour's index.
    bonds: [(usize, Matrix2<f64>); 2],
}

fn forces_on(swarm: &Linearised, late: Late, delay_s: f64, at: &[f64], uav: usize) -> UavForces {
    let count = swarm.uavs as usize;
    let error = |uav: usize| Vector2::new(at[2 * uav], at[2 * uav + 1]);
    // A position that is held is where its UAV was: the leader's speed times the delay behind.
    let behind = Vector2::new(swarm.speed_m_s * delay_s, 0.0);
    let own_error = if late == Late::OwnState { error(uav) - behind } else { error(uav) };
    let own = slot(swarm, uav) + own_error;
    let (gain, gain_slope) = faded_gain(swarm, &own_error);
    let trust = match (late, swarm.trust_time_s) {
        (Late::NeighboursHeld | Late::NeighboursReckoned, Some(time_s)) => libm::exp(-delay_s / time_s),
        _ => 1.0,
    };
    let others = [(uav + count - 1) % count, (uav + 1) % count];
    let bond = |other: usize| {
        let at = slot(swarm, other) + error(other);
        // A UAV whose own state is late tells its neighbours the same late position.
        let is_behind = matches!(late, Late::NeighboursHeld | Late::OwnState);
        let seen = if is_behind { at - behind } else { at };
        spring(&(own - seen), swarm.spacing_m, trust)
    };
    let centre = spring(&own, radius_m(swarm), 1.0);
    let (one, two) = (bond(others[0]), bond(others[1]));
    let pull = one.0 + two.0 + centre.0;
    let stiffness = (one.1 + two.1 + centre.1) * gain
        + pull * gain_slope.transpose()
        + Matrix2::identity() * swarm.slot_gain;
    UavForces {
        sum: pull * gain + own_error * swarm.slot_gain,
        stiffness,
        bonds: [(others[0], one.1 * gain), (others[1], two.1 * gain)],
    }
}

/// G at this distance from the slot, and how it changes.
fn faded_gain(swarm: &Linearised, error: &Vector2<f64>) -> (f64, Vector2<f64>) {
    let Some(reach_m) = swarm.reach_m else { return (swarm.formation_gain, Vector2::zeros()) };
    let gain = swarm.formation_gain * libm::exp(-error.norm_squared() / (reach_m * reach_m));
    (gain, error * (-2.0 * gain / (reach_m * reach_m)))
}

/// `weight (|d| - rest) d / |d|` of Eq. (4) at `d`, and its change with `d`.
fn spring(d: &Vector2<f64>, rest_m: f64, weight: f64) -> (Vector2<f64>, Matrix2<f64>) {
    let length = d.norm();
    if length == 0.0 {
        return (Vector2::zeros(), Matrix2::zeros());
    }
    let along = d / length;
    let outer = along * along.transpose();
    // Across its direction, a spring is stiff only while it is stretched.
    let stiffness = outer + (Matrix2::identity() - outer) * (1.0 - rest_m / length);
    (along * (weight * (length - rest_m)), stiffness * weight)
}

/// R of Section 2.
fn radius_m(swarm: &Linearised) -> f64 {
    swarm.spacing_m / (2.0 * libm::sin(PI / f64::from(swarm.uavs)))
}

/// The slot of the UAV at this place, from the centre; UAV 1 is at place 0, the others follow clockwise.
fn slot(swarm: &Linearised, place: usize) -> Vector2<f64> {
    let bearing = swarm.bearing_rad - place as f64 * TAU / f64::from(swarm.uavs);
    Vector2::new(libm::cos(bearing), libm::sin(bearing)) * radius_m(swarm)
}
