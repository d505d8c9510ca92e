//! The arrow of the wind, the same in 3D, in figures and in the terminal.
//!
//! Never draws: whoever does connects the places.

use nalgebra::{Point2, Vector2};

/// Length of the arrow in spacings for each m/s. A longer arrow of a strong wind reaches into the formation; a shorter one of a light
/// wind hardly shows.
const SPACINGS_PER_M_S: f64 = 0.12;
/// How far from the leader the arrow stands, in reaches of the formation and as a direction: to the north-west. Nearer, it would hide
/// UAVs; farther away, it would leave the picture.
const BESIDE: Vector2<f64> = Vector2::new(-1.1, 1.1);
/// The sides of the head, along the arrow and across it, as shares of its length.
const HEAD: (f64, f64) = (0.25, 0.14);

/// The places to connect in a row: tail, tip, and both sides of the head, each from the tip. The arrow is that of a wind of
/// `wind_m_s`, beside a formation round `centre` whose slots are `spacing_m` apart and at most `reach_m` from it.
pub fn of_wind(
    wind_m_s: Vector2<f64>,
    centre: Point2<f64>,
    spacing_m: f64,
    reach_m: f64,
) -> [Point2<f64>; 5] {
    let way = wind_m_s * (SPACINGS_PER_M_S * spacing_m);
    let middle = centre + BESIDE * reach_m;
    let tip = middle + way / 2.0;
    let side = |across: f64| tip - way * HEAD.0 + Vector2::new(-way.y, way.x) * across;
    [middle - way / 2.0, tip, side(HEAD.1), tip, side(-HEAD.1)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_arrow_points_to_where_the_air_moves_and_grows_with_its_speed() {
        let [tail, tip, left, _, right] =
            of_wind(Vector2::new(0.0, -6.0), Point2::new(100.0, 0.0), 40.0, 20.0);
        assert!((tip - tail - Vector2::new(0.0, -6.0 * 4.8)).norm() < 1e-9);
        assert!((nalgebra::center(&tail, &tip) - Point2::new(78.0, 22.0)).norm() < 1e-9);
        // Both sides lie behind the tip, one to each side of the arrow.
        assert!(left.y > tip.y && left.x > tip.x && right.y > tip.y && right.x < tip.x);
    }
}
