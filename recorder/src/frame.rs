//! One tick of the flight: put together from what was heard of it, and as the log tells it.
//!
//! Never waits and never guesses: what was not heard is absent.

use crate::{
    schema::{Timing, UavControl, UavState},
    show::links,
};
use nalgebra::{Point2, Vector2};
use ringwing_flight::{Account, FlightMode, LeaderState, LinkCounts, LivingRing, Sensed, TickTiming, UavId};
use ringwing_scenario::Scenario;
use std::collections::BTreeMap;

/// What was heard of one tick.
#[derive(Debug, Clone, PartialEq)]
pub struct Samples {
    /// The tick.
    pub tick: i64,
    /// How each airframe flies, UAV 1 first; none where it has left the sky or its sample was overwritten.
    pub flown: Vec<Option<Flown>>,
    /// What each agent commanded and why, UAV 1 first.
    pub accounts: Vec<Option<Account>>,
    /// Where the leader is.
    pub leader: Option<LeaderState>,
    /// How long the tick took.
    pub timing: Option<TickTiming>,
    /// What became of samples on links with faults.
    pub links: Vec<LinkCounts>,
    /// A sample of an airframe was overwritten before it was fetched.
    pub torn: bool,
}

/// How one airframe flies: what the log keeps of its [`Sensed`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Flown {
    /// True position.
    pub position: Point2<f64>,
    /// Heading from the x axis, counterclockwise.
    pub heading_rad: f64,
    /// Speed flown over the last tick.
    pub speed_m_s: f64,
    /// Turn rate flown over the last tick.
    pub turn_rate_rad_s: f64,
    /// Distance to the centre of the nearest obstacle sensed.
    pub obstacle_distance_m: Option<f64>,
    /// Who flies it.
    pub mode: &'static str,
}

impl From<&Sensed> for Flown {
    fn from(sensed: &Sensed) -> Self {
        let position = Point2::from(sensed.position_m);
        let distance = |centre: [f64; 2]| (Point2::from(centre) - position).norm();
        Self {
            position,
            heading_rad: sensed.heading_rad,
            speed_m_s: sensed.speed_m_s,
            turn_rate_rad_s: sensed.turn_rate_rad_s,
            obstacle_distance_m: sensed.obstacles().first().map(|obstacle| distance(obstacle.position_m)),
            mode: sensed.mode.name(),
        }
    }
}

impl Samples {
    fn new(uavs: usize) -> Self {
        Self {
            tick: 0,
            flown: vec![None; uavs],
            accounts: vec![None; uavs],
            leader: None,
            timing: None,
            links: Vec::new(),
            torn: false,
        }
    }

    fn clear(&mut self) {
        self.flown.fill(None);
        self.accounts.fill(None);
        self.links.clear();
        (self.leader, self.timing, self.torn) = (None, None, false);
    }
}

/// Sorts samples into their ticks, and hands the ticks out in order.
#[derive(Debug)]
pub(crate) struct Assembly {
    ticks: BTreeMap<i64, Samples>,
    /// Ticks before this one are handed out, or wanted by nobody.
    next: i64,
    /// The newest tick that the world or the leader spoke of.
    newest: Option<i64>,
    /// The newest tick of each airframe.
    newest_flown: Vec<Option<i64>>,
    spare: Vec<Samples>,
}

impl Assembly {
    /// For a swarm of `uavs`, from tick `first` on.
    pub(crate) fn new(uavs: u32, first: i64) -> Self {
        let newest_flown = vec![None; uavs as usize];
        Self { ticks: BTreeMap::new(), next: first, newest: None, newest_flown, spare: Vec::new() }
    }

    /// Takes what `uav` senses.
    pub(crate) fn put_sensed(&mut self, uav: UavId, sensed: &Sensed) {
        self.note(sensed.tick.0);
        self.newest_flown[uav.index()] = Some(sensed.tick.0);
        if let Some(samples) = self.at(sensed.tick.0) {
            samples.flown[uav.index()] = Some(sensed.into());
        }
    }

