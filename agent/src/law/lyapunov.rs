//! The Lyapunov candidate of Theorem 1 and its rate, Eq. (7) and (10).
//!
//! Never part of a command: only tests of the law use it.

use super::{Field, displacement, potential_forces};
use nalgebra::{Point2, Vector2};
use ringwing_flight::direction;

/// One UAV of a swarm, with what its law measures its position against.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Flyer {
    /// `p_i`.
    pub position: Point2<f64>,
    /// `theta_i`.
    pub heading_rad: f64,
    /// What Eq. (3) measures its position against.
    pub field: Field,
}

/// V of Eq. (7), in m^2: zero in the standard formation with every heading equal to the leader's, positive elsewhere.
///
/// Each UAV of a pair counts half of the pair's term. The heading term follows the paper, which adds m/s to m^2.
pub fn lyapunov_candidate(flyers: &[Flyer], leader_speed_m_s: f64, leader_heading_rad: f64) -> f64 {
    flyers.iter().map(|flyer| candidate_of(flyer, leader_speed_m_s, leader_heading_rad)).sum()
}

fn candidate_of(flyer: &Flyer, leader_speed_m_s: f64, leader_heading_rad: f64) -> f64 {
    let Field { previous, next, centre, slot, slot_gain } = flyer.field;
    let stretched = |bond: super::Bond, share: f64| {
        let stretch_m = displacement(&bond.point, &flyer.position).norm() - bond.rest_m;
        share * bond.gain * stretch_m * stretch_m
    };
    // 1/4 instead of the 1/2 of Eq. (3), because both UAVs of a pair add the same term.
    let neighbours: f64 = previous.iter().chain(&next).map(|bond| stretched(*bond, 0.25)).sum();
    let slot = 0.5 * slot_gain * displacement(&slot, &flyer.position).norm_squared();
    let heading = leader_speed_m_s * (1.0 - libm::cos(flyer.heading_rad - leader_heading_rad));
    neighbours + stretched(centre, 0.5) + slot + heading
}

/// dV/dt of Eq. (10) under the unsaturated law, Eq. (6): never positive.
///
/// Requires an undirected communication graph: the laws of two neighbours each have a term for the other.
pub fn lyapunov_rate(flyers: &[Flyer], leader_speed_m_s: f64, leader_heading_rad: f64) -> f64 {
    let leader: Vector2<f64> = direction(leader_heading_rad) * leader_speed_m_s;
    let rate_of = |flyer: &Flyer| {
        let along = direction(flyer.heading_rad);
        let across = Vector2::new(-along.y, along.x);
        let force = potential_forces(&flyer.field, &flyer.position).total();
        // What is left of Eq. (10): the forces between two neighbours are opposite, so their products with v_d h_d
        // cancel in the sum.
        -along.dot(&force).powi(2) - across.dot(&leader).powi(2)
    };
    flyers.iter().map(rate_of).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::law::Bond;

    #[test]
    fn the_candidate_adds_its_terms_as_eq_7_does() {
        let bond = |x: f64, rest_m: f64| Bond { point: Point2::new(x, 0.0), rest_m, gain: 2.0 };
        let field = Field {
            previous: Some(bond(30.0, 40.0)),
            next: Some(bond(-46.0, 40.0)),
            centre: bond(25.0, 20.0),
            slot: Point2::new(0.0, 3.0),
            slot_gain: 3.0,
        };
        let flyer = Flyer { position: Point2::origin(), heading_rad: std::f64::consts::FRAC_PI_2, field };
        // Stretched by -10, 6 and 5 m, with a quarter, a quarter and a half of G = 2; 3 m from the slot
        // with a gain of 3; across the leader.
        let expected = 0.5 * 100.0 + 0.5 * 36.0 + 25.0 + 0.5 * 3.0 * 9.0 + 15.0;
        assert!((lyapunov_candidate(&[flyer], 15.0, 0.0) - expected).abs() < 1e-9);
        assert!((lyapunov_candidate(&[flyer, flyer], 15.0, 0.0) - 2.0 * expected).abs() < 1e-9);
    }
}
