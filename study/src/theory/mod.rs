//! Delay margins of the linearised law: how late data may be before the standard formation becomes unstable.
//!
//! A margin is the smallest delay T at which a root of the characteristic equation
//! `det[diag(s, s (s + k v_d D_h) / (k v_d)) + K_self D_s - K_nb D_n] = 0` reaches the imaginary axis, with k the heading
//! gain and `D = e^(-sT)` for data that are late. A late own state makes all three late. `stiffness` has K, `nyquist` counts the
//! roots.
//!
//! Never flies, and never calls the agents' law: its equations are written down here a second time, so that flights and
//! theory judge each other. Holds for small deviations only: a large one meets the limits of Eq. (2) first.

mod nyquist;
mod stiffness;

use nyquist::is_stable;
use ringwing_flight::FormationFrame;
use ringwing_scenario::{DeadReckoning, Scenario};
use stiffness::{Stiffness, rest};

/// Longest delay that is looked at, in seconds. A longer one makes swarms without a margin take longer to compute; a shorter
/// one hides margins of slow swarms.
const LONGEST_S: f64 = 20.0;
/// Step of the delay while a margin is looked for, as a share of the delay. A larger one could step over a short range of
/// unstable delays; a smaller one takes longer.
const STEP: f64 = 0.15;
/// The first delay that is looked at, in seconds. A longer one could step over unstable delays; a shorter one takes longer.
const SHORTEST_S: f64 = 1e-2;
/// A margin is exact to this share of it. Less takes longer.
const PRECISION: f64 = 1e-4;
/// Largest share of the bound of dead reckoning that is looked at. Closer to 1, the number of frequencies to look at grows
/// without limit.
const BELOW_BOUND: f64 = 0.995;

/// Which data are late.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Late {
    /// Positions of neighbours, used as they are: the delay also moves the formation's rest.
    NeighboursHeld,
    /// Positions of neighbours, predicted straight on by their age.
    NeighboursReckoned,
    /// A UAV's own position and heading, used as they are. The state that it sends to its neighbours is as late, because a UAV
    /// sends where it believes that it is. The delay also moves the formation's rest.
    OwnState,
    /// A UAV's own heading alone.
    OwnHeading,
}

impl Late {
    /// All of them, in the order of tables.
    pub const ALL: [Self; 4] =
        [Self::NeighboursHeld, Self::NeighboursReckoned, Self::OwnState, Self::OwnHeading];

    /// Its name in tables and JSON.
    pub fn name(self) -> &'static str {
        match self {
            Self::NeighboursHeld => "neighbours held",
            Self::NeighboursReckoned => "neighbours dead reckoned",
            Self::OwnState => "own state late",
            Self::OwnHeading => "own heading late",
        }
    }
}

/// A swarm near its standard formation, as far as its delay margins depend on it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Linearised {
    /// n, at least 3.
    pub uavs: u32,
    /// L, in metres.
    pub spacing_m: f64,
    /// alpha, the bearing of UAV 1's slot relative to the leader's heading, in radians.
    pub bearing_rad: f64,
    /// G of Eq. (3).
    pub formation_gain: f64,
    /// Gain of the slot's term of Eq. (3).
    pub slot_gain: f64,
    /// k: turn rate for each metre of force across the heading, Eq. (6).
    pub heading_gain_rad_per_m: f64,
    /// `v_d`.
    pub speed_m_s: f64,
    /// Time constant with which a neighbour's gain fades with the age of its data, if it does.
    pub trust_time_s: Option<f64>,
    /// Distance from the slot over which G fades, if it does.
    pub reach_m: Option<f64>,
    /// How long a command is held. On average it is half of that late; 0 is the law in continuous time.
    pub tick_s: f64,
}

impl Linearised {
    /// The swarm of `scenario`, all UAVs alive.
    pub fn of(scenario: &Scenario) -> Self {
        let (control, formation) = (&scenario.control, &scenario.formation);
        let reach_m = control.gain_reach_spacings * formation.spacing_m;
        let bearing_deg = match formation.frame {
            FormationFrame::Fixed => formation.bearing_deg - scenario.leader.heading_deg,
            FormationFrame::Leader => formation.bearing_deg,
        };
        Self {
            uavs: formation.uavs,
            spacing_m: formation.spacing_m,
            bearing_rad: bearing_deg.to_radians(),
            formation_gain: control.formation_gain,
            slot_gain: control.slot_gain,
            heading_gain_rad_per_m: control.heading_gain_rad_per_m,
            speed_m_s: scenario.leader.speed_m_s,
            trust_time_s: control.trust_fades.then_some(control.trust_time_s),
            reach_m: control.gain_fades.then_some(reach_m),
            tick_s: scenario.period_s(),
        }
    }

