//! Wind and gusts: what every UAV flies then, and how well the formation is kept.

use crate::support::{Flight, at_rest, preset, scenario, with_faults};
use nalgebra::Vector2;
use ringwing_scenario::{PathKind, Scenario};
use ringwing_simulation::fly;

/// Six UAVs that start in their slots under `law`, in a wind of 6 m/s from the north, across the leader's way.
fn across(law: &str) -> Scenario {
    let mut scenario = at_rest(scenario(law, &[]));
    (scenario.wind.mean_speed_m_s, scenario.wind.from_deg) = (6.0, 90.0);
    scenario
}

/// The largest slot error from 60 s to 80 s.
fn standing_error_m(scenario: &Scenario) -> f64 {
    let mut flight = Flight::new(scenario);
    flight.fly(60.0, |_| ());
    let mut largest_m: f64 = 0.0;
    flight.fly(20.0, |flight| largest_m = largest_m.max(flight.slot_error_max_m()));
    largest_m
}

fn hash(scenario: &Scenario) -> String {
    let scenario = Scenario {
        time: ringwing_scenario::TimeSection { duration_s: 20.0, ..scenario.time.clone() },
        ..scenario.clone()
    };
    fly(&scenario).unwrap().report.unwrap().payload_hash
}

#[test]
fn in_a_steady_wind_every_uav_flies_the_wind_triangle() {
    let mut flight = Flight::new(&across("resilient"));
    flight.fly(60.0, |_| ());
    for number in 1..=6 {
        let state = *flight.frame().commanded(number).unwrap();
        // 15 m/s to the east over the ground, while the air moves at 6 m/s to the south.
        let airspeed_m_s = 15_f64.hypot(6.0);
        assert!((state.speed_m_s - airspeed_m_s).abs() < 1e-6, "uav {number}: {}", state.speed_m_s);
        assert!((state.heading_rad - 6_f64.atan2(15.0)).abs() < 1e-6, "uav {number}: {}", state.heading_rad);
        assert!(
            (state.velocity_m_s() - Vector2::new(15.0, 0.0)).norm() < 1e-6 && state.course_rad().abs() < 1e-6
        );
        assert!(state.slot_error_m.unwrap() < 1e-6, "uav {number}");
        let estimate = flight.account(number).unwrap().wind_m_s;
        assert!((Vector2::from(estimate) - Vector2::new(0.0, -6.0)).norm() < 1e-6, "{estimate:?}");
    }
}

#[test]
fn a_steady_wind_leaves_no_error_whether_it_is_told_or_estimated_also_with_late_data() {
    for (known, estimated) in [(true, false), (false, true), (true, true)] {
        let mut scenario = across("resilient");
        (scenario.wind.known, scenario.control.wind_estimated) = (known, estimated);
        let error_m = standing_error_m(&scenario);
        assert!(error_m < 1e-6, "known {known}, estimated {estimated}: {error_m}");
    }
    for faults in [["at 0 s link all delay 300 ms"], ["at 0 s link own->all delay 300 ms"]] {
        let error_m = standing_error_m(&with_faults(across("resilient"), &faults));
        assert!(error_m < 1e-6, "{faults:?}: {error_m}");
    }
}

#[test]
fn a_swarm_that_takes_moving_air_for_still_is_off_by_metres() {
    let mut unaware = across("resilient");
    unaware.control.wind_estimated = false;
    for (law, scenario) in [("resilient", unaware), ("paper", across("paper"))] {
        let error_m = standing_error_m(&scenario);
        assert!((1.0..20.0).contains(&error_m), "{law}: {error_m}");
    }
}

#[test]
fn in_a_turn_the_wind_comes_from_all_sides_and_the_error_stays_small() {
    let mut scenario = across("resilient");
    scenario.wind.mean_speed_m_s = 2.5;
    scenario.leader.path.kind = PathKind::Circle;
    let error_m = standing_error_m(&scenario);
    assert!(error_m < 0.1, "{error_m}");
}

#[test]
fn still_air_is_flown_to_the_same_bits_whatever_is_said_of_the_wind() {
    let mut still = across("resilient");
    still.wind.mean_speed_m_s = 0.0;
    let mut told = still.clone();
    (told.wind.known, told.wind.height_m, told.control.wind_time_s) = (true, 20.0, 3.0);
    let mut unaware = still.clone();
    unaware.control.wind_estimated = false;
    let expected = hash(&still);
    assert_eq!([hash(&told), hash(&unaware)], [expected.clone(), expected.clone()]);
    assert_ne!(hash(&across("resilient")), expected);
}

#[test]
fn in_gusts_the_estimate_keeps_the_formation_where_the_mean_wind_alone_does_not() {
    let keeping_m =
        |settings: &[&str]| fly(&preset("gusts", settings)).unwrap().summary.keeping_error_rms_m.unwrap();
    let estimated_m = keeping_m(&[]);
    let told_m = keeping_m(&["control.wind_estimated=false", "wind.known=true"]);
    assert!(estimated_m < 1.0 && told_m > 1.5 * estimated_m, "{estimated_m} m; {told_m} m");
}

#[test]
fn a_uav_that_is_lost_in_gusts_drifts_away_and_the_ring_closes() {
    let mut flight = Flight::new(&preset("gusts", &[]));
    flight.fly(40.0, |_| ());
    flight.kill(&[3]);
    flight.fly(40.0, |_| ());
    assert_eq!(flight.moment().commanded, 5);
    assert!(flight.slot_error_max_m() < 4.0 && flight.all_agree_with_the_truth());
}
