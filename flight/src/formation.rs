//! The formation that the swarm flies: the standard formation of Definition 1 of the paper, or another shape (Remark 2).
//!
//! Must never know where the UAVs are, only where they should be. Which slots are flown after a loss is decided in
//! [`crate::ring`].

use crate::{
    Shape, direction,
    slot::{CirclePlace, Slot, Stretch},
};
use nalgebra::{Point2, Vector2};
use std::f64::consts::{PI, TAU};

/// The slots that the whole swarm flies.
#[derive(Debug, Clone, PartialEq)]
pub struct Formation {
    count: u32,
    spacing_m: f64,
    bearing_rad: f64,
    shape: Shape,
    /// The places along the path, turned; empty for a shape that goes round the centre.
    path: Vec<Vector2<f64>>,
}

impl Formation {
    /// A ring of `count` (n) slots, `spacing_m` (L) apart, with slot 1 at bearing `bearing_rad` (alpha) from the
    /// centre.
    ///
    /// # Panics
    /// If `count` is 0 or `spacing_m` is not positive. Validation refuses such scenarios.
    pub fn new(count: u32, spacing_m: f64, bearing_rad: f64) -> Self {
        Self::shaped(Shape::Ring, count, spacing_m, bearing_rad)
    }

    /// A formation of this `shape`. Its front points away from `bearing_rad`, so that slot 1 of a ring is at the rear.
    ///
    /// No two slots are nearer to each other than `spacing_m`, except in listed offsets.
    ///
    /// # Panics
    /// As [`Formation::new`], and if the number of listed offsets is not `count`.
    pub fn shaped(shape: Shape, count: u32, spacing_m: f64, bearing_rad: f64) -> Self {
        assert!(count >= 1 && spacing_m > 0.0, "no formation of {count} slots {spacing_m} m apart");
        // The shape's own axes, ahead and to the left.
        let ahead = direction(bearing_rad - PI);
        let turned = |place: Vector2<f64>| ahead * place.x + Vector2::new(-ahead.y, ahead.x) * place.y;
        let path: Vec<_> = shape.path(count, spacing_m).into_iter().map(turned).collect();
        assert!(!shape.is_path() || path.len() == count as usize, "{} places for {count} slots", path.len());
        Self { count, spacing_m, bearing_rad, shape, path }
    }

    /// n, the number of slots.
    pub fn count(&self) -> u32 {
        self.count
    }

    /// L, the distance between neighbouring slots in metres.
    pub fn spacing_m(&self) -> f64 {
        self.spacing_m
    }

    /// The shape.
    pub fn shape(&self) -> &Shape {
        &self.shape
    }

    /// R = L / (2 sin(pi / n)), the distance of each slot of a ring from the centre in metres (Section 2 of the paper).
    pub fn radius_m(&self) -> f64 {
        self.radius_of_m(self.count)
    }

    /// The distance of the farthest slot from the centre, metres.
    pub fn reach_m(&self) -> f64 {
        (1..=self.count).map(|number| self.place(number).radius_m()).fold(0.0, f64::max)
    }

    /// The largest distance between the slots of two ring neighbours, metres.
    pub fn widest_m(&self) -> f64 {
        let offset = |number: u32| self.place(number).offset();
        let apart_m = |number: u32| (offset(number % self.count + 1) - offset(number)).norm();
        (1..=self.count).map(apart_m).fold(0.0, f64::max)
    }

