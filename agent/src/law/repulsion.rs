//! The virtual repulsion of obstacles, Eq. (13).
//!
//! Never sees the world's obstacle list: an agent avoids only what it was told it can sense.

use super::{displacement, polar};
use nalgebra::{Point2, Vector2};

/// At the edge Eq. (13) is singular, and inside it would attract: nearer than this to the edge, and inside, the
/// repulsion is that at this distance, outward.
const NEAREST_M: f64 = 0.01;

/// A circle to keep out of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Obstacle {
    /// `p_obs`.
    pub centre: Point2<f64>,
    /// `R_obs`.
    pub radius_m: f64,
    /// `L_obs`, the braking distance, measured from the centre.
    pub braking_distance_m: f64,
}

/// `f_obs` of Eq. (13), in m, with k = `gain_m`.
///
/// Zero at the very centre, where no direction leads out.
pub fn repulsion(gain_m: f64, obstacle: &Obstacle, own: &Point2<f64>) -> Vector2<f64> {
    let Some((distance_m, outward)) = polar(&displacement(&obstacle.centre, own)) else {
        return Vector2::zeros();
    };
    if distance_m > obstacle.braking_distance_m {
        return Vector2::zeros();
    }
    let to_edge_m = (distance_m - obstacle.radius_m).max(NEAREST_M);
    outward * (gain_m * (obstacle.braking_distance_m - distance_m) / to_edge_m)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const OBSTACLE: Obstacle =
        Obstacle { centre: Point2::new(580.0, -6.0), radius_m: 20.0, braking_distance_m: 50.0 };

    fn at(distance_m: f64) -> Vector2<f64> {
        repulsion(100.0, &OBSTACLE, &(OBSTACLE.centre + Vector2::new(0.0, distance_m)))
    }

    #[test]
    fn equation_13_by_hand() {
        // 100 (50 - 35) / (35 - 20) = 100, northward.
        assert!((at(35.0) - Vector2::new(0.0, 100.0)).norm() < 1e-9);
        assert_eq!(at(50.0), Vector2::zeros());
        assert_eq!(at(50.1), Vector2::zeros());
    }

    #[test]
    fn inside_an_obstacle_the_way_leads_out() {
        for distance_m in [20.0, 19.0, 5.0, 1e-3] {
            assert!(at(distance_m).y > 1e5, "{distance_m}");
        }
        assert_eq!(at(0.0), Vector2::zeros());
    }

    proptest! {
        #[test]
        fn nearer_is_never_weaker(a in 0.001..60.0, b in 0.001..60.0) {
            let (near, far) = if a < b { (a, b) } else { (b, a) };
            prop_assert!(at(near).norm() >= at(far).norm() - 1e-9);
        }
    }
}
