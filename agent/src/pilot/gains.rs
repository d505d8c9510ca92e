//! The gains of the law, and how the resilient law weakens them.
//!
//! Never keeps state: the same distance and the same age give the same gain.

use super::{force_limit::ForceLimit, track::PeerTrack};
use crate::law::Bond;
use nalgebra::{Point2, Vector2};
use ringwing_flight::Tick;
use ringwing_scenario::Scenario;

/// A ring neighbour that is nearer than this share of the distance to keep repels with the whole of G, however far the slot is.
/// With less, ring neighbours pass each other more closely.
const NEAR_SHARE: f64 = 0.25;
/// From this share on, the repulsion fades with the slot error like everything else. With more, it holds one of three UAVs that is
/// across the centre from its slot: there its neighbours are at a share of 0.58.
const FAR_SHARE: f64 = 0.5;

/// The gains of one scenario; the paper's law weakens none of them.
#[derive(Debug, Clone)]
pub(super) struct Gains {
    /// G of Eq. (3).
    formation: f64,
    /// Gain of the slot's term of Eq. (3); 1 in the paper.
    pub(super) slot: f64,
    /// k of Eq. (13).
    pub(super) obstacle_m: f64,
    /// From metres across the heading to turn rate, Eq. (6); 1 in the paper.
    pub(super) heading_rad_per_m: f64,
    /// Time constant with which a neighbour's gain decays with the age of its data; `None` if it does not.
    trust_time_s: Option<f64>,
    /// Distance from the slot over which G decays; `None` if it does not.
    reach_m: Option<f64>,
    /// `None` if the formation's force is not limited.
    force_limit: Option<ForceLimit>,
    period_s: f64,
}

impl Gains {
    pub(super) fn new(scenario: &Scenario) -> Self {
        let control = &scenario.control;
        let reach_m = control.gain_reach_spacings * scenario.formation.spacing_m;
        Self {
            formation: control.formation_gain,
            slot: control.slot_gain,
            obstacle_m: control.obstacle_gain_m,
            heading_rad_per_m: control.heading_gain_rad_per_m,
            trust_time_s: control.trust_fades.then_some(control.trust_time_s),
            reach_m: control.gain_fades.then_some(reach_m),
            force_limit: control.force_limited.then(|| ForceLimit::new(scenario)),
            period_s: scenario.period_s(),
        }
    }

    /// G at this distance from the slot.
    ///
    /// Far from the slot the terms of G can hold a UAV at a wrong place; without them only the slot's term is left.
    pub(super) fn formation(&self, slot_error_m: &Vector2<f64>) -> f64 {
        // A Gaussian is flat at zero: near its slot, a UAV flies with the paper's G.
        let decayed = |reach_m: f64| libm::exp(-slot_error_m.norm_squared() / (reach_m * reach_m));
        self.formation * self.reach_m.map_or(1.0, decayed)
    }

    /// The bond to a ring neighbour of a UAV at `own`, where G has faded to `faded`. The gain of `trusted` is the share of G that the
    /// neighbour's data are trusted with.
    ///
    /// A UAV far from its slot must not be held by its neighbours, but it must not fly into them either.
    pub(super) fn bond(&self, faded: f64, trusted: Bond, own: &Point2<f64>) -> Bond {
        let share = (own - trusted.point).norm() / trusted.rest_m;
        let near = ((FAR_SHARE - share) / (FAR_SHARE - NEAR_SHARE)).clamp(0.0, 1.0);
        Bond { gain: faded.max(self.formation * near) * trusted.gain, ..trusted }
    }

    /// The share of a neighbour's gain that is left at the age of `track`. It is 1 at an age of one tick, which every
    /// sample takes to arrive.
    pub(super) fn trust(&self, track: &PeerTrack, now: Tick) -> f64 {
        // Never negative: a sample waits until the tick after the one in which it was sent.
        let age_s = (now.since(track.tick) - 1) as f64 * self.period_s;
        self.trust_time_s.map_or(1.0, |time_s| libm::exp(-age_s / time_s))
    }

    /// The formation's force on a UAV that is `slot_error_m` from its slot, cut if it is limited.
    pub(super) fn limited(
        &self,
        force: Vector2<f64>,
        slot_error_m: &Vector2<f64>,
        slot_velocity_m_s: &Vector2<f64>,
    ) -> Vector2<f64> {
        self.force_limit.map_or(force, |limit| limit.cut(force, slot_error_m, slot_velocity_m_s))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// G of a bond of 40 m to a neighbour this far away, where G has faded to nothing.
    fn far_from_the_slot(apart_m: f64, gain_fades: bool) -> f64 {
        let mut scenario = Scenario::default();
        scenario.control.gain_fades = gain_fades;
        let gains = Gains::new(&scenario);
        let faded = gains.formation(&Vector2::new(2000.0, 0.0));
        let bond = Bond { point: Point2::new(apart_m, 0.0), rest_m: 40.0, gain: 1.0 };
        gains.bond(faded, bond, &Point2::origin()).gain
    }

    #[test]
    fn far_from_its_slot_a_uav_is_repelled_by_near_neighbours_only() {
        let gains =
            [0.0, 9.0, 10.0, 15.0, 20.0, 23.1, 40.0, 90.0].map(|apart_m| far_from_the_slot(apart_m, true));
        assert_eq!(gains, [2.0, 2.0, 2.0, 1.0, 0.0, 0.0, 0.0, 0.0]);
    }

    #[test]
    fn a_gain_that_does_not_fade_is_the_papers_everywhere() {
        assert!([0.0, 15.0, 40.0, 90.0].iter().all(|apart_m| far_from_the_slot(*apart_m, false) == 2.0));
    }
}
