//! Whether a delayed loop is stable, by the argument principle: Nyquist's criterion for a matrix.
//!
//! With `P(s) = diag(s + c, s (s + k v_d) / (k v_d) + c)`, which has no root on the right, `L = P^-1 M` has as many roots on
//! the right as the characteristic matrix M. They are counted by how often det L(jw) goes round zero. Never finds the
//! roots themselves.

use super::{Late, Linearised, stiffness::Stiffness};
use nalgebra::{Complex, DMatrix, Schur};
use std::f64::consts::TAU;

/// Where L - 1 has a smaller spectral radius than this, det L cannot go round zero any more. Less ends the count at a higher
/// frequency, and never for dead reckoning near its bound.
const SETTLED: f64 = 0.999;
/// Largest change of L in a step, as the norm of the ratio less 1, times the root of its size. Up to about 2.7 no whole turn
/// can hide; less takes more steps.
const CHANGE: f64 = 2.0;
/// First step of the angular frequency, in rad/s. Steps grow while L changes little.
const STEP: f64 = 0.01;
/// Least step. A root this close to the imaginary axis, in 1/s, counts as on it.
const STEP_MIN: f64 = 1e-7;
/// A frequency that no loop of a scenario reaches, in rad/s; ends a count that would not end.
const FASTEST: f64 = 1e5;

/// Whether all roots of the characteristic equation are on the left.
pub(super) fn is_stable(swarm: &Linearised, stiffness: &Stiffness, late: Late, delay_s: f64) -> bool {
    let size = stiffness.own.nrows();
    let shift = stiffness.own.trace() / size as f64;
    let characteristic = Loop { swarm, stiffness, late, delay_s, shift };
    characteristic.turns().is_some_and(|turns| turns.abs() < 0.5)
}

/// The loop whose roots are counted.
struct Loop<'a> {
    swarm: &'a Linearised,
    stiffness: &'a Stiffness,
    late: Late,
    delay_s: f64,
    /// c of P: any positive number counts the same roots; near the own stiffness, L is small early.
    shift: f64,
}