    /// Takes what the agent of `uav` commands and why.
    pub(crate) fn put_account(&mut self, uav: UavId, account: &Account) {
        if let Some(samples) = self.at(account.tick.0) {
            samples.accounts[uav.index()] = Some(*account);
        }
    }

    /// Takes where the leader is.
    pub(crate) fn put_leader(&mut self, leader: &LeaderState) {
        self.note(leader.tick.0);
        if let Some(samples) = self.at(leader.tick.0) {
            samples.leader = Some(*leader);
        }
    }

    /// Takes how long a tick took.
    pub(crate) fn put_timing(&mut self, timing: &TickTiming) {
        self.note(timing.tick);
        if let Some(samples) = self.at(timing.tick) {
            samples.timing = Some(*timing);
        }
    }

    /// Takes what became of samples on a link with faults.
    pub(crate) fn put_link(&mut self, counts: &LinkCounts) {
        if let Some(samples) = self.at(counts.tick.0) {
            samples.links.push(*counts);
        }
    }

    /// The newest tick heard of; an agent alone cannot make one.
    pub(crate) fn newest(&self) -> Option<i64> {
        self.newest
    }

    /// Hands out the oldest tick, if it is one before `end`.
    pub(crate) fn take_before(&mut self, end: i64) -> Option<Samples> {
        let oldest = self.ticks.first_entry().filter(|entry| *entry.key() < end)?;
        let mut samples = oldest.remove();
        self.next = samples.tick + 1;
        let absent =
            |(flown, newest): (&Option<Flown>, &Option<i64>)| flown.is_none() && *newest > Some(samples.tick);
        samples.torn = samples.flown.iter().zip(&self.newest_flown).any(absent);
        Some(samples)
    }

    /// Takes back what [`Self::take_before`] handed out, to use its memory again.
    pub(crate) fn recycle(&mut self, mut samples: Samples) {
        samples.clear();
        self.spare.push(samples);
    }

    fn note(&mut self, tick: i64) {
        self.newest = self.newest.max(Some(tick));
    }

    fn at(&mut self, tick: i64) -> Option<&mut Samples> {
        let uavs = self.newest_flown.len();
        let fresh = || Samples { tick, ..self.spare.pop().unwrap_or_else(|| Samples::new(uavs)) };
        (tick >= self.next).then(|| self.ticks.entry(tick).or_insert_with(fresh))
    }
}

/// What frames are measured against: the ring that the swarm should be.
///
/// Where the ring closes after a loss, that is the ring of those who fly on command, from the first tick on in which they
/// do: not the places on the way there, so that what a loss has broken shows until it is whole again.
#[derive(Debug, Clone)]
pub struct Ring {
    rate_hz: u32,
    living: LivingRing,
    /// From the centre to each slot, UAV 1's first.
    slots: Vec<Vector2<f64>>,
}

impl Ring {
    /// The ring of `scenario`.
    pub fn new(scenario: &Scenario) -> Self {
        let living = scenario.whole_ring();
        let slots = slots(&living, scenario.formation.uavs);
        Self { rate_hz: scenario.time.rate_hz, living, slots }
    }

    /// Makes it the ring of those who fly on command in `samples`.
    fn follow(&mut self, samples: &Samples) {
        let is_commanded = |flown: &Flown| flown.mode == FlightMode::COMMANDED.name();
        if self.living.reform(|number| samples.flown[number as usize - 1].as_ref().is_some_and(is_commanded))
        {
            self.slots = slots(&self.living, self.count());
        }
    }

    fn count(&self) -> u32 {
        self.slots.len() as u32
    }
}

fn slots(living: &LivingRing, count: u32) -> Vec<Vector2<f64>> {
    UavId::all(count).map(|uav| living.slot(uav.0).offset()).collect()
}

