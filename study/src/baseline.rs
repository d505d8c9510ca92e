//! The same flight without its faults, flown beside a flight to see what its faults cost.
//!
//! Takes the frames of a flight from wherever they come: a simulation, or a log. Never changes that flight.

use crate::crewed::{CrewedFlight, FlightError};
use ringwing_programs::ProgramError;
use ringwing_recorder::metrics::{Deviation, Deviations, Frame};
use ringwing_scenario::Scenario;
use ringwing_simulation::Frames;

/// Measures a flight against its undisturbed self.
pub struct Baseline {
    undisturbed: CrewedFlight,
    /// Why the baseline ends early, if it does.
    failure: Option<ProgramError>,
    frames: Frames,
    deviations: Deviations,
}

impl Baseline {
    /// The baseline of a flight of `scenario`, which has been validated, before its first tick.
    ///
    /// # Errors
    /// As [`fly`](crate::flight::fly).
    pub fn new(scenario: &Scenario) -> Result<Self, FlightError> {
        let quiet = Scenario { faults: Vec::new(), ..scenario.clone() };
        Ok(Self {
            undisturbed: CrewedFlight::begin(&quiet)?,
            failure: None,
            frames: Frames::new(&quiet),
            deviations: Deviations::new(scenario.formation.uavs, scenario.time.rate_hz),
        })
    }

    /// Takes the next frame of the flight, and returns that of the undisturbed flight in the same tick; `None` after its
    /// end. A log may lack ticks; what is missing there is not compared.
    pub fn observe(&mut self, flown: &Frame) -> Option<&Frame> {
        while self.undisturbed.simulation().flown().is_none_or(|tick| tick.0 < flown.tick) && self.goes_on() {
        }
        let undisturbed = Some(self.frames.latest()).filter(|frame| frame.tick == flown.tick)?;
        self.deviations.observe(flown, undisturbed);
        Some(undisturbed)
    }

    /// Flies the next tick of the undisturbed flight. Returns whether there is one after it.
    fn goes_on(&mut self) -> bool {
        if self.failure.is_some() {
            return false;
        }
        let stepped = self.undisturbed.step();
        self.frames.take(self.undisturbed.simulation());
        stepped.unwrap_or_else(|failure| {
            self.failure = Some(failure);
            false
        })
    }

    /// What the faults have cost.
    ///
    /// # Errors
    /// A program of the user's has failed in the undisturbed flight.
    pub fn finish(self) -> Result<Deviation, FlightError> {
        match self.failure {
            Some(failure) => Err(failure.into()),
            None => Ok(self.deviations.summary()),
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::flight::{Outcome, fly, fly_beside_baseline};
    use ringwing_scenario::{Scenario, Setting, Source};

    /// A flight of the resilient law under the faults of `sentences`.
    fn flown(duration_s: f64, sentences: &[&str]) -> Outcome {
        fly_beside_baseline(&scenario(duration_s, sentences)).unwrap()
    }

    fn scenario(duration_s: f64, sentences: &[&str]) -> Scenario {
        let law = Setting::parse("control.law=resilient").unwrap();
        let mut scenario = Scenario::read(&Source::find("dropout").unwrap(), &[law]).unwrap();
        scenario.time.duration_s = duration_s;
        scenario.faults = sentences.iter().map(|text| text.parse().unwrap()).collect();
        scenario
    }

    #[test]
    fn a_flight_without_faults_deviates_by_nothing() {
        let cost = flown(5.0, &[]).deviation.unwrap();
        assert_eq!((cost.peak_m, cost.area_m_s, cost.back_s), (Some(0.0), 0.0, Some(0.0)));
    }

    #[test]
    fn a_freeze_takes_the_uav_and_its_neighbours_off_their_course_and_all_come_back() {
        let cost = flown(60.0, &["at 25 s freeze uav 3 for 3 s"]).deviation.unwrap();
        // The ring closes and opens again. The frozen UAV comes back from farther away, because its failsafe has led it out of the
        // formation.
        let peak_m = |uav: usize| cost.uavs[uav - 1].peak_m.unwrap();
        assert!([1, 2, 4, 5, 6].iter().all(|other| peak_m(*other) < peak_m(3)), "{cost:?}");
        let back_s = cost.back_s.unwrap();
        assert!(peak_m(3) > 5.0 && back_s > 1.0 && back_s < 30.0, "{cost:?}");
        assert!(
            cost.uavs.iter().all(|uav| uav.left_s.unwrap() > 25.0),
            "no deviation before the fault: {cost:?}"
        );
    }

    #[test]
    fn a_loss_that_closes_the_ring_moves_the_others_for_good() {
        let cost = flown(45.0, &["at 25 s kill uav 3"]).deviation.unwrap();
        assert_eq!(cost.back_s, None);
        assert!(cost.uavs.iter().all(|uav| uav.left_s.is_none_or(|left_s| left_s >= 25.0)), "{cost:?}");
        assert!(cost.peak_m.unwrap() > 1.0 && cost.area_m_s > 10.0, "{cost:?}");
    }

    #[test]
    fn the_baseline_changes_nothing_about_the_flight() {
        let scenario = scenario(30.0, &["at 25 s freeze uav 3 for 3 s"]);
        let (beside, alone) = (fly_beside_baseline(&scenario).unwrap(), fly(&scenario).unwrap());
        assert_eq!(beside.payload_hash(), alone.payload_hash());
        assert_eq!((beside.summary, alone.deviation), (alone.summary, None));
    }

    #[test]
    fn a_flight_whose_world_ends_is_measured_up_to_there() {
        let cost = flown(30.0, &["at 2 s freeze uav 3 for 1 s", "at 5 s kill world"]).deviation.unwrap();
        assert!(cost.peak_m.unwrap() > 0.0 && cost.uavs.iter().all(|uav| uav.peak_time_s < Some(5.0)));
    }
}
