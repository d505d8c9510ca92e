//! How far each UAV flies from where it would be without the faults.
//!
//! Compares the frames of two flights, tick by tick. Never decides which flight is the undisturbed one, and never measures
//! a UAV that its failsafe flies: it has left the formation, and its distance would hide those of the others.

use super::frame::{Frame, UavFrame};
use ringwing_flight::Tick;
use serde::{Deserialize, Serialize};

/// A UAV that deviates by more is off its undisturbed course. It is the bound within which a formation counts as settled. A
/// smaller one takes a UAV for away that has settled again; a larger one overlooks faults that a formation notices.
pub const OFF_COURSE_M: f64 = 1.0;

/// What faults have cost a flight.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Deviation {
    /// The largest deviation of any UAV; absent if no UAV flew on command.
    pub peak_m: Option<f64>,
    /// The time integral of the deviations of all UAVs together.
    pub area_m_s: f64,
    /// The longest time that one of the UAVs that fly on command at the end needed to come back to its course: 0 if all
    /// stayed on it, absent if one is still off it, or if no UAV flies on command.
    pub back_s: Option<f64>,
    /// Each UAV, number 1 first.
    pub uavs: Vec<UavDeviation>,
}

/// What faults have cost one UAV.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct UavDeviation {
    /// The UAV's number, from 1.
    pub uav: u32,
    /// Its largest deviation.
    pub peak_m: Option<f64>,
    /// When that was.
    pub peak_time_s: Option<f64>,
    /// The time integral of its deviation.
    pub area_m_s: f64,
    /// When it first deviated by more than [`OFF_COURSE_M`]; absent if it never did.
    pub left_s: Option<f64>,
    /// How long after that it came back for good; 0 if it was never off, absent if it is off or does not fly on command at
    /// the end.
    pub back_s: Option<f64>,
}

/// Measures deviations while two flights are flown or read.
#[derive(Debug, Clone)]
pub struct Deviations {
    rate_hz: u32,
    /// The tick observed last.
    last: Option<i64>,
    tracks: Vec<Track>,
}

/// The deviations of one UAV so far.
#[derive(Debug, Clone, Copy, Default)]
struct Track {
    /// The largest deviation, and its tick.
    peak: Option<(f64, i64)>,
    /// The sum of the deviations of all ticks.
    sum_m: f64,
    /// The first tick off course, and the last one.
    off: Option<(i64, i64)>,
    /// The last tick in which it had a deviation.
    last: Option<i64>,
}

/// How far a UAV is from its undisturbed self; `None` unless both fly, and this one on command.
pub fn deviation_m(flown: &UavFrame, undisturbed: &UavFrame) -> Option<f64> {
    let (flown, undisturbed) = (flown.commanded()?, undisturbed.state.as_ref()?);
    Some((flown.position() - undisturbed.position()).norm())
}

impl Deviations {
    /// Of a flight of `uavs` at `rate_hz` ticks a second, before its first tick.
    pub fn new(uavs: u32, rate_hz: u32) -> Self {
        Self { rate_hz, last: None, tracks: vec![Track::default(); uavs as usize] }
    }

    /// Takes the next tick of both flights.
    pub fn observe(&mut self, flown: &Frame, undisturbed: &Frame) {
        debug_assert_eq!(flown.tick, undisturbed.tick);
        let tick = flown.tick;
        self.last = Some(tick);
        for (track, (flown, undisturbed)) in
            self.tracks.iter_mut().zip(flown.uavs.iter().zip(&undisturbed.uavs))
        {
            if let Some(off_m) = deviation_m(flown, undisturbed) {
                track.take(off_m, tick);
            }
        }
    }

    /// What the faults have cost up to the tick observed last.
    pub fn summary(&self) -> Deviation {
        let uavs: Vec<_> = (1..).zip(&self.tracks).map(|(uav, track)| self.of_uav(uav, track)).collect();
        let at_the_end = uavs.iter().zip(&self.tracks).filter(|(_, track)| self.flies(track));
        // One UAV that is not back is enough: the swarm is not back either.
        let back_s = at_the_end.map(|(uav, _)| uav.back_s).reduce(|one, other| Some(one?.max(other?)));
        Deviation {
            peak_m: uavs.iter().filter_map(|uav| uav.peak_m).reduce(f64::max),
            area_m_s: uavs.iter().map(|uav| uav.area_m_s).sum(),
            back_s: back_s.flatten(),
            uavs,
        }
    }

    fn of_uav(&self, uav: u32, track: &Track) -> UavDeviation {
        UavDeviation {
            uav,
            peak_m: track.peak.map(|(peak_m, _)| peak_m),
            peak_time_s: track.peak.map(|(_, tick)| self.seconds(tick)),
            area_m_s: track.sum_m / f64::from(self.rate_hz),
            left_s: track.off.map(|(first, _)| self.seconds(first)),
            back_s: self.back_s(track),
        }
    }