/// One tick as the log tells it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Frame {
    /// The tick.
    pub tick: i64,
    /// Where the leader is.
    pub leader: Option<LeaderState>,
    /// How long the tick took.
    pub timing: Option<Timing>,
    /// What became of samples on links with faults, by receiver and sender.
    pub links: Vec<links::LinkCounts>,
    /// Each UAV, number 1 first.
    pub uavs: Vec<UavFrame>,
    /// Something of this tick was lost.
    pub torn: bool,
}

/// One UAV in one tick, as the log tells it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct UavFrame {
    /// Where it is, unless it has left the sky.
    pub state: Option<UavState>,
    /// What its agent asked for, if it did.
    pub control: Option<UavControl>,
}

impl Frame {
    /// Makes this the frame of `samples`, seen against `ring`.
    pub fn refill(&mut self, samples: &Samples, ring: &mut Ring) {
        if !samples.torn {
            ring.follow(samples);
        }
        self.tick = samples.tick;
        self.leader = samples.leader;
        self.timing = samples.timing.as_ref().map(Timing::from);
        self.torn = samples.torn;
        let mut counts: Vec<&LinkCounts> = samples.links.iter().collect();
        counts.sort_by_key(|counts| (counts.to, counts.from));
        self.links.clear();
        self.links.extend(counts.into_iter().map(links::LinkCounts::from));
        self.uavs.clear();
        self.uavs.extend(UavId::all(ring.count()).map(|uav| UavFrame {
            state: state_of(uav, samples, ring),
            control:
                samples.accounts[uav.index()].map(|account| UavControl::of(uav.0, &account, ring.rate_hz)),
        }));
    }
}