    /// The delay in seconds at which the formation becomes unstable if the data of `late` have it; `None` if no delay up to
    /// 20 s does that.
    pub fn margin_s(&self, late: Late) -> Option<f64> {
        let longest_s =
            self.bound_s(late).map_or(LONGEST_S, |bound_s| (bound_s * BELOW_BOUND).min(LONGEST_S));
        let mut rest = Vec::new();
        let (mut stable_s, mut delay_s) = (0.0, SHORTEST_S);
        // From short to long: a longer delay may be stable again, and a margin is the first one that is not.
        while stable_s < longest_s {
            delay_s = longest_s.min(delay_s);
            match self.rest_if_stable(late, delay_s, &rest) {
                Some(found) => (stable_s, rest) = (delay_s, found),
                None => return Some(self.refine(late, stable_s, delay_s, &rest)),
            }
            delay_s *= 1.0 + STEP;
        }
        // Beyond the bound, a prediction amplifies errors at every frequency above some.
        self.bound_s(late).filter(|bound_s| *bound_s <= LONGEST_S)
    }

    /// The delay beyond which dead reckoning cannot be stable, whatever the other gains: `1 / rho` of the neighbours'
    /// stiffness along the leader's heading, because the loop is neutral. `None` if there is no such bound.
    pub fn bound_s(&self, late: Late) -> Option<f64> {
        if late != Late::NeighboursReckoned {
            return None;
        }
        // The standard formation stays the rest. With a gain that fades with the age, there may be no bound.
        let rest = vec![0.0; 2 * self.uavs as usize];
        let amplifies =
            |delay_s: f64| Stiffness::new(self, late, delay_s, &rest).radius_along() * delay_s >= 1.0;
        let mut steps =
            (1..).map(|step| SHORTEST_S * (1.0 + STEP).powi(step)).take_while(|delay_s| *delay_s < LONGEST_S);
        let above_s = steps.find(|delay_s| amplifies(*delay_s))?;
        Some(bisect(above_s / (1.0 + STEP), above_s, |delay_s| !amplifies(delay_s)))
    }

    fn refine(&self, late: Late, stable_s: f64, unstable_s: f64, rest: &[f64]) -> f64 {
        bisect(stable_s, unstable_s, |delay_s| self.rest_if_stable(late, delay_s, rest).is_some())
    }

    /// The swarm's rest at this delay, if it has a stable one; the search for it begins at `near`.
    fn rest_if_stable(&self, late: Late, delay_s: f64, near: &[f64]) -> Option<Vec<f64>> {
        let rest = rest(self, late, delay_s, near)?;
        let stiffness = Stiffness::new(self, late, delay_s, &rest);
        is_stable(self, &stiffness, late, delay_s).then_some(rest)
    }
}

/// Which data the delay of a fault makes late in `scenario`, and by how much more than the fault says, in seconds.
///
/// `None` if a delay of these data has no margin in theory: a UAV predicts its own state exactly from what it has
/// commanded, and the leader stands outside the loop.
pub fn late_data(scenario: &Scenario, is_own: bool) -> Option<(Late, f64)> {
    match (is_own, scenario.control.dead_reckoning) {
        (true, DeadReckoning::Full) => None,
        (true, _) => Some((Late::OwnState, 0.0)),
        // Every exchange takes a tick. Only without any prediction does it add to the delay.
        (false, DeadReckoning::Off) => Some((Late::NeighboursHeld, scenario.period_s())),
        (false, DeadReckoning::Tick) => Some((Late::NeighboursHeld, 0.0)),
        (false, DeadReckoning::Full) => Some((Late::NeighboursReckoned, 0.0)),
    }
}

/// The border between `holds` at `low` and not at `high`, to [`PRECISION`].
fn bisect(mut low: f64, mut high: f64, holds: impl Fn(f64) -> bool) -> f64 {
    while high - low > PRECISION * high {
        let middle = f64::midpoint(low, high);
        if holds(middle) { low = middle } else { high = middle }
    }
    f64::midpoint(low, high)
}

#[cfg(test)]
mod tests;