    fn back_s(&self, track: &Track) -> Option<f64> {
        match track.off {
            _ if !self.flies(track) => None,
            None => Some(0.0),
            Some((_, last)) if Some(last) == self.last => None,
            Some((first, last)) => Some(self.seconds(last + 1 - first)),
        }
    }

    /// Whether the UAV flies on command in the tick observed last.
    fn flies(&self, track: &Track) -> bool {
        track.last.is_some() && track.last == self.last
    }

    fn seconds(&self, ticks: i64) -> f64 {
        Tick(ticks).seconds(self.rate_hz)
    }
}

impl Track {
    fn take(&mut self, off_m: f64, tick: i64) {
        self.last = Some(tick);
        self.sum_m += off_m;
        // Of equal deviations the first one counts.
        if self.peak.is_none_or(|(peak_m, _)| off_m > peak_m) {
            self.peak = Some((off_m, tick));
        }
        if off_m > OFF_COURSE_M {
            self.off = Some((self.off.map_or(tick, |(first, _)| first), tick));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{at_rest, ring_of};
    use ringwing_flight::FlightMode;

    /// What a flight at 100 Hz of three UAVs has cost; in its ticks, UAV 2 is `off_m` metres off.
    fn cost(off_m: &[f64]) -> Deviation {
        let scenario = ring_of(3, 40.0);
        let mut deviations = Deviations::new(3, 100);
        for (tick, off_m) in (0..).zip(off_m) {
            let undisturbed = at_rest(&scenario, tick);
            let mut flown = undisturbed.clone();
            flown.uavs[1].state.as_mut().unwrap().y_m += off_m;
            deviations.observe(&flown, &undisturbed);
        }
        deviations.summary()
    }

    /// Whether two numbers are equal but for rounding.
    fn near(one: f64, other: f64) -> bool {
        (one - other).abs() < 1e-9
    }

    #[test]
    fn the_cost_of_a_fault_has_a_peak_an_area_and_a_time_back() {
        let cost = cost(&[0.0, 0.5, 2.0, -4.0, 0.5, 3.0, 0.9, 0.0]);
        let two = &cost.uavs[1];
        assert!(near(two.peak_m.unwrap(), 4.0) && near(two.area_m_s, 0.109), "{two:?}");
        assert_eq!((two.peak_time_s, two.left_s, two.back_s), (Some(0.03), Some(0.02), Some(0.04)));
        assert_eq!((cost.peak_m, cost.area_m_s, cost.back_s), (two.peak_m, two.area_m_s, Some(0.04)));
        assert_eq!(
            (cost.uavs[0].peak_m, cost.uavs[0].left_s, cost.uavs[0].back_s),
            (Some(0.0), None, Some(0.0))
        );
    }

    #[test]
    fn a_uav_that_is_off_at_the_end_is_not_back() {
        let cost = cost(&[0.0, 2.0, 0.0, 1.5]);
        assert_eq!((cost.uavs[1].left_s, cost.uavs[1].back_s, cost.back_s), (Some(0.01), None, None));
    }

    #[test]
    fn a_uav_that_its_failsafe_flies_counts_no_more_and_holds_nobody_back() {
        let scenario = ring_of(3, 40.0);
        let mut deviations = Deviations::new(3, 100);
        for tick in 0..10 {
            let undisturbed = at_rest(&scenario, tick);
            let mut flown = undisturbed.clone();
            let state = flown.uavs[1].state.as_mut().unwrap();
            state.y_m += 3.0 * tick as f64;
            if tick > 4 {
                state.mode = FlightMode::LOITER;
            }
            deviations.observe(&flown, &undisturbed);
        }
        let cost = deviations.summary();
        assert!(near(cost.peak_m.unwrap(), 12.0), "{cost:?}");
        assert_eq!((cost.uavs[1].back_s, cost.back_s), (None, Some(0.0)));
    }

    #[test]
    fn of_equal_deviations_the_first_is_the_peak_and_one_at_the_bound_is_on_course() {
        let mut track = Track::default();
        for (tick, off_m) in [(0, 0.0), (1, OFF_COURSE_M), (2, 0.5), (3, OFF_COURSE_M)] {
            track.take(off_m, tick);
        }
        assert_eq!((track.peak, track.off), (Some((OFF_COURSE_M, 1)), None));
    }

    #[test]
    fn a_flight_without_a_tick_has_no_peak_and_nobody_who_is_back() {
        let cost = cost(&[]);
        assert_eq!((cost.peak_m, cost.area_m_s, cost.back_s), (None, 0.0, None));
    }
}