impl Loop<'_> {
    /// How often det L(jw) goes round zero from w = 0 upwards, half of the number of roots on the right; `None` if it goes
    /// through zero.
    fn turns(&self) -> Option<f64> {
        let mut before = self.normalised(0.0);
        // L(0) is real. If its determinant is not positive, an odd number of roots is on the right, or one at zero.
        if before.determinant().re <= 0.0 {
            return None;
        }
        // At most a tenth of a turn of the delayed factor per step, so that the count misses none of its turns.
        let (end, fastest_step) = (self.settles_at(), 0.1 * TAU / self.delay_s.max(self.swarm.tick_s));
        let (mut frequency, mut step, mut angle) = (0.0, STEP, 0.0);
        while frequency < end {
            let next = self.normalised(frequency + step);
            let ratio = before.clone().lu().solve(&next)?;
            let change = (&ratio - DMatrix::identity(ratio.nrows(), ratio.nrows())).norm();
            // All eigenvalues of the ratio are near 1, so that the angles of any number of roots side by side add up to
            // less than half a turn. The determinant alone could hide whole turns.
            if change > CHANGE / (ratio.nrows() as f64).sqrt() {
                step /= 2.0;
                if step < STEP_MIN {
                    return None;
                }
                continue;
            }
            (frequency, before, angle) = (frequency + step, next, angle + ratio.determinant().arg());
            step = (step * 1.5).min(fastest_step).min(0.05 + frequency / 10.0);
        }
        // From here on every eigenvalue of L stays on the right of zero and ends at a real number, or swings about it.
        Some((angle - self.angle_left(frequency)) / TAU)
    }

    /// The sum of the angles of L's eigenvalues.
    fn angle_left(&self, frequency: f64) -> f64 {
        let (_, triangle) = Schur::new(self.normalised(frequency)).unpack();
        triangle.diagonal().iter().map(|value| value.arg()).sum()
    }

    /// The frequency from which on det L cannot go round zero, because the bound stays below [`SETTLED`].
    fn settles_at(&self) -> f64 {
        let mut frequency = 1.0;
        while self.bound(frequency) > SETTLED && frequency < FASTEST {
            frequency *= 2.0;
        }
        frequency
    }

    /// An upper bound of the spectral radius of L - 1 at this and all higher frequencies.
    ///
    /// `P^-1 K` has the eigenvalues of `P^-1/2 K P^-1/2`, and |P(jw)| is at least w, across the heading also at least
    /// `w^2 / (k v_d) - c`. So the bound falls with the frequency.
    fn bound(&self, frequency: f64) -> f64 {
        let gain = self.heading_gain();
        let across = frequency.max(frequency * frequency / gain - self.shift);
        let weight = |place: usize| if place.is_multiple_of(2) { 1.0 / frequency } else { 1.0 / across };
        let norm = |matrix: &DMatrix<f64>| {
            let weighted = |row, column| matrix[(row, column)] * (weight(row) * weight(column)).sqrt();
            DMatrix::from_fn(matrix.nrows(), matrix.ncols(), weighted).singular_values().max()
        };
        let unit = DMatrix::identity(self.stiffness.own.nrows(), self.stiffness.own.nrows()) * self.shift;
        // With a factor of modulus 1 or less before the own stiffness, nothing of it cancels c.
        let is_own_late = self.late == Late::OwnState || self.swarm.tick_s > 0.0;
        let own = if is_own_late {
            norm(&self.stiffness.own) + norm(&unit)
        } else {
            norm(&(&self.stiffness.own - unit))
        };
        let reckoned = if self.late == Late::NeighboursReckoned { frequency * self.delay_s } else { 0.0 };
        let neighbours = norm(&self.stiffness.neighbours) * 1.0_f64.hypot(reckoned);
        // The heading's own loop differs by s (D_h - 1).
        let heading =
            if is_own_late || self.late == Late::OwnHeading { 2.0 * frequency / across } else { 0.0 };
        own + neighbours + heading
    }

    fn heading_gain(&self) -> f64 {
        self.swarm.heading_gain_rad_per_m * self.swarm.speed_m_s
    }

    /// L at s = jw.
    fn normalised(&self, frequency: f64) -> DMatrix<Complex<f64>> {
        let s = Complex::new(0.0, frequency);
        let late = (-s * self.delay_s).exp();
        let hold = held(s * self.swarm.tick_s);
        let one = Complex::new(1.0, 0.0);
        let (own, heading, neighbours) = match self.late {
            Late::NeighboursHeld => (one, one, late),
            Late::NeighboursReckoned => (one, one, late * (one + s * self.delay_s)),
            Late::OwnState => (late, late, late),
            Late::OwnHeading => (one, late, one),
        };
        let gain = self.heading_gain();
        let (along, across) = (s, s * (s + heading * hold * gain) / gain);
        let normal = [s + self.shift, s * (s + gain) / gain + self.shift];
        DMatrix::from_fn(self.stiffness.own.nrows(), self.stiffness.own.nrows(), |row, column| {
            let forces = own * self.stiffness.own[(row, column)]
                - neighbours * self.stiffness.neighbours[(row, column)];
            let inertia = match (row == column, row % 2) {
                (false, _) => Complex::new(0.0, 0.0),
                (true, 0) => along,
                (true, _) => across,
            };
            (inertia + forces * hold) / normal[row % 2]
        })
    }
}

/// `(1 - e^-x) / x`: what holding a command for a tick does to it, with x = s times the tick.
fn held(x: Complex<f64>) -> Complex<f64> {
    // Below this, the formula loses more digits than the series.
    if x.norm() < 1e-4 { Complex::new(1.0, 0.0) - x / 2.0 } else { (Complex::new(1.0, 0.0) - (-x).exp()) / x }
}
