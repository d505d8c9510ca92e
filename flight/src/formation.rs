//! The standard formation of Definition 1 of the paper: n slots evenly on a circle, neighbouring slots L apart.
//!
//! Must never know where the UAVs are, only where they should be. Which slots are flown after a loss is decided in
//! [`crate::ring`].

use nalgebra::{Point2, Vector2};
use std::f64::consts::{PI, TAU};

/// The ring of slots that the whole swarm flies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Formation {
    count: u32,
    spacing_m: f64,
    bearing_rad: f64,
}

impl Formation {
    /// A ring of `count` (n) slots, `spacing_m` (L) apart, with slot 1 at bearing `bearing_rad` (alpha) from the
    /// centre.
    ///
    /// # Panics
    /// If `count` is 0 or `spacing_m` is not positive. Validation refuses such scenarios.
    pub fn new(count: u32, spacing_m: f64, bearing_rad: f64) -> Self {
        assert!(count >= 1 && spacing_m > 0.0, "no ring of {count} slots {spacing_m} m apart");
        Self { count, spacing_m, bearing_rad }
    }

    /// n, the number of slots.
    pub fn count(&self) -> u32 {
        self.count
    }

    /// L, the distance between neighbouring slots in metres.
    pub fn spacing_m(&self) -> f64 {
        self.spacing_m
    }

    /// R = L / (2 sin(pi / n)), the distance of each slot from the centre in metres (Section 2 of the paper).
    pub fn radius_m(&self) -> f64 {
        self.radius_of_m(self.count)
    }

    /// The radius of a ring of `count` slots with the same spacing. A single slot is in the centre.
    pub(crate) fn radius_of_m(&self, count: u32) -> f64 {
        // The sine of the rounded pi is not zero, so the formula would give a radius of about 1e17 m.
        if count == 1 {
            return 0.0;
        }
        self.spacing_m / (2.0 * libm::sin(PI / f64::from(count)))
    }

    /// The bearing of slot `number`, counted from 1, seen from the centre. Slots are numbered clockwise (Section 2).
    pub(crate) fn bearing_rad(&self, number: u32) -> f64 {
        self.bearing_rad - f64::from(number - 1) * TAU / f64::from(self.count)
    }

    /// `p_id` of Section 2: the place of slot `number`, counted from 1, if the formation's centre is at `centre`.
    ///
    /// # Panics
    /// If `number` is not in 1 to n.
    pub fn slot(&self, number: u32, centre: Point2<f64>) -> Point2<f64> {
        assert!((1..=self.count).contains(&number), "no slot {number} in a ring of {}", self.count);
        let bearing = self.bearing_rad(number);
        centre + Vector2::new(libm::cos(bearing), libm::sin(bearing)) * self.radius_m()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ring(count: u32) -> (Formation, Vec<Point2<f64>>) {
        let formation = Formation::new(count, 40.0, PI);
        let centre = Point2::new(7.0, -3.0);
        (formation, (1..=count).map(|number| formation.slot(number, centre)).collect())
    }

    #[test]
    fn slots_are_spacing_apart_and_radius_from_the_centre() {
        for count in [3, 4, 5, 6, 12, 33, 200] {
            let (formation, slots) = ring(count);
            for (slot, next) in slots.iter().zip(slots.iter().cycle().skip(1)) {
                assert!(((slot - next).norm() - 40.0).abs() < 1e-9, "n = {count}");
                assert!(((slot - Point2::new(7.0, -3.0)).norm() - formation.radius_m()).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn the_slots_of_six_uavs_are_where_the_papers_figures_show_them() {
        // The figures of Section 4: with alpha = pi, UAV 1 flies at the rear, UAV 4 in front, UAVs 2 and 3 on the left.
        let formation = Formation::new(6, 40.0, PI);
        let slot = |number| formation.slot(number, Point2::origin());
        assert!((slot(1) - Point2::new(-40.0, 0.0)).norm() < 1e-9);
        assert!((slot(4) - Point2::new(40.0, 0.0)).norm() < 1e-9);
        for number in [2, 3] {
            assert!((slot(number).y - 34.641_016).abs() < 1e-6);
        }
    }
}
