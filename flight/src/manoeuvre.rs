//! A planned change of the formation during the flight.
//!
//! It is a function of the scenario alone, so that every process flies the same one at the same tick. Must never know
//! where the UAVs are.

use crate::{Formation, FrameMotion, RingOrder, Slot, Tick, UavId, formation::closest};
use nalgebra::Vector2;

/// Moments of a manoeuvre at which speeds and distances are checked. With fewer, two slots could pass each other
/// unseen; more only make the check slower.
const MOMENTS: u32 = 64;

/// From `begins` on, the slots move to the places of another formation.
#[derive(Debug, Clone, PartialEq)]
pub struct Manoeuvre {
    /// The first tick in which the slots move.
    pub begins: Tick,
    /// How long they move.
    pub lasts_ticks: i64,
    /// The formation that they move to.
    pub formation: Formation,
    /// Which UAV gets which place in it.
    pub places: RingOrder,
    /// Whether slots on a circle move round the centre. Otherwise every slot moves straight.
    pub goes_round: bool,
}

/// The speeds that an airframe can fly, m/s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpeedRange {
    /// `v_min` of Eq. (2).
    pub min_m_s: f64,
    /// `v_max` of Eq. (2).
    pub max_m_s: f64,
}

/// How near two slots come to each other on the way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Passing {
    /// The two UAVs.
    pub uavs: [UavId; 2],
    /// Their smallest distance, metres.
    pub apart_m: f64,
}

impl Manoeuvre {
    /// A slot after `share` of its way.
    pub fn on_the_way(&self, from: &Slot, to: &Slot, share: f64) -> Slot {
        if self.goes_round { from.towards(to, share) } else { from.straight_towards(to, share) }
    }

    /// The slot of `uav` at the end.
    pub fn slot(&self, uav: UavId) -> Slot {
        self.formation.place(self.places.slot(uav))
    }

    /// The shortest duration in seconds in which `uav` can follow its slot, which is at `from` in the beginning, whichever of
    /// `motions` the leader makes on the way; `None` if no duration is long enough.
    pub fn shortest_s(
        &self,
        uav: UavId,
        from: &Slot,
        motions: &[FrameMotion],
        speeds: SpeedRange,
    ) -> Option<f64> {
        let to = self.slot(uav);
        let place = |moment: u32| self.on_the_way(from, &to, share(moment)).offset();
        let least_s = |moment: u32| {
            let here = place(moment);
            // The way per whole manoeuvre, at the pace of the last step; exact on a straight way.
            let rate_m = (here - place(moment - 1)) * f64::from(MOMENTS);
            let least = |motion: &FrameMotion| shortest_s(&rate_m, &motion.velocity_m_s(here), speeds);
            motions.iter().map(least).reduce(longer).flatten()
        };
        (1..=MOMENTS).map(least_s).reduce(longer).flatten()
    }

    /// The two slots that come nearest to each other on the way from `before`, UAV 1 first; `None` for a single one.
    pub fn closest_passing(&self, before: &[Slot]) -> Option<Passing> {
        let passing = |moment: u32| {
            let here = UavId::all(self.places.count()).zip(before);
            let places: Vec<_> = here
                .map(|(uav, from)| self.on_the_way(from, &self.slot(uav), share(moment)).offset())
                .collect();
            let (one, other, apart_m) = closest(&places)?;
            Some(Passing { uavs: [UavId(one), UavId(other)], apart_m })
        };
        (0..=MOMENTS).filter_map(passing).min_by(|one, other| one.apart_m.total_cmp(&other.apart_m))
    }
}

/// The longer of two durations; `None` is longer than any.
fn longer(one: Option<f64>, other: Option<f64>) -> Option<f64> {
    Some(one?.max(other?))
}

fn share(moment: u32) -> f64 {
    f64::from(moment) / f64::from(MOMENTS)
}

