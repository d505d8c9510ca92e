//! From force to control input, Eq. (5), (6), (11) and (12).
//!
//! Never knows which terms the force consists of.

use nalgebra::Vector2;
use ringwing_flight::direction;

/// The airframe's limits on the control inputs, Eq. (2).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    speed_min_m_s: f64,
    speed_max_m_s: f64,
    turn_rate_max_rad_s: f64,
}

/// Why limits are invalid.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum LimitsError {
    /// Eq. (2) requires `0 < v_min <= v_max`.
    #[error("speed limits {0} and {1} m/s: the lower must be above 0 and not above the upper")]
    Speed(f64, f64),
    /// Eq. (2) requires a turn rate above zero.
    #[error("turn rate limit {0} rad/s must be above 0")]
    TurnRate(f64),
}

impl Limits {
    /// `v_min`, `v_max` in m/s and `omega_max` in rad/s.
    pub fn new(
        speed_min_m_s: f64,
        speed_max_m_s: f64,
        turn_rate_max_rad_s: f64,
    ) -> Result<Self, LimitsError> {
        // Theorem 1 needs v_min > 0: it excludes the equilibrium in which a UAV heads against the leader at -v_d. The
        // checks state what is valid and are then negated: comparisons with NaN are false, so NaN is refused.
        let speeds_are_valid =
            speed_min_m_s > 0.0 && speed_min_m_s <= speed_max_m_s && speed_max_m_s.is_finite();
        if !speeds_are_valid {
            return Err(LimitsError::Speed(speed_min_m_s, speed_max_m_s));
        }
        if !(turn_rate_max_rad_s > 0.0 && turn_rate_max_rad_s.is_finite()) {
            return Err(LimitsError::TurnRate(turn_rate_max_rad_s));
        }
        Ok(Self { speed_min_m_s, speed_max_m_s, turn_rate_max_rad_s })
    }

    /// `v_min`, in m/s.
    pub fn speed_min_m_s(&self) -> f64 {
        self.speed_min_m_s
    }

    /// `v_max`, in m/s.
    pub fn speed_max_m_s(&self) -> f64 {
        self.speed_max_m_s
    }

    /// `omega_max`, in rad/s.
    pub fn turn_rate_max_rad_s(&self) -> f64 {
        self.turn_rate_max_rad_s
    }
}

/// The control inputs of Eq. (1).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ControlInput {
    /// `v_i`.
    pub speed_m_s: f64,
    /// `omega_i`.
    pub turn_rate_rad_s: f64,
}

/// `f_v` of Eq. (5): the leader's velocity as a force.
pub fn speed_force(leader_speed_m_s: f64, leader_heading_rad: f64) -> Vector2<f64> {
    direction(leader_heading_rad) * leader_speed_m_s
}

/// Eq. (6): the force along the heading is the speed, the force across it is the turn rate.
///
/// `force` is `-f_i + f_v`, plus `f_obs` near obstacles. The paper uses metres across the heading as rad/s. That
/// implies a factor, `heading_gain_rad_per_m`, which is 1 in the paper.
pub fn formation_control(
    force: &Vector2<f64>,
    heading_rad: f64,
    heading_gain_rad_per_m: f64,
) -> ControlInput {
    let along = direction(heading_rad);
    // To the left, so a force to the left turns the UAV counterclockwise, as Eq. (1) counts headings.
    let across = Vector2::new(-along.y, along.x);
    ControlInput { speed_m_s: along.dot(force), turn_rate_rad_s: heading_gain_rad_per_m * across.dot(force) }
}

/// `sat(x, a, b)` of Eq. (11), for `a <= b`.
pub fn saturate(x: f64, a: f64, b: f64) -> f64 {
    x.clamp(a, b)
}

/// Eq. (12): `input` within what the airframe can do.
pub fn saturated_control(input: &ControlInput, limits: &Limits) -> ControlInput {
    let Limits { speed_min_m_s, speed_max_m_s, turn_rate_max_rad_s } = *limits;
    ControlInput {
        speed_m_s: saturate(input.speed_m_s, speed_min_m_s, speed_max_m_s),
        turn_rate_rad_s: saturate(input.turn_rate_rad_s, -turn_rate_max_rad_s, turn_rate_max_rad_s),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::f64::consts::FRAC_PI_2;

    fn limits() -> Limits {
        Limits::new(12.0, 25.0, 0.5).unwrap()
    }

    #[test]
    fn a_uav_in_its_slot_flies_like_the_leader() {
        let control = formation_control(&speed_force(15.0, 0.4), 0.4, 1.0);
        assert!((control.speed_m_s - 15.0).abs() < 1e-12 && control.turn_rate_rad_s.abs() < 1e-12);
    }

    #[test]
    fn a_force_to_the_left_turns_left() {
        // Heading north, force west: the whole force is across, on the left.
        let control = formation_control(&Vector2::new(-3.0, 0.0), FRAC_PI_2, 0.5);
        assert!(control.speed_m_s.abs() < 1e-12 && (control.turn_rate_rad_s - 1.5).abs() < 1e-12);
    }

    #[test]
    fn limits_that_the_paper_excludes_are_refused() {
        assert_eq!(Limits::new(0.0, 25.0, 0.5), Err(LimitsError::Speed(0.0, 25.0)));
        assert_eq!(Limits::new(26.0, 25.0, 0.5), Err(LimitsError::Speed(26.0, 25.0)));
        assert!(Limits::new(12.0, f64::NAN, 0.5).is_err() && Limits::new(12.0, f64::INFINITY, 0.5).is_err());
        assert_eq!(Limits::new(12.0, 25.0, 0.0), Err(LimitsError::TurnRate(0.0)));
        assert!(Limits::new(12.0, 25.0, f64::NAN).is_err());
    }

    #[test]
    fn limits_are_told_as_they_were_set() {
        let limits = limits();
        let told = (limits.speed_min_m_s(), limits.speed_max_m_s(), limits.turn_rate_max_rad_s());
        assert_eq!(told, (12.0, 25.0, 0.5));
    }

    proptest! {
        #[test]
        fn saturation_leaves_what_fits_and_cuts_the_rest(x in -1e6..1e6, a in -100.0..0.0, b in 0.0..100.0) {
            let cut = saturate(x, a, b);
            prop_assert!((a..=b).contains(&cut));
            prop_assert!(cut == x || (x < a && cut == a) || (x > b && cut == b));
        }

        #[test]
        fn the_limits_hold_whatever_the_force(x in -1e9..1e9, y in -1e9..1e9, heading in -10.0..10.0) {
            let control = saturated_control(&formation_control(&Vector2::new(x, y), heading, 1.0), &limits());
            prop_assert!((12.0..=25.0).contains(&control.speed_m_s));
            prop_assert!((-0.5..=0.5).contains(&control.turn_rate_rad_s));
        }
    }
}
