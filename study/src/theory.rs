//! How much delay the linearised law stands.
//!
//! Small deviations from the standard formation, with everything measured along and across the leader's heading, obey
//! `det[diag(s, s (s + k v_d D_h) / (k v_d)) + K_own D_o - K_neighbours D_n] = 0`. Each D is 1 for data without delay,
//! `e^(-sT)` for held data, and `e^(-sT) (1 + sT)` for data predicted along a straight line. The smallest T at which a
//! root s leaves the left half plane is the delay margin.
//!
//! Never flies: limits, ticks, faults and everything else that is not linear is left to the flights.

use nalgebra::{Complex, DMatrix, DVector, Matrix2, Vector2};
use ringwing_scenario::Scenario;
use std::f64::consts::{PI, TAU};

/// What the linearised law depends on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Loop {
    /// n, at least 3.
    pub uavs: u32,
    /// L, in metres.
    pub spacing_m: f64,
    /// Bearing of the first slot from the centre, counterclockwise from the leader's heading.
    pub bearing_rad: f64,
    /// G of Eq. (3).
    pub formation_gain: f64,
    /// Gain of the slot's term; 1 in the paper.
    pub slot_gain: f64,
    /// From metres across the heading to turn rate; 1 in the paper.
    pub heading_gain_rad_per_m: f64,
    /// `v_d`.
    pub speed_m_s: f64,
}

impl Loop {
    /// The loop of the plain law with the formation, gains and leader of `scenario`; `None` below 3 UAVs.
    pub fn of(scenario: &Scenario) -> Option<Self> {
        let Scenario { formation, control, leader, .. } = scenario;
        (formation.uavs >= 3).then(|| Self {
            uavs: formation.uavs,
            spacing_m: formation.spacing_m,
            bearing_rad: (formation.bearing_deg - leader.heading_deg).to_radians(),
            formation_gain: control.formation_gain,
            slot_gain: control.slot_gain,
            heading_gain_rad_per_m: control.heading_gain_rad_per_m,
            speed_m_s: leader.speed_m_s,
        })
    }
}

/// The data that arrive late.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Late {
    /// The neighbours' positions, used as they are.
    NeighboursHeld,
    /// The neighbours' positions, predicted straight on to now.
    NeighboursReckoned,
    /// The UAV's own position and heading, used as they are.
    OwnState,
    /// Only the UAV's own heading.
    OwnHeading,
}

/// The stiffness of the formation: how the force on each UAV changes with its own and its neighbours' positions.
struct Stiffness {
    own: DMatrix<f64>,
    neighbours: DMatrix<f64>,
}

/// Delays that are tried between 0 and the largest. More find a shorter window of instability and take longer.
const DELAYS: u32 = 48;
/// Bisections of the delay after that: the margin is then known to a 50,000th of the largest delay.
const BISECTIONS: u32 = 10;
/// Largest turn of the determinant between two frequencies. Above pi, turns are miscounted; less takes longer.
const TURN_MAX_RAD: f64 = 0.8;

impl Loop {
    /// The smallest delay, in seconds, at which the formation is unstable; `None` if it is stable up to `longest_s`.
    pub fn margin_s(&self, late: Late, longest_s: f64) -> Option<f64> {
        let step_s = longest_s / f64::from(DELAYS);
        let first = (1..=DELAYS).find(|k| !self.is_stable(late, f64::from(*k) * step_s))?;
        let (mut stable_s, mut unstable_s) = (f64::from(first - 1) * step_s, f64::from(first) * step_s);
        for _ in 0..BISECTIONS {
            let middle_s = 0.5 * (stable_s + unstable_s);
            if self.is_stable(late, middle_s) { stable_s = middle_s } else { unstable_s = middle_s }
        }
        Some(0.5 * (stable_s + unstable_s))
    }

    /// Whether all roots are in the left half plane with a delay of `delay_s`, which is above 0.
    ///
    /// A delay that moves the formation to where no rest is found counts as unstable.
    pub fn is_stable(&self, late: Late, delay_s: f64) -> bool {
        let Some(stiffness) = self.stiffness_at_rest(late, delay_s) else { return false };
        // Predictions make the loop neutral: above this bound, there are unstable roots of any frequency.
        if late == Late::NeighboursReckoned && delay_s * self.along_radius(&stiffness.neighbours) >= 1.0 {
            return false;
        }
        self.unstable_roots(&stiffness, late, delay_s) == 0
    }