/// The shortest time in which a slot can move by `way_m` while its speed over the ground stays within `speeds`. At rest in
/// the formation it would move at `resting`, which is within them.
///
/// With s = 1 / time, the squared speed is c + 2 b s + a s^2.
fn shortest_s(way_m: &Vector2<f64>, resting: &Vector2<f64>, speeds: SpeedRange) -> Option<f64> {
    let (a, b, c) = (way_m.norm_squared(), resting.dot(way_m), resting.norm_squared());
    // A slot that stays where it is needs no time. Rounding moves slots by less than this.
    if a < 1e-12 {
        return Some(0.0);
    }
    let root = |bound_m_s: f64| (b * b - a * (c - bound_m_s * bound_m_s)).max(0.0).sqrt();
    // The larger root: the speed is within its limit at rest, so the smaller one is not above 0.
    let fast = (root(speeds.max_m_s) - b) / a;
    // A slot that falls back flies slower at first; one that moves far across is fast again at a high rate, but would
    // have to be too slow on the way there.
    let can_be_slow = b < 0.0 && b * b > a * (c - speeds.min_m_s * speeds.min_m_s);
    let slow = if can_be_slow { (-b - root(speeds.min_m_s)) / a } else { f64::INFINITY };
    let rate = fast.min(slow);
    (rate > 0.0).then(|| rate.recip())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::f64::consts::PI;

    const SPEEDS: SpeedRange = SpeedRange { min_m_s: 12.0, max_m_s: 25.0 };

    fn leader() -> Vector2<f64> {
        Vector2::new(15.0, 0.0)
    }

    #[test]
    fn a_slot_falls_back_slowly_and_gains_quickly() {
        let shortest = |x, y| shortest_s(&Vector2::new(x, y), &leader(), SPEEDS).unwrap();
        assert!((shortest(-30.0, 0.0) - 10.0).abs() < 1e-9, "at 3 m/s");
        assert!((shortest(30.0, 0.0) - 3.0).abs() < 1e-9, "at 10 m/s");
        assert!((shortest(0.0, 40.0) - 2.0).abs() < 1e-9, "15 m/s ahead and 20 m/s across");
        assert_eq!(shortest(0.0, 0.0), 0.0);
    }

    #[test]
    fn behind_a_leader_that_flies_as_slowly_as_an_airframe_can_nothing_falls_back() {
        let slow = Vector2::new(12.0, 0.0);
        assert_eq!(shortest_s(&Vector2::new(-30.0, 0.0), &slow, SPEEDS), None);
        assert!(shortest_s(&Vector2::new(30.0, 0.0), &slow, SPEEDS).is_some());
    }

    #[test]
    fn a_ring_that_turns_by_half_a_turn_meets_in_the_centre_unless_it_goes_round() {
        let before: Vec<_> = (1..=6).map(|number| Formation::new(6, 40.0, PI).place(number)).collect();
        let passing = |goes_round| {
            let (formation, places) = (Formation::new(6, 40.0, 0.0), RingOrder::by_number(6));
            let turn = Manoeuvre { begins: Tick(0), lasts_ticks: 1, formation, places, goes_round };
            turn.closest_passing(&before).expect("six slots")
        };
        assert!(passing(false).apart_m < 1e-9, "{:?}", passing(false));
        assert!((passing(true).apart_m - 40.0).abs() < 1e-6, "{:?}", passing(true));
    }

    proptest! {
        #[test]
        fn in_the_shortest_time_the_speed_is_at_its_limit_and_never_beyond(x in -200.0..200.0, y in -200.0..200.0) {
            let way = Vector2::new(x, y);
            prop_assume!(way.norm() > 1.0);
            let least_s = shortest_s(&way, &leader(), SPEEDS).unwrap();
            let speed = |time_s: f64| (leader() + way / time_s).norm();
            let at_limit = (speed(least_s) - 12.0).abs().min((speed(least_s) - 25.0).abs());
            prop_assert!(at_limit < 1e-6, "{} m/s", speed(least_s));
            for longer in [1.0, 1.1, 2.0, 10.0] {
                prop_assert!((12.0 - 1e-6..=25.0 + 1e-6).contains(&speed(longer * least_s)));
            }
        }
    }
}
