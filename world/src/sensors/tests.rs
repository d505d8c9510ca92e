use super::*;

const UAV: UavId = UavId(3);

/// A flight at 100 Hz with these sensors.
fn scenario(change: impl FnOnce(&mut SensorsSection)) -> Scenario {
    let mut scenario = Scenario::default();
    change(&mut scenario.sensors);
    scenario
}

fn sensors(scenario: &Scenario) -> Sensors {
    Sensors::new(scenario, UAV, &at(0.0)).unwrap()
}

/// A UAV at this place on the x axis, which heads north.
fn at(x_m: f64) -> Pose {
    Pose { position: Point2::new(x_m, 0.0), heading_rad: std::f64::consts::FRAC_PI_2 }
}

/// What `read` makes of the sensors in each of `ticks` ticks of a UAV that stands still.
fn series<T>(scenario: &Scenario, ticks: i64, read: impl Fn(&Sensors, Tick) -> T) -> Vec<T> {
    let mut sensors = sensors(scenario);
    let each = |tick| {
        sensors.advance(Tick(tick), &at(0.0));
        read(&sensors, Tick(tick))
    };
    (0..ticks).map(each).collect()
}

fn mean(values: impl Iterator<Item = f64> + Clone) -> f64 {
    values.clone().sum::<f64>() / values.count() as f64
}

#[test]
fn perfect_sensors_are_none() {
    assert_eq!(Sensors::new(&Scenario::default(), UAV, &at(0.0)), None);
}

#[test]
fn noise_has_its_variance_and_no_memory() {
    let noisy = scenario(|sensors| {
        sensors.position_noise_m = 2.0;
        sensors.heading_noise_deg = 3.0;
        sensors.airspeed_noise_m_s = 0.5;
        sensors.turn_rate_noise_rad_s = 0.01;
    });
    let errors = series(&noisy, 40_000, |sensors, now| {
        let Pose { position, heading_rad } = sensors.pose();
        let (speed_m_s, turn_rate_rad_s) = sensors.rates(now, (20.0, 0.1));
        [position.x, position.y, heading_rad - at(0.0).heading_rad, speed_m_s - 20.0, turn_rate_rad_s - 0.1]
    });
    for (place, deviation) in [2.0, 2.0, 3_f64.to_radians(), 0.5, 0.01].into_iter().enumerate() {
        let of = |error: &[f64; 5]| error[place] / deviation;
        // The standard errors of these means are 0.005, 0.007 and 0.005.
        assert!(mean(errors.iter().map(of)).abs() < 0.02, "{place}");
        assert!((mean(errors.iter().map(|error| of(error).powi(2))) - 1.0).abs() < 0.03, "{place}");
        assert!(mean(errors.windows(2).map(|two| of(&two[0]) * of(&two[1]))).abs() < 0.02, "{place}");
    }
}

#[test]
fn a_bias_has_its_variance_at_all_times_and_wanders_away_as_fast_as_its_time_says() {
    // One bias wanders for one time constant; many of them make the statistics.
    let apart = |seed: u64| {
        let mut one =
            scenario(|sensors| (sensors.position_bias_m, sensors.position_bias_time_s) = (1.5, 2.0));
        one.seed = seed;
        let places = series(&one, 201, |sensors, _| sensors.pose().position.x);
        [places[0], places[20], places[200]]
    };
    let all: Vec<[f64; 3]> = (0..4000).map(apart).collect();
    for moment in 0..3 {
        let variance_m2 = mean(all.iter().map(|one| one[moment] * one[moment]));
        assert!((variance_m2 / 2.25 - 1.0).abs() < 0.08, "{variance_m2}");
    }
    // The variance of a step of t is 2 s^2 (1 - e^(-t / T)): at first it grows with the time, as that of a random walk.
    for (later, lengths) in [(1, 0.1), (2, 1.0)] {
        let expected_m2 = 2.0 * 2.25 * (1.0 - f64::exp(-lengths));
        let variance_m2 = mean(all.iter().map(|one| (one[later] - one[0]).powi(2)));
        assert!((variance_m2 / expected_m2 - 1.0).abs() < 0.08, "{lengths}: {variance_m2} m2");
    }
}

