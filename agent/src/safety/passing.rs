//! Whether a way past another UAV lets both get where they want to, or only puts their conflict off.
//!
//! Two UAVs that want to change places can fly side by side for ever: within the horizon that is always clear, and always the
//! smallest departure from the wish. Never judges what does not avoid this UAV in turn: an obstacle, an intruder, or one
//! without its agent.

use super::{
    course::{Course, SAMPLES},
    threat::Threat,
};
use ringwing_flight::UavId;

/// Cost of a way at whose end the other is still straight in the way, in rad of departure from the wish. More sends UAVs round each
/// other that would pass in time; without it, some keep each other from their slots for ever.
const PUT_OFF_COST: f64 = 0.6;
/// The other is in the way if both would pass each other more closely than this, in m. About the separation: less lets UAVs wait
/// that can never pass, more sends them the long way round.
const PASSING_M: f32 = 12.0;
/// If both wish to move this little against each other within the horizon, in m, neither is in the other's way.
const STILL_M: f32 = 4.0;
/// Cost of flying faster than wished by the whole range of speeds for the UAV with the higher number, and of flying slower for the other.
/// Only more than nothing counts: it makes one of two in the same position fall back.
const RANK_COST: f64 = 0.02;

/// What two UAVs wish to do after the horizon.
#[derive(Debug, Clone, Copy)]
pub(super) struct Passing {
    /// How far this UAV wishes to move within the horizon, seen from the other.
    wish: [f32; 2],
    wish_m: f32,
    /// Where the other is at the end of the horizon.
    other_end: [f32; 2],
    wish_m_s: f64,
    /// Cost of a speed above the wished one, per m/s; negative for the UAV with the lower number.
    rank_cost: f64,
}

impl Passing {
    /// What UAV `own` and the `threat` wish, if that is a UAV which avoids this one too. `own` wishes to fly `wished` at
    /// `wish_m_s`; airframes have speeds within a range of `speed_range_m_s`.
    pub(super) fn of(
        own: UavId,
        threat: &Threat,
        wished: &Course,
        wish_m_s: f64,
        speed_range_m_s: f64,
    ) -> Option<Self> {
        let other = threat.avoids_too?;
        let ([x, y], [end_x, end_y]) = (threat.course.first(), threat.course.last());
        // The first sample is a step from now: stretch the rest to the whole horizon.
        let stretch = SAMPLES as f32 / (SAMPLES - 1) as f32;
        let [own_x, own_y] = wished.last().map(|along_m| along_m * wish_m_s as f32);
        let wish = [own_x - (end_x - x) * stretch, own_y - (end_y - y) * stretch];
        let rank = if own > other { RANK_COST } else { -RANK_COST };
        Some(Self {
            wish,
            wish_m: (wish[0] * wish[0] + wish[1] * wish[1]).sqrt(),
            other_end: [end_x, end_y],
            wish_m_s,
            rank_cost: rank / speed_range_m_s,
        })
    }

    /// The cost of flying `course` at `speed_m_s`, in rad of departure from the wish.
    pub(super) fn cost(&self, course: &Course, speed_m_s: f64) -> f64 {
        let in_the_way = f64::from(self.is_in_the_way(course, speed_m_s as f32));
        PUT_OFF_COST * in_the_way + self.rank_cost * (speed_m_s - self.wish_m_s)
    }

    /// How much the other is in the way at the end of `course`, from 0 to 1, if both then fly as they wish.
    fn is_in_the_way(&self, course: &Course, speed_m_s: f32) -> f32 {
        let [end_x, end_y] = course.last().map(|along_m| along_m * speed_m_s);
        let apart = [self.other_end[0] - end_x, self.other_end[1] - end_y];
        let ahead = apart[0] * self.wish[0] + apart[1] * self.wish[1];
        if self.wish_m < STILL_M || ahead <= 0.0 {
            return 0.0;
        }
        let miss_m = (apart[0] * self.wish[1] - apart[1] * self.wish[0]).abs() / self.wish_m;
        (1.0 - miss_m / PASSING_M).max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Surroundings, threat::Viewpoint};
    use super::*;
    use nalgebra::{Point2, Vector2};
    use ringwing_flight::{AircraftId, Pose, SensedAircraft};

    /// UAV 2 flies along x and wishes to turn left; the other flies beside it, 12 m to its left.
    fn beside(who: u32, is_answering: u32) -> Option<Passing> {
        let own = Pose { position: Point2::origin(), heading_rad: 0.0 };
        let other = SensedAircraft {
            position_m: [0.0, 12.0],
            heading_rad: 0.0,
            speed_m_s: 15.0,
            turn_rate_rad_s: 0.0,
            who: AircraftId::uav(UavId(who)),
            is_answering,
        };
        let around = Surroundings { obstacles: &[], swarm_rad_s: 0.0, wind_m_s: Vector2::zeros() };
        let threat = Viewpoint::new(own, 4.0, &around).aircraft(&other, 0.0, 10.0);
        Passing::of(UavId(2), &threat, &Course::after_turn(1.0, 0.5, 4.0), 15.0, 13.0)
    }

    #[test]
    fn side_by_side_costs_and_falling_back_behind_the_other_does_not() {
        let passing = beside(1, 1).expect("it avoids this one too");
        let ahead = Course::after_turn(0.0, 0.5, 4.0);
        let (beside, behind) = (passing.cost(&ahead, 15.0), passing.cost(&ahead, 8.0));
        assert!(beside > 0.1, "{beside}");
        assert!(behind < 0.0, "{behind}");
    }

    #[test]
    fn one_of_two_would_rather_be_slow() {
        let ahead = Course::after_turn(0.0, 0.5, 4.0);
        let slower = |who| {
            let passing = beside(who, 1).expect("it avoids this one too");
            passing.cost(&ahead, 5.0) - passing.cost(&ahead, 6.0)
        };
        assert!(slower(1) < 0.0 && slower(3) > 0.0);
    }

    #[test]
    fn what_does_not_avoid_this_uav_is_not_waited_for() {
        assert!(beside(1, 0).is_none(), "its agent is silent");
    }
}
