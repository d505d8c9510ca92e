//! The limit of the formation's force: a UAV heads for where it meets its slot, and waits for its slot where that is
//! sooner than flying back to it.
//!
//! Never changes where the force points. It knows neither the neighbours nor what the force consists of.

use nalgebra::Vector2;
use ringwing_scenario::Scenario;
use std::f64::consts::TAU;

/// The force that is left if the airframe is no faster than its slot, in m. Without it, a UAV would stop steering for a slot
/// that it cannot catch up with. More makes the UAV head for where the slot is now, and less for where it will be.
const LEAST_FORCE_M: f64 = 3.0;

/// The limit of one airframe.
#[derive(Debug, Clone, Copy)]
pub(super) struct ForceLimit {
    speed_min_m_s: f64,
    speed_max_m_s: f64,
    /// How long a full circle takes.
    circle_s: f64,
}

impl ForceLimit {
    /// The limit of the airframes of `scenario`.
    pub(super) fn new(scenario: &Scenario) -> Self {
        let airframe = &scenario.airframe;
        Self {
            speed_min_m_s: airframe.speed_min_m_s,
            speed_max_m_s: airframe.speed_max_m_s,
            circle_s: TAU / airframe.turn_rate_max_rad_s,
        }
    }

    /// `force`, the gradient of Eq. (3), of a UAV that is `slot_error_m` from its slot, cut to what is useful.
    ///
    /// Eq. (6) adds the slot's velocity to the force. A long force hides that velocity: the UAV then heads for where its slot is
    /// and not for where it will be, and turns round in front of a slot that would have come to it.
    pub(super) fn cut(
        &self,
        force: Vector2<f64>,
        slot_error_m: &Vector2<f64>,
        slot_velocity_m_s: &Vector2<f64>,
    ) -> Vector2<f64> {
        let slot_m_s = slot_velocity_m_s.norm();
        let longest_m = self.interception_m(&force, slot_velocity_m_s);
        // No longer than the slot's velocity, so that their sum points ahead or vanishes: the UAV flies slowly and waits.
        let waits = slot_error_m.dot(slot_velocity_m_s) <= self.waiting_m(slot_m_s) * slot_m_s;
        force.cap_magnitude(if waits { longest_m.min(slot_m_s) } else { longest_m })
    }

    /// The force with which slot velocity and force add up to the largest speed. The UAV then heads for where it meets its slot.
    fn interception_m(&self, force: &Vector2<f64>, slot_velocity_m_s: &Vector2<f64>) -> f64 {
        let norm = force.norm();
        if norm == 0.0 {
            return 0.0;
        }
        // The force is applied as -f_i. This is |v - x f / |f|| = v_max, solved for x.
        let away_m_s = force.dot(slot_velocity_m_s) / norm;
        let left = self.speed_max_m_s.powi(2) - slot_velocity_m_s.norm_squared() + away_m_s.powi(2);
        (away_m_s + left.max(0.0).sqrt()).max(LEAST_FORCE_M)
    }

    /// How far ahead of its slot a UAV waits for it, if the slot moves at `slot_m_s`.
    ///
    /// Waiting at `v_min` takes `d / (v - v_min)`. A full circle of T and catching up at `v_max` takes
    /// `T + (v T - d) / (v_max - v)`. This is where both take equally long.
    fn waiting_m(&self, slot_m_s: f64) -> f64 {
        let range_m_s = self.speed_max_m_s - self.speed_min_m_s;
        // An airframe of one speed can never wait.
        if range_m_s <= 0.0 {
            return 0.0;
        }
        self.circle_s * self.speed_max_m_s * (slot_m_s - self.speed_min_m_s) / range_m_s
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Of the paper's airframes: 12 to 25 m/s, 0.5 rad/s.
    fn limit() -> ForceLimit {
        ForceLimit::new(&Scenario::default())
    }

    /// What Eq. (6) makes of the cut slot term of a UAV at `error` from a slot that moves at `slot_m_s` along x.
    fn course(error: [f64; 2], slot_m_s: f64) -> Vector2<f64> {
        let (error, velocity) = (Vector2::from(error), Vector2::new(slot_m_s, 0.0));
        velocity - limit().cut(error, &error, &velocity)
    }

    #[test]
    fn a_uav_just_ahead_of_its_slot_waits_and_one_far_ahead_turns_back() {
        // 12.6 s of a circle, times 25 m/s, times 3 / 13 make 72.5 m.
        assert!(course([72.0, 0.0], 15.0).norm() < 1e-9);
        assert!((course([73.0, 0.0], 15.0) - Vector2::new(-25.0, 0.0)).norm() < 1e-9);
    }

    #[test]
    fn where_the_slot_is_no_faster_than_the_slowest_airframe_nobody_waits() {
        assert!((course([40.0, 0.0], 12.0) - Vector2::new(-25.0, 0.0)).norm() < 1e-9);
    }

    #[test]
    fn a_slot_that_cannot_be_caught_up_with_is_steered_for_all_the_same() {
        assert_eq!(course([0.0, 30.0], 25.0), Vector2::new(25.0, -LEAST_FORCE_M));
    }

    #[test]
    fn a_short_force_is_left_as_it_is() {
        assert_eq!(course([-2.0, 1.0], 15.0), Vector2::new(17.0, -1.0));
    }

    proptest! {
        #[test]
        fn a_uav_behind_or_beside_its_slot_heads_for_where_it_meets_it(x in -500.0..0.0, y in 20.0..500.0, speed in 12.0..22.0) {
            let course = course([x, y], speed);
            prop_assert!(course.norm() < 25.0 + 1e-9);
            // Seen from the slot, the UAV comes straight at it.
            let seen = course - Vector2::new(speed, 0.0);
            prop_assert!((seen.x * y - seen.y * x).abs() < 1e-6 && seen.dot(&Vector2::new(x, y)) < 0.0);
        }
    }
}
