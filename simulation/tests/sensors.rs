//! Sensors with errors: what the estimate of the own pose is worth, and what a sensor does that drifts.

use crate::support::{Flight, at_rest, preset, scenario, with_faults};
use nalgebra::{Point2, Vector2};
use ringwing_scenario::Scenario;
use ringwing_simulation::{Flown, fly};

fn flown(settings: &[&str]) -> Flown {
    fly(&preset("sensors", settings)).unwrap()
}

fn hash(scenario: &Scenario) -> String {
    fly(scenario).unwrap().report.unwrap().payload_hash
}

/// Six UAVs with perfect sensors that start in their slots.
fn resting(faults: &[&str]) -> Scenario {
    with_faults(at_rest(scenario("resilient", &[])), faults)
}

#[test]
fn the_estimate_keeps_the_formation_better_than_the_bare_readings() {
    let with = flown(&[]);
    assert_eq!(with.violations, [""; 0]);
    let without = flown(&["control.pose_estimated=false"]);
    let of = |flown: &Flown| {
        [flown.summary.keeping_error_rms_m, flown.summary.estimate_error_rms_m].map(Option::unwrap)
    };
    let ([with_m, estimate_m], [without_m, reading_m]) = (of(&with), of(&without));
    assert!(with_m < 2.5 && without_m > 1.2 * with_m, "{with_m} m with and {without_m} m without");
    assert!(estimate_m < 2.0 && estimate_m < reading_m, "{estimate_m} m; {reading_m} m");
}

#[test]
fn a_flight_with_sensors_repeats_and_its_seed_decides_every_error() {
    let short = |seed: &str| preset("sensors", &["time.duration_s=10", seed]);
    assert_eq!(hash(&short("seed=1")), hash(&short("seed=1")));
    assert_ne!(hash(&short("seed=1")), hash(&short("seed=2")));
}

#[test]
fn perfect_sensors_are_flown_to_the_same_bits_with_and_without_the_estimate() {
    let short = |settings: &[&str]| hash(&preset("gusts", &[settings, &["time.duration_s=10"]].concat()));
    let expected = short(&[]);
    assert_eq!(short(&["control.pose_estimated=false", "sensors.position_bias_time_s=5"]), expected);
    assert_ne!(short(&["sensors.heading_noise_deg=0.1"]), expected);
}

#[test]
fn dead_reckoning_carries_a_uav_through_a_long_dropout_and_bare_readings_do_not() {
    let error_m = |settings: &[&str]| {
        let mut scenario = preset("sensors", &[&["sensors.position_bias_m=0"], settings].concat());
        scenario.wind.turbulence_m_s = 0.0;
        scenario.sensors.position_dropout = 0.3;
        scenario.sensors.position_dropout_s = 3.0;
        fly(&scenario).unwrap().summary.estimate_error_rms_m.unwrap()
    };
    let (with_m, without_m) = (error_m(&[]), error_m(&["control.pose_estimated=false"]));
    assert!(with_m < 5.0 && without_m > 10.0, "{with_m} m; {without_m} m");
}

#[test]
fn a_uav_whose_position_drifts_flies_as_far_off_the_other_way_and_returns_when_it_is_healed() {
    let mut flight =
        Flight::new(&resting(&["at 10 s drift uav 3 position at 0.5 m/s toward 90 deg for 20 s"]));
    flight.fly(30.0, |_| ());
    let uav = flight.frame().uavs[2];
    let (state, control) = (uav.state.unwrap(), uav.control.unwrap());
    // Its agent believes that it is in its slot: 10 m to the north of where it is.
    let off = control.estimate.unwrap().position - state.position();
    assert!((off - Vector2::new(0.0, 9.995)).norm() < 0.01, "{off}");
    let slot = Point2::from(state.slot_m.unwrap());
    let away = state.position() - slot;
    assert!(away.x.abs() < 0.5 && (-10.5..-9.0).contains(&away.y), "{away}");
    // Its neighbours believe what it says, and stay where they are.
    assert!(flight.frame().commanded(2).unwrap().slot_error_m.unwrap() < 0.5);
    flight.fly(30.0, |_| ());
    assert!(flight.slot_error_max_m() < 0.05, "{}", flight.slot_error_max_m());
    let effects = flight.finish().summary.fault_effects;
    assert_eq!((effects.asked, effects.acted), (1, 1));
}

#[test]
fn a_heading_that_drifts_turns_the_uav_off_its_course_and_the_others_fly_on() {
    let mut flight = Flight::new(&resting(&["at 10 s drift uav 3 heading at 1 deg/s for 20 s"]));
    flight.fly(30.0, |_| ());
    let state = *flight.frame().commanded(3).unwrap();
    let measured_rad = state.measured.unwrap().heading_rad;
    assert!((measured_rad - state.heading_rad - 20_f64.to_radians()).abs() < 0.1_f64.to_radians());
    // The slot's pull holds it at some distance.
    assert!((0.2..20.0).contains(&state.slot_error_m.unwrap()), "{:?}", state.slot_error_m);
    flight.fly(30.0, |_| ());
    assert!(flight.slot_error_max_m() < 0.05, "{}", flight.slot_error_max_m());
}

#[test]
fn a_drift_of_the_position_misleads_the_estimate_as_well() {
    let mut scenario = preset("sensors", &[]);
    scenario.sensors.position_bias_m = 0.0;
    let scenario = with_faults(scenario, &["at 40 s drift uav 3 position at 0.5 m/s toward 90 deg"]);
    let mut flight = Flight::new(&scenario);
    flight.fly(60.0, |_| ());
    let error_m = flight.frame().uavs[2].estimate_error_m().unwrap();
    assert!(
        (8.0..12.0).contains(&error_m),
        "a filter cannot tell a spoofed receiver from the wind: {error_m}"
    );
}