fn state_of(uav: UavId, samples: &Samples, ring: &Ring) -> Option<UavState> {
    let flown = samples.flown[uav.index()]?;
    let distance = |place: Point2<f64>| (place - flown.position).norm();
    let neighbour = |number: u32| samples.flown[UavId(number).index()].map(|other| distance(other.position));
    let [previous, next] = ring.living.neighbours(uav.0);
    let centre = samples.leader.map(|leader| Point2::from(leader.position_m));
    let slot = centre.map(|centre| centre + ring.slots[uav.index()]);
    Some(UavState {
        tick: samples.tick,
        uav: uav.0,
        x_m: flown.position.x,
        y_m: flown.position.y,
        heading_rad: flown.heading_rad,
        speed_m_s: flown.speed_m_s,
        turn_rate_rad_s: flown.turn_rate_rad_s,
        previous_distance_m: previous.and_then(neighbour),
        next_distance_m: next.and_then(neighbour),
        leader_distance_m: centre.map(distance),
        slot_x_m: slot.map(|slot| slot.x),
        slot_y_m: slot.map(|slot| slot.y),
        slot_error_m: slot.map(distance),
        obstacle_distance_m: flown.obstacle_distance_m,
        mode: flown.mode.into(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing;
    use ringwing_flight::SensedObstacle;

    fn ticks_before(assembly: &mut Assembly, end: i64) -> Vec<(i64, bool)> {
        std::iter::from_fn(|| assembly.take_before(end)).map(|samples| (samples.tick, samples.torn)).collect()
    }

    #[test]
    fn ticks_come_out_in_order_whatever_order_they_came_in() {
        let mut assembly = Assembly::new(3, 0);
        for tick in [-1, 2, 0, 1] {
            for uav in UavId::all(3) {
                assembly.put_sensed(uav, &testing::sensed(tick, uav.0, [0.0, 0.0]));
            }
        }
        assert_eq!(ticks_before(&mut assembly, 2), [(0, false), (1, false)]);
        assert_eq!(ticks_before(&mut assembly, 3), [(2, false)]);
        assert_eq!(assembly.newest(), Some(2));
    }

    #[test]
    fn a_tick_is_torn_where_a_uav_is_missing_that_flies_on() {
        let mut assembly = Assembly::new(3, 0);
        let flights: [&[i64]; 3] = [&[0, 1, 2, 3], &[0, 2, 3], &[0, 1]];
        for (uav, ticks) in UavId::all(3).zip(flights) {
            for tick in ticks {
                assembly.put_sensed(uav, &testing::sensed(*tick, uav.0, [0.0, 0.0]));
            }
        }
        // UAV 2 was overwritten in tick 1; UAV 3 has left the sky after it.
        assert_eq!(ticks_before(&mut assembly, 9), [(0, false), (1, true), (2, false), (3, false)]);
    }

    #[test]
    fn an_account_comes_too_late_once_its_tick_is_handed_out() {
        let mut assembly = Assembly::new(3, 0);
        assembly.put_sensed(UavId(1), &testing::sensed(4, 1, [0.0, 0.0]));
        let samples = assembly.take_before(5).unwrap();
        assembly.recycle(samples);
        assembly.put_account(UavId(1), &testing::account(4, 1));
        assert_eq!(assembly.take_before(9), None);
    }

    #[test]
    fn a_frame_measures_from_true_places() {
        let scenario = testing::ring_of(4, 10.0);
        let radius = scenario.formation().radius_m();
        let mut samples = Samples::new(4);
        samples.leader = Some(testing::leader(0, [100.0, 0.0]));
        // The slot of UAV 1 lies behind the leader.
        let east = 103.0 - radius;
        let mut sensed = testing::sensed(0, 1, [east, 4.0]);
        sensed.obstacle_count = 1;
        sensed.obstacles[0] = SensedObstacle { position_m: [east, 16.0], ..SensedObstacle::default() };
        samples.flown[0] = Some((&sensed).into());
        samples.flown[3] = Some((&testing::sensed(0, 4, [east, -2.0])).into());
        let mut frame = Frame::default();
        frame.refill(&samples, &mut Ring::new(&scenario));
        let state = frame.uavs[0].state.clone().unwrap();
        assert_eq!((state.previous_distance_m, state.next_distance_m), (Some(6.0), None));
        assert!((state.slot_error_m.unwrap() - 5.0).abs() < 1e-12);
        assert_eq!(state.obstacle_distance_m, Some(12.0));
        assert_eq!(state.mode, "commanded");
        assert_eq!((&frame.uavs[1].state, &frame.uavs[0].control), (&None, &None));
    }

    #[test]
    fn where_the_ring_closes_those_on_command_are_measured_against_a_ring_of_their_own() {
        let mut scenario = testing::ring_of(4, 10.0);
        scenario.control.ring_closes = true;
        let mut ring = scenario.whole_ring();
        ring.reform(|number| number != 2);
        let mut samples = Samples::new(4);
        samples.leader = Some(testing::leader(0, [0.0, 0.0]));
        for number in 1..=4 {
            let mut sensed = testing::sensed(0, number, ring.slot(number).offset().into());
            if number == 2 {
                sensed.mode = FlightMode::LOITER;
            }
            samples.flown[number as usize - 1] = Some((&sensed).into());
        }
        let mut frame = Frame::default();
        frame.refill(&samples, &mut Ring::new(&scenario));
        for number in [1, 3, 4] {
            let state = frame.uavs[number - 1].state.as_ref().unwrap();
            assert!(state.slot_error_m.unwrap() < 1e-9, "{number}");
            assert!((state.next_distance_m.unwrap() - 10.0).abs() < 1e-9, "{number}");
        }
    }

    #[test]
    fn without_a_leader_there_is_no_slot() {
        let mut samples = Samples::new(3);
        samples.flown[1] = Some((&testing::sensed(0, 2, [1.0, 2.0])).into());
        let mut frame = Frame::default();
        frame.refill(&samples, &mut Ring::new(&testing::ring_of(3, 10.0)));
        let state = frame.uavs[1].state.as_ref().unwrap();
        assert_eq!((state.slot_x_m, state.slot_error_m, state.leader_distance_m), (None, None, None));
    }
}
