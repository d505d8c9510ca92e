//! How well the agents know where their UAVs are, over the second half of the flight.
//!
//! Never measures a flight in which every agent knows that to the bit: with perfect senses there is nothing to estimate.

use super::Frame;
use ringwing_scenario::Scenario;

/// Sums up the errors of the agents' estimates of their own positions.
#[derive(Debug, Clone)]
pub(super) struct EstimationWatch {
    /// The first tick of the second half.
    begin: i64,
    squares_m2: f64,
    count: u64,
    /// Whether any estimate was not the truth, at any time.
    has_errors: bool,
}

impl EstimationWatch {
    pub(super) fn new(scenario: &Scenario) -> Self {
        Self { begin: scenario.last_tick() / 2, squares_m2: 0.0, count: 0, has_errors: false }
    }

    /// Takes the next frame: the UAVs that fly on command.
    pub(super) fn observe(&mut self, frame: &Frame) {
        for uav in frame.uavs.iter().filter(|uav| uav.commanded().is_some()) {
            let Some(error_m) = uav.estimate_error_m().filter(|error_m| error_m.is_finite()) else {
                continue;
            };
            self.has_errors |= uav.control.is_some_and(|control| control.estimate.is_some());
            if frame.tick >= self.begin {
                self.squares_m2 += error_m * error_m;
                self.count += 1;
            }
        }
    }

    /// The root mean square so far; `None` before the second half, and without any error.
    pub(super) fn rms_m(&self) -> Option<f64> {
        (self.has_errors && self.count > 0).then(|| (self.squares_m2 / self.count as f64).sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing;
    use nalgebra::Vector2;

    #[test]
    fn only_errors_of_the_second_half_count_and_without_any_there_is_no_figure() {
        let mut scenario = testing::ring_of(3, 40.0);
        (scenario.time.duration_s, scenario.time.rate_hz) = (10.0, 1);
        let mut watch = EstimationWatch::new(&scenario);
        for tick in 0..6 {
            watch.observe(&testing::at_rest(&scenario, tick));
        }
        assert_eq!(watch.rms_m(), None, "every agent knows where its UAV is");
        let mut frame = testing::at_rest(&scenario, 4);
        let mut put_off = |frame: &mut Frame, error_m: f64| {
            let mut pose = frame.uavs[0].state.unwrap().pose();
            pose.position += Vector2::new(error_m, 0.0);
            frame.uavs[0].control.as_mut().unwrap().estimate = Some(pose);
            watch.observe(frame);
        };
        put_off(&mut frame, 100.0);
        frame.tick = 6;
        put_off(&mut frame, 3.0);
        // Three UAVs in the ticks 5 and 6.
        assert!((watch.rms_m().unwrap() - (9.0_f64 / 6.0).sqrt()).abs() < 1e-12);
    }

    #[test]
    fn a_flight_that_ends_in_its_first_half_has_no_figure() {
        let scenario = testing::ring_of(3, 40.0);
        let mut watch = EstimationWatch::new(&scenario);
        let mut frame = testing::at_rest(&scenario, 0);
        frame.uavs[0].control.as_mut().unwrap().estimate = Some(frame.uavs[1].state.unwrap().pose());
        watch.observe(&frame);
        assert_eq!(watch.rms_m(), None);
    }
}