    /// Spectral radius of the neighbours' stiffness along the heading, in 1/s.
    fn along_radius(&self, neighbours: &DMatrix<f64>) -> f64 {
        let count = self.uavs as usize;
        let along = DMatrix::from_fn(count, count, |i, j| neighbours[(2 * i, 2 * j)]);
        along.complex_eigenvalues().iter().map(|value| value.norm()).fold(0.0, f64::max)
    }

    /// Roots in the right half plane: the turns of the determinant along the imaginary axis (argument principle).
    fn unstable_roots(&self, stiffness: &Stiffness, late: Late, delay_s: f64) -> i64 {
        // No root is faster than a few times the stiffest term. At whole turns of e^(-sT), the determinant of a neutral
        // loop is real and positive, as that of the others is nearly.
        let fastest = 40.0 * (stiffness.own.norm() + self.speed_m_s * self.heading_gain_rad_per_m);
        let end = (fastest * delay_s / TAU).ceil() * TAU / delay_s;
        let (mut frequency, mut turned_rad) = (0.0, 0.0);
        let mut last = self.determinant(stiffness, late, delay_s, 0.0);
        let widest = |frequency: f64| (0.05 + 0.2 * frequency).min(0.25 / delay_s);
        let mut step = widest(0.0);
        while frequency < end {
            let next_frequency = (frequency + step).min(end);
            let next = self.determinant(stiffness, late, delay_s, next_frequency);
            let turn_rad = (next / last).arg();
            if turn_rad.abs() > TURN_MAX_RAD && step > 1e-6 * end {
                step *= 0.5;
                continue;
            }
            (frequency, last, turned_rad) = (next_frequency, next, turned_rad + turn_rad);
            if turn_rad.abs() < 0.3 * TURN_MAX_RAD {
                step = (1.5 * step).min(widest(frequency));
            }
        }
        // The other half of the axis mirrors this one.
        (-turned_rad / PI).round() as i64
    }

    /// The characteristic determinant at `s = i frequency`, each row divided by stable factors of the same degree so that
    /// it tends to 1 and turns only with its unstable roots.
    fn determinant(&self, stiffness: &Stiffness, late: Late, delay_s: f64, frequency: f64) -> Complex<f64> {
        let s = Complex::new(0.0, frequency);
        let held = (-s * delay_s).exp();
        let now = Complex::new(1.0, 0.0);
        let (of_own, of_heading, of_neighbours) = match late {
            Late::NeighboursHeld => (now, now, held),
            Late::NeighboursReckoned => (now, now, held * (now + s * delay_s)),
            Late::OwnState => (held, held, now),
            Late::OwnHeading => (now, held, now),
        };
        let turning = self.heading_gain_rad_per_m * self.speed_m_s;
        let across = s * (s + of_heading * turning) / turning;
        let (pole, size) = (s + 1.0, 2 * self.uavs as usize);
        DMatrix::from_fn(size, size, |row, column| {
            let (inertia, degree) = if row % 2 == 0 { (s, pole) } else { (across, pole * pole / turning) };
            let diagonal = if row == column { inertia } else { Complex::new(0.0, 0.0) };
            let (own, neighbours) = (stiffness.own[(row, column)], stiffness.neighbours[(row, column)]);
            (diagonal + of_own * own - of_neighbours * neighbours) / degree
        })
        .determinant()
    }

    /// The stiffness where the formation rests: held data shift it. `None` if Newton's method finds no rest.
    fn stiffness_at_rest(&self, late: Late, delay_s: f64) -> Option<Stiffness> {
        let behind = Vector2::new(self.speed_m_s * delay_s, 0.0);
        let (own_behind, neighbours_behind) = match late {
            Late::NeighboursHeld => (Vector2::zeros(), behind),
            Late::OwnState => (behind, Vector2::zeros()),
            Late::NeighboursReckoned | Late::OwnHeading => (Vector2::zeros(), Vector2::zeros()),
        };
        let mut places: Vec<_> = (0..self.uavs).map(|uav| self.slot(uav) + own_behind).collect();
        for _ in 0..50 {
            let (force, stiffness) = self.forces(&places, &own_behind, &neighbours_behind);
            if force.amax() < 1e-9 {
                return Some(stiffness);
            }
            let step = (&stiffness.own - &stiffness.neighbours).lu().solve(&force)?;
            for (uav, place) in places.iter_mut().enumerate() {
                *place -= step.fixed_rows::<2>(2 * uav);
            }
        }
        None
    }