#[test]
fn the_bias_of_a_heading_wanders_and_those_of_the_rates_stay() {
    let biased = scenario(|sensors| {
        sensors.heading_bias_deg = 5.0;
        sensors.airspeed_bias_m_s = 0.5;
        sensors.turn_rate_bias_rad_s = 0.01;
    });
    let readings =
        series(&biased, 3000, |sensors, now| (sensors.pose().heading_rad, sensors.rates(now, (20.0, 0.0))));
    assert!((readings[0].0 - readings[2999].0).abs() > 1e-3);
    let rates = readings[0].1;
    assert!(rates.0 != 20.0 && rates.1 != 0.0 && readings.iter().all(|reading| reading.1 == rates));
}

#[test]
fn a_value_is_held_until_the_next_reading_and_has_its_age() {
    let slow = scenario(|sensors| (sensors.position_rate_hz, sensors.heading_rate_hz) = (10.0, 40.0));
    let mut sensors = sensors(&slow);
    for tick in 0..200 {
        sensors.advance(Tick(tick), &at(tick as f64));
        let held = tick / 10 * 10;
        assert_eq!(sensors.pose().position.x, held as f64, "{tick}");
        // 40 Hz at 100 Hz: two readings in five ticks, in the first and the fourth of them.
        let heading_age = [0, 1, 2, 0, 1][tick as usize % 5];
        assert_eq!(sensors.ages_ticks(Tick(tick)), [(tick - held) as u32, heading_age], "{tick}");
    }
}

#[test]
fn as_many_fixes_fail_as_asked_for_and_for_as_long() {
    for (share, dropout_s, row_s) in [(0.2, 0.0, 0.125), (0.2, 1.5, 1.5), (0.5, 0.7, 0.7)] {
        let failing = scenario(|sensors| {
            sensors.position_rate_hz = 10.0;
            (sensors.position_dropout, sensors.position_dropout_s) = (share, dropout_s);
        });
        let is_failed = series(&failing, 400_000, |sensors, now| sensors.ages_ticks(now)[0] >= 10);
        let fixes: Vec<bool> = is_failed.into_iter().step_by(10).collect();
        let failed = fixes.iter().filter(|failed| **failed).count() as f64;
        let rows = fixes.windows(2).filter(|two| !two[0] && two[1]).count() as f64;
        assert!((failed / fixes.len() as f64 / share - 1.0).abs() < 0.12, "{share} {dropout_s}: {failed}");
        assert!((failed / rows / 10.0 / row_s - 1.0).abs() < 0.12, "{share} {dropout_s}: {failed} in {rows}");
    }
}

#[test]
fn readings_repeat_for_a_seed_and_differ_between_uavs_and_no_key_changes_another_sensor() {
    let noisy = scenario(|sensors| (sensors.position_noise_m, sensors.heading_noise_deg) = (1.0, 1.0));
    let read = |scenario: &Scenario| series(scenario, 20, |sensors, _| sensors.pose());
    assert_eq!(read(&noisy), read(&noisy));
    let other_seed = Scenario { seed: 2, ..noisy.clone() };
    let other_uav = Sensors::new(&noisy, UavId(4), &at(0.0)).unwrap();
    assert!(read(&noisy) != read(&other_seed) && other_uav.pose() != sensors(&noisy).pose());
    let mut failing = noisy.clone();
    failing.sensors.heading_noise_deg = 0.0;
    failing.sensors.position_dropout = 0.3;
    let whole = read(&noisy);
    let same =
        read(&failing).iter().zip(&whole).filter(|(one, other)| one.position == other.position).count();
    assert!((8..20).contains(&same), "fixes that do not fail have the same errors: {same}");
}

#[test]
fn a_drift_grows_with_time_and_is_gone_when_it_ends() {
    let fault =
        |failure| AirframeFault { number: 1, uav: UAV, begin: Tick(100), end: Some(Tick(300)), failure };
    let faults = [
        fault(AirframeFailure::Drifting(SensorDrift::Position {
            speed_m_s: 0.5,
            toward_rad: std::f64::consts::PI,
        })),
        fault(AirframeFailure::Drifting(SensorDrift::Heading { rate_rad_s: 0.1 })),
        fault(AirframeFailure::Weak(14.0)),
    ];
    let seen = |uav, tick| drifted(&at(7.0), &faults, uav, Tick(tick), 0.01);
    assert!(
        [99, 100, 300].into_iter().all(|tick| seen(UAV, tick) == at(7.0)) && seen(UavId(4), 200) == at(7.0)
    );
    let drifted = seen(UAV, 200);
    assert!((drifted.position - Point2::new(6.5, 0.0)).norm() < 1e-12, "{drifted:?}");
    assert!((drifted.heading_rad - at(0.0).heading_rad - 0.1).abs() < 1e-12, "{drifted:?}");
}
