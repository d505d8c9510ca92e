//! Circles as polygons, for everything that draws lines.
//!
//! Never decides where a circle goes or how it looks.

use nalgebra::{Point2, Vector2};
use std::f64::consts::TAU;

/// Corners of a drawn circle. With fewer, large circles look angular.
pub const CORNERS: u32 = 72;

/// The `corners` corners of a polygon on the circle of `radius_m` around `centre`: counterclockwise, the easternmost first.
pub fn polygon(centre: Point2<f64>, radius_m: f64, corners: u32) -> impl Iterator<Item = Point2<f64>> {
    (0..corners).map(move |number| {
        let bearing = TAU * f64::from(number) / f64::from(corners);
        centre + Vector2::new(libm::cos(bearing), libm::sin(bearing)) * radius_m
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_polygon_of_four_corners_goes_round_counterclockwise_from_the_east() {
        let corners: Vec<_> = polygon(Point2::new(5.0, 6.0), 2.0, 4).collect();
        let expected = [(7.0, 6.0), (5.0, 8.0), (3.0, 6.0), (5.0, 4.0)];
        assert_eq!(corners.len(), expected.len());
        for (corner, (x, y)) in corners.iter().zip(expected) {
            assert!((corner - Point2::new(x, y)).norm() < 1e-12, "{corner} is not at ({x}, {y})");
        }
    }
}
