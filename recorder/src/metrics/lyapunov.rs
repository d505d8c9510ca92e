//! V of Eq. (7) at the true states, and how often it rose although Theorem 1 says that it cannot.
//!
//! In a turn, V measures each heading against the velocity of the slot instead of the leader's, so it is 0 exactly while
//! every UAV moves with its slot. The theorem assumes a leader that flies straight (Assumption 1), so rises of V count only
//! then. In wind, V measures the course over the ground instead of the heading, and rises do not count: the theorem assumes still
//! air. Where the leader is at a tick follows from the scenario, because the log holds the leader less often.
//!
//! Must never share code with the agents' law: a mistake in the law must not hide in the code that judges the flight.
//! A pair of neighbours counts if both fly on command; each of the two adds half of the pair's term.

use super::{
    ControlTerms, Frame, TrueState,
    ring::{RingNeighbour, RingPlace},
};
use nalgebra::Vector2;
use ringwing_flight::{FormationFrame, LeaderPath, PathMotion, Tick};
use ringwing_scenario::{Law, Scenario};

/// Share of V that rounding may add in one tick. A smaller share counts rounding as a rise; a larger one hides slow rises.
const ROUNDING: f64 = 1e-9;

/// Follows V from tick to tick.
#[derive(Debug, Clone)]
pub(super) struct LyapunovWatch {
    formation_gain: f64,
    slot_gain: f64,
    leader: LeaderPath,
    frame: FormationFrame,
    rate_hz: u32,
    /// Whether the agents fly the law that the theorem is about, in still air.
    is_papers: bool,
    rises: u64,
    last: Option<Last>,
}

/// V at the tick before.
#[derive(Debug, Clone, Copy)]
struct Last {
    tick: i64,
    value_m2: f64,
    commanded: u32,
    manoeuvres: usize,
    /// Whether every UAV flew the law as the theorem assumes it.
    proven: bool,
}

impl LyapunovWatch {
    pub(super) fn new(scenario: &Scenario) -> Self {
        Self {
            formation_gain: scenario.control.formation_gain,
            slot_gain: scenario.control.slot_gain,
            leader: scenario.leader_path(),
            frame: scenario.formation.frame,
            rate_hz: scenario.time.rate_hz,
            is_papers: scenario.control.law == Law::Paper && scenario.wind.is_still(),
            rises: 0,
            last: None,
        }
    }

    /// Takes the next frame, in which `commanded` UAVs fly on command; returns V.
    pub(super) fn observe(&mut self, frame: &Frame, commanded: u32) -> Option<f64> {
        let leader = self.leader.at(Tick(frame.tick).seconds(self.rate_hz));
        let value = self.candidate(frame, &leader).filter(|value| value.is_finite());
        let before = self.last.take();
        if let (Some(value_m2), Some(before)) = (value, before) {
            // V jumps when a UAV joins or leaves the formation or a manoeuvre begins, and what happened in a missing tick
            // is unknown.
            let is_same = before.commanded == commanded && before.manoeuvres == frame.ring.begun();
            let follows = before.tick + 1 == frame.tick && is_same;
            // The 1 m2 keeps the tolerance above rounding errors where V itself is almost 0.
            let rose = value_m2 > before.value_m2 + ROUNDING * (1.0 + before.value_m2);
            // The commands of the tick before led to this V, so they decide whether the theorem applies.
            self.rises += u64::from(follows && before.proven && rose);
        }
        let proven = self.is_papers && leader.turn_rate_rad_s == 0.0 && is_proven(frame);
        let manoeuvres = frame.ring.begun();
        self.last = value.map(|value_m2| Last { tick: frame.tick, value_m2, commanded, manoeuvres, proven });
        value
    }

    /// Number of ticks in which V rose although no UAV was saturated or repelled.
    pub(super) fn rises(&self) -> u64 {
        self.rises
    }

