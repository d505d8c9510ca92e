//! A UAV's estimate of the wind: the mean wind that it is told, what its own drift shows, or what the filter of its own pose finds.
//!
//! Between two of its positions, a UAV has come as far as it flew through the air and the air carried it. The difference to
//! the arc that speed and heading make is a sample of the wind, and a low-pass filter takes the noise out of the samples. The
//! estimate is that of mean wind and gusts together.
//!
//! Never knows more than the UAV senses of itself. In a scenario without wind it is zero, so that the flight keeps its bits.

use nalgebra::Vector2;
use ringwing_flight::{Pose, Sensed, Tick, wrap};
use ringwing_scenario::Scenario;

/// Positions farther apart than this are not compared: nobody knows how fast the UAV flew in between. A longer time uses more
/// of the senses on a bad link, and takes changes of speed for wind.
const LONGEST_GAP_S: f64 = 0.5;

/// One UAV's estimate of the wind.
#[derive(Debug, Clone)]
pub(super) struct WindEstimate {
    wind_m_s: Vector2<f64>,
    is_estimated: bool,
    /// `None` in still air, and for a UAV that does not estimate the wind from its drift.
    filter: Option<DriftFilter>,
}

/// The filter of the samples.
#[derive(Debug, Clone)]
struct DriftFilter {
    time_s: f64,
    period_s: f64,
    last: Option<(Tick, Pose)>,
    /// For how long there have been samples.
    heard_s: f64,
}

impl WindEstimate {
    /// What a UAV of `scenario` knows of the wind at first.
    pub(super) fn new(scenario: &Scenario) -> Self {
        let wind = &scenario.wind;
        let is_estimated = scenario.control.wind_estimated;
        let filter = DriftFilter {
            time_s: scenario.control.wind_time_s,
            period_s: scenario.period_s(),
            last: None,
            // The mean wind counts as an average of the past, so that the first gust does not replace it.
            heard_s: if wind.known { scenario.control.wind_time_s } else { 0.0 },
        };
        Self {
            wind_m_s: if wind.known { wind.mean_m_s() } else { Vector2::zeros() },
            is_estimated,
            filter: (is_estimated && !wind.is_still()).then_some(filter),
        }
    }

    /// Takes in what the UAV senses; the samples come in order of their ticks.
    pub(super) fn observe(&mut self, senses: &Sensed) {
        let Some(filter) = &mut self.filter else { return };
        if let Some((sample_m_s, share)) = filter.sample(senses) {
            self.wind_m_s += (sample_m_s - self.wind_m_s) * share;
        }
    }

    /// Takes over the wind that the filter of the UAV's own pose has found. It stands for errors of the sensors as well, so it is used in
    /// still air, too.
    pub(super) fn take(&mut self, wind_m_s: Vector2<f64>) {
        if self.is_estimated {
            self.wind_m_s = wind_m_s;
        }
    }

    /// The velocity of the air, in m/s.
    pub(super) fn wind_m_s(&self) -> Vector2<f64> {
        self.wind_m_s
    }
}

impl DriftFilter {
    /// The wind since the last senses, and the share with which it counts.
    fn sample(&mut self, senses: &Sensed) -> Option<(Vector2<f64>, f64)> {
        let pose = Pose { position: senses.position_m.into(), heading_rad: senses.heading_rad };
        let (tick, before) = self.last.replace((senses.tick, pose))?;
        let gap_s = senses.tick.since(tick) as f64 * self.period_s;
        if gap_s > LONGEST_GAP_S {
            return None;
        }
        let turn_rate_rad_s = wrap(pose.heading_rad - before.heading_rad) / gap_s;
        let through_the_air = before.after(senses.speed_m_s, turn_rate_rad_s, gap_s);
        let sample_m_s = (pose.position - through_the_air.position) / gap_s;
        self.heard_s += gap_s;
        // At first, the plain mean of all samples: a filter that begins at zero would take long to reach the wind.
        let share = (-libm::expm1(-gap_s / self.time_s)).max(gap_s / self.heard_s);
        Some((sample_m_s, share))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point2;
    use ringwing_flight::{FlightMode, SensedObstacle, UavId, payload::MAX_SENSED_OBSTACLES};

    fn scenario(known: bool, estimated: bool) -> Scenario {
        let mut scenario = Scenario::default();
        (scenario.wind.mean_speed_m_s, scenario.wind.from_deg, scenario.wind.known) = (6.0, 180.0, known);
        scenario.control.wind_estimated = estimated;
        scenario
    }

    fn senses(tick: i64, pose: &Pose, turn_rate_rad_s: f64) -> Sensed {
        Sensed {
            tick: Tick(tick),
            position_m: pose.position.into(),
            heading_rad: pose.heading_rad,
            speed_m_s: 15.0,
            turn_rate_rad_s,
            uav: UavId(1),
            mode: FlightMode::COMMANDED,
            obstacle_count: 0,
            obstacles_omitted: 0,
            obstacles: [SensedObstacle::default(); MAX_SENSED_OBSTACLES],
            position_age_ticks: 0,
            heading_age_ticks: 0,
        }
    }

    /// The estimate of a UAV that circles in `wind_m_s(tick)` and senses every `every` ticks of 0.01 s.
    fn estimated(
        scenario: &Scenario,
        ticks: i64,
        every: i64,
        wind_m_s: impl Fn(i64) -> Vector2<f64>,
    ) -> Vector2<f64> {
        let mut estimate = WindEstimate::new(scenario);
        let mut pose = Pose { position: Point2::new(5.0, -3.0), heading_rad: 1.0 };
        for tick in 0..ticks {
            if tick % every == 0 {
                estimate.observe(&senses(tick, &pose, 0.3));
            }
            pose = pose.after(15.0, 0.3, 0.01);
            pose.position += wind_m_s(tick) * 0.01;
        }
        estimate.wind_m_s()
    }

    #[test]
    fn a_steady_wind_is_known_after_two_positions_also_if_senses_are_missing() {
        let wind = Vector2::new(4.0, -2.0);
        for (ticks, every) in [(2, 1), (300, 1), (300, 7), (300, 50)] {
            let found = estimated(&scenario(false, true), ticks, every, |_| wind);
            assert!((found - wind).norm() < 1e-9, "{ticks} ticks, every {every}: {found}");
        }
    }

    #[test]
    fn a_change_of_the_wind_is_followed_like_a_first_order_lag() {
        let step = |tick| if tick < 1000 { Vector2::zeros() } else { Vector2::new(3.0, 0.0) };
        // One time constant of 0.5 s after the change.
        let found = estimated(&scenario(false, true), 1051, 1, step);
        assert!((found.x - 3.0 * (1.0 - (-1.0_f64).exp())).abs() < 1e-9, "{found}");
    }

    #[test]
    fn without_an_estimate_a_uav_knows_what_it_is_told() {
        let blows = |_| Vector2::new(9.0, 9.0);
        assert_eq!(estimated(&scenario(false, false), 100, 1, blows), Vector2::zeros());
        assert!((estimated(&scenario(true, false), 100, 1, blows) - Vector2::new(6.0, 0.0)).norm() < 1e-9);
    }

    #[test]
    fn positions_too_far_apart_say_nothing() {
        assert_eq!(estimated(&scenario(false, true), 300, 51, |_| Vector2::new(4.0, 0.0)), Vector2::zeros());
    }

    #[test]
    fn in_still_air_nothing_is_estimated() {
        let mut still = scenario(false, true);
        still.wind.mean_speed_m_s = 0.0;
        assert_eq!(estimated(&still, 100, 1, |_| Vector2::new(4.0, 0.0)), Vector2::zeros());
    }
}
