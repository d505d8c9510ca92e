//! The potential function and its gradient, Eq. (3) and (4).
//!
//! Never divides by a distance of zero: a term without a direction contributes no force.

use super::{displacement, polar};
use nalgebra::{Point2, Vector2};

/// A distance to keep from a point: L from a ring neighbour, or R from the formation's centre.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bond {
    /// The point to keep the distance from.
    pub point: Point2<f64>,
    /// The distance to keep, in metres.
    pub rest_m: f64,
    /// G, positive.
    pub gain: f64,
}

impl Bond {
    /// `1/2 G (|p_i - p_j| - L)^2` of Eq. (3), in m^2.
    fn potential_m2(&self, own: &Point2<f64>) -> f64 {
        let stretch_m = displacement(&self.point, own).norm() - self.rest_m;
        0.5 * self.gain * stretch_m * stretch_m
    }

    /// `G (|p_i - p_j| - L) (p_i - p_j) / |p_i - p_j|` of Eq. (4), in m.
    ///
    /// Zero if the two points coincide: then the term has no direction.
    fn force_m(&self, own: &Point2<f64>) -> Vector2<f64> {
        polar(&displacement(&self.point, own)).map_or_else(Vector2::zeros, |(distance_m, outward)| {
            outward * (self.gain * (distance_m - self.rest_m))
        })
    }
}

/// Everything that Eq. (3) measures one UAV's position against.
///
/// Each term has its own gain and rest length. A neighbour that was never received has no term.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Field {
    /// The previous ring neighbour.
    pub previous: Option<Bond>,
    /// The next ring neighbour.
    pub next: Option<Bond>,
    /// The formation's centre `p_c`.
    pub centre: Bond,
    /// The slot `p_id`.
    pub slot: Point2<f64>,
    /// Gain of the slot's term; 1 in the paper.
    pub slot_gain: f64,
}

impl Field {
    fn neighbours(&self) -> impl Iterator<Item = &Bond> {
        self.previous.iter().chain(&self.next)
    }
}

/// The terms of the potential force, in m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Forces {
    /// The previous ring neighbour's term.
    pub previous: Vector2<f64>,
    /// The next ring neighbour's term.
    pub next: Vector2<f64>,
    /// The formation centre's term.
    pub centre: Vector2<f64>,
    /// The slot's term.
    pub slot: Vector2<f64>,
}

impl Forces {
    /// `f_i` of Eq. (4).
    pub fn total(&self) -> Vector2<f64> {
        self.previous + self.next + self.centre + self.slot
    }
}

/// `F_i` of Eq. (3), in m^2: it grows with the distance of a UAV at `own` from where it should be.
pub fn potential(field: &Field, own: &Point2<f64>) -> f64 {
    let neighbours_m2: f64 = field.neighbours().map(|bond| bond.potential_m2(own)).sum();
    let slot_m2 = 0.5 * field.slot_gain * displacement(&field.slot, own).norm_squared();
    neighbours_m2 + field.centre.potential_m2(own) + slot_m2
}

/// The terms of `f_i`, Eq. (4): the gradient of [`potential`] at `own`.
pub fn potential_forces(field: &Field, own: &Point2<f64>) -> Forces {
    let of_neighbour = |bond: Option<Bond>| bond.map_or_else(Vector2::zeros, |bond| bond.force_m(own));
    Forces {
        previous: of_neighbour(field.previous),
        next: of_neighbour(field.next),
        centre: field.centre.force_m(own),
        // Like the other terms it points away from where it pulls: f_i is a gradient, and Eq. (6) applies -f_i.
        slot: displacement(&field.slot, own) * field.slot_gain,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn position() -> impl Strategy<Value = Point2<f64>> {
        (-500.0..500.0, -500.0..500.0).prop_map(|(x, y)| Point2::new(x, y))
    }

    fn field() -> impl Strategy<Value = Field> {
        let bond = |rest: f64| {
            (position(), 0.1..5.0).prop_map(move |(point, gain)| Bond { point, rest_m: rest, gain })
        };
        (bond(40.0), bond(40.0), bond(57.0), position(), 0.1..5.0).prop_map(
            |(previous, next, centre, slot, slot_gain)| Field {
                previous: Some(previous),
                next: Some(next),
                centre,
                slot,
                slot_gain,
            },
        )
    }

    fn numeric_gradient(field: &Field, own: &Point2<f64>) -> Vector2<f64> {
        const STEP: f64 = 1e-4;
        let along = |axis: Vector2<f64>| {
            (potential(field, &(own + axis * STEP)) - potential(field, &(own - axis * STEP))) / (2.0 * STEP)
        };
        Vector2::new(along(Vector2::x()), along(Vector2::y()))
    }

    proptest! {
        #[test]
        fn the_force_is_the_gradient_of_the_potential(field in field(), own in position()) {
            let ends = [field.previous.unwrap().point, field.next.unwrap().point, field.centre.point];
            prop_assume!(ends.iter().all(|end| (end - own).norm() > 0.1));
            let (exact, numeric) = (potential_forces(&field, &own).total(), numeric_gradient(&field, &own));
            prop_assert!((exact - numeric).norm() < 1e-3 * (1.0 + exact.norm()), "{exact} {numeric}");
        }

        #[test]
        fn shifting_and_turning_a_swarm_shifts_and_turns_its_forces(
            field in field(), own in position(), shift in position(), angle in -3.0..3.0,
        ) {
            let turn = nalgebra::Rotation2::new(angle);
            let moved = |point: Point2<f64>| turn * point + shift.coords;
            let moved_bond = |bond: Bond| Bond { point: moved(bond.point), ..bond };
            let moved_field = Field {
                previous: field.previous.map(moved_bond),
                next: field.next.map(moved_bond),
                centre: moved_bond(field.centre),
                slot: moved(field.slot),
                slot_gain: field.slot_gain,
            };
            let force = potential_forces(&field, &own).total();
            let moved_force = potential_forces(&moved_field, &moved(own)).total();
            prop_assert!((turn * force - moved_force).norm() < 1e-8 * (1.0 + force.norm()));
            let (before, after) = (potential(&field, &own), potential(&moved_field, &moved(own)));
            prop_assert!((before - after).abs() < 1e-8 * (1.0 + before));
        }

        #[test]
        fn swapping_the_neighbours_leaves_the_force_the_same(field in field(), own in position()) {
            let swapped = Field { previous: field.next, next: field.previous, ..field };
            let difference = potential_forces(&field, &own).total() - potential_forces(&swapped, &own).total();
            prop_assert!(difference.norm() < 1e-9);
        }
    }

    #[test]
    fn coinciding_points_exert_no_force() {
        let own = Point2::new(3.0, 4.0);
        let bond = Bond { point: own, rest_m: 40.0, gain: 2.0 };
        let field = Field { previous: Some(bond), next: None, centre: bond, slot: own, slot_gain: 1.0 };
        assert_eq!(potential_forces(&field, &own).total(), Vector2::zeros());
        assert!((potential(&field, &own) - 3200.0).abs() < 1e-9);
    }

    #[test]
    fn a_neighbour_that_is_too_near_pushes_and_one_that_is_too_far_pulls() {
        let bond = Bond { point: Point2::origin(), rest_m: 40.0, gain: 2.0 };
        // f_i is the gradient: the UAV moves against it.
        assert_eq!(bond.force_m(&Point2::new(30.0, 0.0)), Vector2::new(-20.0, 0.0));
        assert_eq!(bond.force_m(&Point2::new(0.0, 55.0)), Vector2::new(0.0, 30.0));
    }
}
