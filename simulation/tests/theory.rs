//! What the paper proves, shown in flights of its law.

use crate::support::{Flight, preset};
use proptest::prelude::*;
use ringwing_flight::wrap;
use ringwing_scenario::{Scenario, StartState};

/// Displacement of a UAV from its slot, in metres, and its heading's deviation from the leader's, in radians.
type Disturbance = (f64, f64, f64);

/// A swarm of `count` under the paper's law, each UAV in its slot but for its disturbance.
fn disturbed(count: u32, by: &[Disturbance]) -> Scenario {
    let mut scenario = preset("paper-4.1", &[&format!("formation.uavs={count}")]);
    scenario.leader.start_m = [5.0, -2.0];
    scenario.leader.heading_deg = 17.0;
    let (formation, centre) = (scenario.formation(), scenario.leader.start_m.into());
    let heading_rad = scenario.leader.heading_deg.to_radians();
    let start = |(number, (x, y, turn)): (u32, &Disturbance)| StartState {
        position_m: (formation.slot(number, centre) + nalgebra::Vector2::new(*x, *y)).into(),
        heading_deg: wrap(heading_rad + turn).to_degrees(),
        speed_m_s: scenario.leader.speed_m_s,
    };
    scenario.start.uavs = (1..=count).zip(by.iter().cycle()).map(start).collect();
    scenario
}

/// A flight of `scenario` at tick 0.
fn begun(scenario: &Scenario) -> Flight {
    let mut flight = Flight::new(scenario);
    flight.fly_to(0);
    flight
}

#[test]
fn the_standard_formation_is_at_rest() {
    for count in [3, 4, 5, 6, 12, 50] {
        let mut flight = begun(&disturbed(count, &[(0.0, 0.0, 0.0)]));
        let lyapunov_m2 = flight.moment().lyapunov_m2.unwrap();
        assert!(lyapunov_m2 < 1e-18, "n = {count}: V is {lyapunov_m2} in the formation");
        flight.fly(10.0, |_| ());
        assert!(flight.slot_error_max_m() < 1e-6, "n = {count}: {}", flight.slot_error_max_m());
    }
}

#[test]
fn the_limits_do_not_keep_the_swarm_from_its_formation() {
    let places: Vec<Disturbance> = (0..6)
        .map(|i| {
            let (x, y) = (f64::from(i * 17 % 11) * 6.0 - 30.0, f64::from(i * 7 % 5) * 9.0 - 18.0);
            (x, y, f64::from(i) * 0.15 - 0.4)
        })
        .collect();
    let mut flight = begun(&disturbed(6, &places));
    assert!(flight.slot_error_max_m() > 20.0);
    flight.fly(90.0, |_| ());
    assert!(flight.slot_error_max_m() < 1e-3, "{}", flight.slot_error_max_m());
}

fn disturbance() -> impl Strategy<Value = Vec<Disturbance>> {
    proptest::collection::vec((-8.0..8.0, -8.0..8.0, -0.5..0.5), 6)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn the_lyapunov_value_does_not_rise_while_unsaturated(by in disturbance(), count in 3_u32..8) {
        let mut scenario = disturbed(count, &by);
        scenario.time.rate_hz = 1000;
        // Far apart, so that only a UAV that would have to fly backwards is saturated.
        (scenario.airframe.speed_min_m_s, scenario.airframe.speed_max_m_s) = (1e-6, 1e6);
        scenario.airframe.turn_rate_max_rad_s = 1e6;
        let mut flight = begun(&scenario);
        let mut unsaturated = 0;
        for _ in 0..2000 {
            let value = flight.moment().lyapunov_m2.unwrap();
            let mut controls = flight.frame().uavs.iter().map(|uav| uav.control.unwrap());
            let is_unsaturated = controls.all(|control| !control.speed_saturated && !control.turn_rate_saturated);
            flight.step();
            let next = flight.moment().lyapunov_m2.unwrap();
            // A step of 1 ms follows the flow up to an error of second order in the step.
            prop_assert!(!is_unsaturated || next <= value + 1e-4 * (1.0 + value), "{value} -> {next}");
            unsaturated += u32::from(is_unsaturated);
        }
        prop_assert!(unsaturated > 1000, "only {unsaturated} of 2000 ticks are what the theorem is about");
    }
}
