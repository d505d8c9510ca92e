//! The virtual repulsion of obstacles, Eq. (13).
//!
//! Never sees the world's obstacle list: an agent avoids only what its sensors report.

use super::{displacement, polar};
use nalgebra::{Point2, Vector2};

/// Eq. (13) is singular at the obstacle's edge, and inside it the sign would flip and attract. A UAV nearer to the
/// edge than this, or inside, is repelled as at this distance. Smaller gives a stronger push there.
const NEAREST_M: f64 = 0.01;

/// A circular obstacle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RepulsiveObstacle {
    /// `p_obs`.
    pub centre: Point2<f64>,
    /// `R_obs`.
    pub radius_m: f64,
    /// `L_obs`, the braking distance, measured from the centre.
    pub braking_distance_m: f64,
}

/// `f_obs` of Eq. (13), in m, with k = `gain_m`.
///
/// Zero at the centre, where no direction leads out.
pub fn repulsion(gain_m: f64, obstacle: &RepulsiveObstacle, own: &Point2<f64>) -> Vector2<f64> {
    let Some((distance_m, outward)) = polar(&displacement(&obstacle.centre, own)) else {
        return Vector2::zeros();
    };
    // Beyond L_obs the formula of Eq. (13) would change its sign and attract.
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

    const OBSTACLE: RepulsiveObstacle =
        RepulsiveObstacle { centre: Point2::new(580.0, -6.0), radius_m: 20.0, braking_distance_m: 50.0 };

    fn at(distance_m: f64) -> Vector2<f64> {
        repulsion(100.0, &OBSTACLE, &(OBSTACLE.centre + Vector2::new(0.0, distance_m)))
    }

    #[test]
    fn equation_13_by_hand() {
        // 100 (50 - 35) / (35 - 20) = 100, to the north.
        assert!((at(35.0) - Vector2::new(0.0, 100.0)).norm() < 1e-9);
        assert_eq!(at(50.0), Vector2::zeros());
        assert_eq!(at(50.1), Vector2::zeros());
    }

    #[test]
    fn a_uav_inside_an_obstacle_is_pushed_out() {
        for distance_m in [20.0, 19.0, 5.0, 1e-3] {
            assert!(at(distance_m).y > 1e5, "{distance_m}");
        }
        assert_eq!(at(0.0), Vector2::zeros());
    }

    proptest! {
        #[test]
        fn the_repulsion_never_weakens_towards_the_obstacle(a in 0.001..60.0, b in 0.001..60.0) {
            let (near, far) = if a < b { (a, b) } else { (b, a) };
            prop_assert!(at(near).norm() >= at(far).norm() - 1e-9);
        }
    }
}