    /// `f_i` of Eq. (4) of all UAVs, and its derivatives.
    fn forces(
        &self,
        places: &[Vector2<f64>],
        own_behind: &Vector2<f64>,
        neighbours_behind: &Vector2<f64>,
    ) -> (DVector<f64>, Stiffness) {
        let count = places.len();
        let mut force = DVector::zeros(2 * count);
        let mut stiffness = Stiffness {
            own: DMatrix::zeros(2 * count, 2 * count),
            neighbours: DMatrix::zeros(2 * count, 2 * count),
        };
        for (uav, place) in places.iter().enumerate() {
            let own = place - own_behind;
            let (mut pull, mut of_own) = self.bond(&own, self.radius_m());
            pull += self.slot_gain * (own - self.slot(uav as u32));
            of_own += Matrix2::identity() * self.slot_gain;
            for other in [(uav + 1) % count, (uav + count - 1) % count] {
                let (bond, derivative) =
                    self.bond(&(own - (places[other] - neighbours_behind)), self.spacing_m);
                pull += bond;
                of_own += derivative;
                stiffness.neighbours.fixed_view_mut::<2, 2>(2 * uav, 2 * other).copy_from(&derivative);
            }
            force.fixed_rows_mut::<2>(2 * uav).copy_from(&pull);
            stiffness.own.fixed_view_mut::<2, 2>(2 * uav, 2 * uav).copy_from(&of_own);
        }
        (force, stiffness)
    }

    /// The force of a bond stretched to `apart`, and its derivative.
    fn bond(&self, apart: &Vector2<f64>, rest_m: f64) -> (Vector2<f64>, Matrix2<f64>) {
        let distance_m = apart.norm();
        let along = apart / distance_m;
        let slack = 1.0 - rest_m / distance_m;
        let outer = along * along.transpose();
        let derivative = outer + (Matrix2::identity() - outer) * slack;
        (apart * (self.formation_gain * slack), derivative * self.formation_gain)
    }

    fn radius_m(&self) -> f64 {
        0.5 * self.spacing_m / (PI / f64::from(self.uavs)).sin()
    }

    /// Slots go clockwise from the first.
    fn slot(&self, uav: u32) -> Vector2<f64> {
        let bearing_rad = self.bearing_rad - TAU * f64::from(uav) / f64::from(self.uavs);
        Vector2::new(bearing_rad.cos(), bearing_rad.sin()) * self.radius_m()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn paper(uavs: u32) -> Loop {
        Loop {
            uavs,
            spacing_m: 40.0,
            bearing_rad: PI,
            formation_gain: 2.0,
            slot_gain: 1.0,
            heading_gain_rad_per_m: 1.0,
            speed_m_s: 15.0,
        }
    }

    /// Checks that the loop is stable just below `margin_s` and unstable just above it.
    fn assert_margin(uavs: u32, late: Late, margin_s: f64, tolerance_s: f64) {
        let paper = paper(uavs);
        assert!(paper.is_stable(late, margin_s - tolerance_s), "n = {uavs}, {late:?}: unstable below");
        assert!(!paper.is_stable(late, margin_s + tolerance_s), "n = {uavs}, {late:?}: stable above");
    }

    // The values of an independent prototype; the tolerances are what its rounding leaves open.
    #[test]
    fn margins_of_neighbours_data_are_those_of_an_independent_prototype() {
        for (uavs, held_s, reckoned_s, tolerance_s) in
            [(3, 1.2, 0.4, 0.05), (6, 1.1, 0.36, 0.005), (8, 1.4, 0.3, 0.05), (12, 1.0, 0.3, 0.05)]
        {
            assert_margin(uavs, Late::NeighboursHeld, held_s, 0.05);
            assert_margin(uavs, Late::NeighboursReckoned, reckoned_s, tolerance_s);
        }
    }

    #[test]
    fn margins_of_own_data_are_those_of_an_independent_prototype() {
        for (uavs, state_s, heading_s) in
            [(3, 0.0745, 0.0784), (6, 0.078, 0.0799), (8, 0.0763, 0.0787), (12, 0.0743, 0.0772)]
        {
            assert_margin(uavs, Late::OwnState, state_s, 1.5e-4);
            assert_margin(uavs, Late::OwnHeading, heading_s, 1.5e-4);
        }
    }

    #[test]
    fn the_margin_is_found_between_the_tried_delays() {
        let margin_s = paper(3).margin_s(Late::OwnHeading, 0.2).unwrap();
        assert!((margin_s - 0.0784).abs() < 1.5e-4, "{margin_s}");
        assert_eq!(paper(3).margin_s(Late::OwnHeading, 0.05), None);
    }
}