    /// V, or `None` if no UAV flies on command or a distance is unknown.
    fn candidate(&self, frame: &Frame, leader: &PathMotion) -> Option<f64> {
        let mut sum = None;
        for state in frame.all_commanded() {
            let place = frame.ring.place(state.uav);
            let stretch = |(neighbour, distance_m): (Option<RingNeighbour>, Option<f64>)| {
                let neighbour = neighbour.filter(|one| frame.commanded(one.uav).is_some())?;
                Some(self.stretch(distance_m?, neighbour.rest_m))
            };
            let neighbours =
                [(place.previous, state.previous_distance_m), (place.next, state.next_distance_m)];
            let pairs: f64 = neighbours.into_iter().filter_map(stretch).sum();
            // A pair's term has weight 1/2, like those of the other distances; each of its two UAVs adds half of it.
            *sum.get_or_insert(0.0) += 0.25 * pairs + self.share_of(state, place, leader)?;
        }
        sum
    }

    fn stretch(&self, distance_m: f64, rest_m: f64) -> f64 {
        self.formation_gain * (distance_m - rest_m).powi(2)
    }

    /// The terms of V that depend on one UAV alone: its distance from the centre, its slot error and its heading.
    fn share_of(&self, state: &TrueState, place: &RingPlace, leader: &PathMotion) -> Option<f64> {
        let centre = self.stretch(state.leader_distance_m?, place.radius_m);
        let slot = self.slot_gain * state.slot_error_m?.powi(2);
        let (speed_m_s, heading_rad) = self.slot_motion(place, leader);
        let heading = speed_m_s * (1.0 - libm::cos(state.course_rad() - heading_rad));
        Some(0.5 * centre + 0.5 * slot + heading)
    }

    /// How fast the slot at `place` moves, and where it heads. Without a turn these are the leader's.
    fn slot_motion(&self, place: &RingPlace, leader: &PathMotion) -> (f64, f64) {
        let PathMotion { pose, speed_m_s, turn_rate_rad_s } = *leader;
        if self.frame == FormationFrame::Fixed || turn_rate_rad_s == 0.0 {
            return (speed_m_s, pose.heading_rad);
        }
        // In the leader's frame the slot is at rest but for the turn round the leader, which flies along x.
        let turning = Vector2::new(-place.offset.y, place.offset.x) * turn_rate_rad_s;
        let velocity = Vector2::new(speed_m_s, 0.0) + turning;
        (velocity.norm(), pose.heading_rad + libm::atan2(velocity.y, velocity.x))
    }
}