    /// The two slots that are nearest to each other, and their distance in metres; `None` for a single slot.
    pub fn closest(&self) -> Option<(u32, u32, f64)> {
        let offsets: Vec<_> = (1..=self.count).map(|number| self.place(number).offset()).collect();
        closest(&offsets)
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

    /// The place of slot `number`, counted from 1.
    pub fn place(&self, number: u32) -> Slot {
        if self.shape.is_path() {
            return self.along_path(number);
        }
        self.round_centre(
            number,
            CirclePlace { bearing_rad: self.bearing_rad(number), radius_m: self.radius_m() },
        )
    }

    /// Place `number` along the path, counted from 1.
    pub(crate) fn along_path(&self, number: u32) -> Slot {
        Slot::Plane(self.path[number as usize - 1])
    }

    /// Where slot `number` of a shape that goes round the centre is, if it is at `place` in the ring of that spacing.
    pub(crate) fn round_centre(&self, number: u32, place: CirclePlace) -> Slot {
        match self.shape {
            Shape::Ellipse { aspect } => {
                // Only stretched, never squeezed: the shorter half-axis stays R, so no two slots come nearer than L.
                let stretch = Stretch {
                    ahead_rad: self.bearing_rad - PI,
                    along: aspect.recip().max(1.0),
                    across: aspect.max(1.0),
                };
                Slot::Ellipse { place, stretch }
            }
            Shape::Star { .. } => {
                let reach = self.shape.reach(number, self.count);
                Slot::Circle(CirclePlace { radius_m: place.radius_m * reach, ..place })
            }
            _ => Slot::Circle(place),
        }
    }

    /// `p_id` of Section 2: the place of slot `number`, counted from 1, if the formation's centre is at `centre`.
    ///
    /// # Panics
    /// If `number` is not in 1 to n.
    pub fn slot(&self, number: u32, centre: Point2<f64>) -> Point2<f64> {
        assert!((1..=self.count).contains(&number), "no slot {number} in a formation of {}", self.count);
        centre + self.place(number).offset()
    }
}

/// The two of `places` that are nearest to each other, counted from 1, and their distance; `None` if there are not two.
pub fn closest(places: &[Vector2<f64>]) -> Option<(u32, u32, f64)> {
    let pairs = (1..).zip(places).flat_map(|(second, there)| {
        (1..)
            .zip(places)
            .take(second as usize - 1)
            .map(move |(first, here)| (first, second, (there - here).norm()))
    });
    pairs.min_by(|one, other| one.2.total_cmp(&other.2))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Rotation2;
    use proptest::prelude::*;

    fn ring(count: u32) -> (Formation, Vec<Point2<f64>>) {
        let formation = Formation::new(count, 40.0, PI);
        let centre = Point2::new(7.0, -3.0);
        let slots = (1..=count).map(|number| formation.slot(number, centre)).collect();
        (formation, slots)
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

    fn shaped(shape: Shape, count: u32) -> Formation {
        Formation::shaped(shape, count, 40.0, PI)
    }

    #[test]
    fn each_shape_is_where_its_drawing_has_it() {
        let offset = |formation: &Formation, number| formation.place(number).offset();
        let vee = shaped(Shape::Vee { sweep_rad: PI / 4.0 }, 5);
        // The tip is in front on the leader's line, the arms lead back to both sides.
        assert!(offset(&vee, 3).x > 0.0 && offset(&vee, 3).y.abs() < 1e-9);
        let arm = offset(&vee, 1) - offset(&vee, 3);
        assert!((arm - Vector2::new(-1.0, 1.0) * 80.0 / 2.0_f64.sqrt()).norm() < 1e-9, "{arm}");
        let line = shaped(Shape::Echelon { sweep_rad: 0.0 }, 3);
        assert!((offset(&line, 1) - Vector2::new(0.0, 40.0)).norm() < 1e-9);
        let grid = shaped(Shape::Grid { columns: 2 }, 4);
        assert!((offset(&grid, 1) - Vector2::new(20.0, 20.0)).norm() < 1e-9);
        assert!((offset(&grid, 3) - Vector2::new(-20.0, -20.0)).norm() < 1e-9);
        let ellipse = shaped(Shape::Ellipse { aspect: 0.5 }, 4);
        assert!(
            (offset(&ellipse, 1).norm() - 2.0 * offset(&ellipse, 2).norm()).abs() < 1e-9,
            "twice as long as wide"
        );
    }

    #[test]
    fn the_farthest_slot_and_the_widest_pair_of_ring_neighbours_tell_how_large_a_formation_is() {
        let size = |formation: Formation| (formation.reach_m(), formation.widest_m());
        let is = |found: (f64, f64), expected: (f64, f64)| {
            (found.0 - expected.0).abs() < 1e-9 && (found.1 - expected.1).abs() < 1e-9
        };
        assert!(is(size(shaped(Shape::Ring, 6)), (40.0, 40.0)));
        // The ends of a line are ring neighbours, too.
        assert!(is(size(shaped(Shape::Echelon { sweep_rad: 0.3 }, 5)), (80.0, 160.0)));
        let places = vec![Vector2::new(30.0, 0.0), Vector2::new(0.0, 40.0), Vector2::new(0.0, 0.0)];
        assert!(is(size(shaped(Shape::Offsets(places), 3)), (40.0, 50.0)));
    }

    #[test]
    fn a_formation_with_another_bearing_is_turned() {
        let shape = || Shape::Vee { sweep_rad: 0.5 };
        let (east, north) = (shaped(shape(), 6), Formation::shaped(shape(), 6, 40.0, -PI / 2.0));
        for number in 1..=6 {
            let turned = Rotation2::new(PI / 2.0) * east.place(number).offset();
            assert!((turned - north.place(number).offset()).norm() < 1e-9);
        }
    }

    proptest! {
        #[test]
        fn no_two_slots_of_a_shape_are_nearer_than_the_spacing(
            count in 3_u32..40, sweep in -1.0..1.0, aspect in 0.2..5.0, inner_ratio in 0.1..1.0, columns in 1_u32..8,
        ) {
            let shapes = [
                (Shape::Vee { sweep_rad: sweep }, 1.0),
                (Shape::Echelon { sweep_rad: sweep }, 1.0),
                (Shape::Grid { columns }, 1.0),
                (Shape::Star { inner_ratio }, 1.0),
                // Where the ellipse is flattest, its slots are farther apart than those of the ring.
                (Shape::Ellipse { aspect }, 5.0),
            ];
            for (shape, most) in shapes {
                let (one, other, apart_m) = shaped(shape.clone(), count).closest().expect("two slots");
                let is_right = (40.0 - 1e-6..=40.0 * most + 1e-6).contains(&apart_m);
                prop_assert!(is_right, "{shape:?}: slots {one} and {other} are {apart_m} m apart");
            }
        }
    }
}
