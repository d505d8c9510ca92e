//! Airframes that take their time or break: what the swarm makes of that.

use crate::support::{Flight, at_rest, preset, scenario, with_faults};
use ringwing_scenario::Scenario;
use ringwing_simulation::fly;

/// Six UAVs that start in their slots.
fn resting(faults: &[&str]) -> Scenario {
    with_faults(at_rest(scenario("resilient", &[])), faults)
}

#[test]
fn a_lag_of_the_speed_costs_time_and_no_error() {
    for law in ["paper", "resilient"] {
        let law = format!("control.law={law}");
        let settled_s = |lag: &str| {
            let flown = fly(&preset("paper-4.1", &[&law, lag])).unwrap().summary;
            assert!(flown.slot_error_max_m.unwrap() < 1e-6, "{law}, {lag}: {:?}", flown.slot_error_max_m);
            flown.settling_s.unwrap()
        };
        let (at_once_s, slowly_s) =
            (settled_s("airframe.speed_lag_s=0.0"), settled_s("airframe.speed_lag_s=1.0"));
        assert!((2.0..6.0).contains(&(slowly_s - at_once_s)), "{law}: {at_once_s} s and {slowly_s} s");
    }
}

#[test]
fn a_lag_of_the_turn_rate_makes_a_stiff_formation_swing_and_a_softer_one_not() {
    let keeping_m = |lag: &str, gain: &str| {
        let settings = ["control.law=resilient", lag, gain];
        fly(&preset("paper-4.1", &settings)).unwrap().summary.keeping_error_rms_m.unwrap()
    };
    let (stiff, soft) = ("control.formation_gain=2.0", "control.formation_gain=0.5");
    assert!(keeping_m("airframe.turn_lag_s=0.1", stiff) < 1e-6);
    let (swings_m, rests_m) =
        (keeping_m("airframe.turn_lag_s=0.3", stiff), keeping_m("airframe.turn_lag_s=0.3", soft));
    assert!(swings_m > 1.0 && rests_m < 1e-6, "{swings_m} m and {rests_m} m");
}

#[test]
fn a_uav_whose_airframe_is_too_weak_falls_behind_and_catches_up_when_it_is_whole() {
    let mut flight = Flight::new(&resting(&["at 10 s weaken uav 3 to 13 m/s for 10 s"]));
    flight.fly(20.0, |_| ());
    // The leader flies 15 m/s, so it loses nearly 2 m/s for 10 s. Its neighbours wait for it a little.
    let behind_m = flight.frame().commanded(3).unwrap().slot_error_m.unwrap();
    assert!((15.0..20.5).contains(&behind_m), "{behind_m}");
    assert!((flight.frame().commanded(3).unwrap().speed_m_s - 13.0).abs() < 1e-12);
    flight.fly(40.0, |_| ());
    assert!(flight.slot_error_max_m() < 0.05, "{}", flight.slot_error_max_m());
    let effects = flight.finish().summary.fault_effects;
    assert_eq!((effects.asked, effects.acted), (1, 1));
}

#[test]
fn a_uav_whose_turn_is_jammed_circles_away_and_the_others_keep_clear_and_return() {
    let mut scenario = resting(&["at 10 s jam uav 3 turn at 5 deg/s for 12 s"]);
    scenario.control.collision_filter = true;
    let mut flight = Flight::new(&scenario);
    let mut turned = 0.0;
    flight.fly(22.0, |flight| {
        turned += flight.frame().commanded(3).map_or(0.0, |state| state.turn_rate_rad_s) / 100.0;
    });
    assert!((turned.to_degrees() - 60.0).abs() < 0.2, "{}", turned.to_degrees());
    flight.fly(60.0, |_| ());
    assert!(flight.slot_error_max_m() < 0.05, "{}", flight.slot_error_max_m());
    let flown = flight.finish();
    assert!(flown.summary.closest_pair.unwrap().distance_m > 8.0, "{:?}", flown.summary.closest_pair);
}