/// Whether every UAV flies Eq. (6) unaltered, to a slot that rests: not cut by Eq. (12), and nothing added by Eq. (13).
fn is_proven(frame: &Frame) -> bool {
    let is_unaltered = |control: &ControlTerms| {
        let is_cut = control.speed_saturated || control.turn_rate_saturated;
        !is_cut && !control.slots_moving && control.repulsion_m == [0.0; 2]
    };
    let in_formation = frame.uavs.iter().filter(|uav| uav.commanded().is_some());
    in_formation.map(|uav| uav.control.as_ref()).all(|control| control.is_some_and(is_unaltered))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{at_rest, ring_of};
    use ringwing_scenario::ManoeuvreSection;

    fn displaced(scenario: &Scenario, tick: i64, slot_error_m: f64) -> Frame {
        let mut frame = at_rest(scenario, tick);
        frame.uavs[0].state.as_mut().unwrap().slot_error_m = Some(slot_error_m);
        frame
    }

    #[test]
    fn v_is_zero_in_formation_and_each_term_has_its_weight() {
        let scenario = ring_of(4, 10.0);
        let mut watch = LyapunovWatch::new(&scenario);
        assert!(watch.observe(&at_rest(&scenario, 0), 4).unwrap() < 1e-20);
        assert!((watch.observe(&displaced(&scenario, 1, 3.0), 4).unwrap() - 4.5).abs() < 1e-9);
        let mut frame = at_rest(&scenario, 2);
        let state = frame.uavs[0].state.as_mut().unwrap();
        (state.next_distance_m, state.heading_rad) = (Some(12.0), std::f64::consts::PI);
        // A quarter of G (2 m)^2, and twice the leader's speed.
        assert!((watch.observe(&frame, 4).unwrap() - (0.25 * 2.0 * 4.0 + 30.0)).abs() < 1e-9);
    }

    #[test]
    fn a_rise_counts_unless_saturation_or_a_missing_tick_explains_it() {
        let scenario = ring_of(3, 40.0);
        let mut watch = LyapunovWatch::new(&scenario);
        let mut excused = displaced(&scenario, 1, 2.0);
        excused.uavs[1].control.as_mut().unwrap().speed_saturated = true;
        let frames = [displaced(&scenario, 0, 1.0), excused, displaced(&scenario, 2, 3.0)];
        let rises: Vec<_> = frames
            .iter()
            .map(|frame| {
                watch.observe(frame, 3);
                watch.rises()
            })
            .collect();
        assert_eq!(rises, [0, 1, 1]);
        watch.observe(&displaced(&scenario, 4, 9.0), 3);
        assert_eq!(watch.rises(), 1, "a tick is missing");
    }

    /// How many times V rose in a flight whose first UAV is off its slot by so much in each tick.
    fn rises_of(slot_errors_m: &[f64]) -> u64 {
        let scenario = ring_of(3, 40.0);
        let mut watch = LyapunovWatch::new(&scenario);
        for (tick, error_m) in (0..).zip(slot_errors_m) {
            watch.observe(&displaced(&scenario, tick, *error_m), 3);
        }
        watch.rises()
    }

    #[test]
    fn rounding_is_no_rise_however_large_v_is() {
        assert_eq!(rises_of(&[3.0, 3.0, 3.0]), 0);
        assert_eq!(rises_of(&[0.0, 1e-5]), 0, "5e-11 m2 above nothing");
        assert_eq!(rises_of(&[1000.0, 1000.0 + 1e-7]), 0, "2e-10 of the whole");
        assert_eq!(rises_of(&[0.0, 1e-3]), 1);
        assert_eq!(rises_of(&[1000.0, 1000.0 + 1e-5]), 1);
    }

    #[test]
    fn a_jump_is_no_rise_when_the_formation_itself_changes() {
        let mut scenario = ring_of(3, 40.0);
        scenario.time.rate_hz = 1;
        scenario.manoeuvres =
            vec![ManoeuvreSection { at_s: 4.0, over_s: 1.0, ..ManoeuvreSection::default() }];
        let mut watch = LyapunovWatch::new(&scenario);
        watch.observe(&displaced(&scenario, 1, 1.0), 3);
        watch.observe(&displaced(&scenario, 2, 2.0), 2);
        assert_eq!(watch.rises(), 0, "a UAV has left");
        watch.observe(&displaced(&scenario, 3, 1.0), 2);
        watch.observe(&displaced(&scenario, 4, 2.0), 2);
        assert_eq!(watch.rises(), 0, "a manoeuvre has begun");
        watch.observe(&displaced(&scenario, 5, 3.0), 2);
        assert_eq!(watch.rises(), 1);
    }

    #[test]
    fn in_a_turn_v_is_zero_while_every_uav_moves_with_its_slot_and_its_rises_do_not_count() {
        for frame in [FormationFrame::Fixed, FormationFrame::Leader] {
            let mut scenario = ring_of(5, 40.0);
            scenario.leader.path.kind = ringwing_scenario::PathKind::Circle;
            scenario.formation.frame = frame;
            let mut watch = LyapunovWatch::new(&scenario);
            let mut flown = at_rest(&scenario, 0);
            let turn_rate_rad_s = 15.0 / 300.0;
            for uav in &mut flown.uavs {
                let state = uav.state.as_mut().unwrap();
                let offset = Vector2::new(state.x_m, state.y_m);
                // A slot on the circle of radius r round the leader moves at omega r, to the left of its bearing.
                let round = frame.turn_rate_rad_s(turn_rate_rad_s) * offset.norm();
                let bearing_rad = offset.y.atan2(offset.x);
                let velocity = [15.0 - round * bearing_rad.sin(), round * bearing_rad.cos()];
                state.heading_rad = velocity[1].atan2(velocity[0]);
            }
            assert!(watch.observe(&flown, 5).unwrap() < 1e-9, "{frame:?}");
            let mut worse = flown.clone();
            worse.tick = 1;
            worse.uavs[0].state.as_mut().unwrap().slot_error_m = Some(3.0);
            assert!(watch.observe(&worse, 5).unwrap() > 4.0);
            assert_eq!(watch.rises(), 0);
        }
    }

    #[test]
    fn an_empty_sky_has_no_value() {
        let scenario = ring_of(3, 40.0);
        let mut frame = at_rest(&scenario, 0);
        frame.uavs.iter_mut().for_each(|uav| uav.state = None);
        assert_eq!(LyapunovWatch::new(&scenario).observe(&frame, 0), None);
    }
}
