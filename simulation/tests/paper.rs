//! The paper's two simulations, Section 4.
//!
//! The processes fly the same, to the bit: `tests/simulation.rs` of the command compares them.

use crate::support::{Flight, fly_to_end, preset};
use ringwing_flight::UavId;
use ringwing_recorder::metrics::{TrueState, Verdict};
use ringwing_scenario::Scenario;
use std::thread;

const TOLERANCE_M: f64 = 0.05;

/// Every UAV's states of `scenario`'s whole flight, tick by tick, with the length of its repulsion.
fn states(scenario: &Scenario) -> Vec<Vec<(TrueState, f64)>> {
    let mut flight = Flight::new(scenario);
    let mut states = vec![Vec::new(); scenario.formation.uavs as usize];
    // Tick -1 is not part of the flight.
    flight.step();
    flight.fly(scenario.time.duration_s + scenario.period_s(), |flight| {
        for (uav, states) in flight.frame().uavs.iter().zip(&mut states) {
            let repulsion_m = uav.control.expect("every agent commands").repulsion_length_m();
            states.push((uav.state.expect("every UAV flies"), repulsion_m));
        }
    });
    states
}

fn assert_standard_formation(uav: &TrueState) {
    assert!(uav.slot_error_m.unwrap() < TOLERANCE_M, "{uav:?}");
    for (distance_m, wanted_m) in
        [(uav.previous_distance_m, 40.0), (uav.next_distance_m, 40.0), (uav.leader_distance_m, 40.0)]
    {
        assert!((distance_m.unwrap() - wanted_m).abs() < TOLERANCE_M, "{uav:?}");
    }
    assert!((uav.speed_m_s - 15.0).abs() < 0.01 && uav.heading_rad.abs() < 0.001, "{uav:?}");
}

fn assert_limits(uav: &TrueState) {
    assert!((12.0..=25.0).contains(&uav.speed_m_s) && uav.turn_rate_rad_s.abs() <= 0.5, "{uav:?}");
}

#[test]
fn section_4_1_the_formation_is_generated_and_kept() {
    let states = states(&preset("paper-4.1", &[]));
    let first = states.iter().map(|uav| uav[0].0.slot_error_m.unwrap()).fold(0.0, f64::max);
    assert!(first > 20.0, "the flight begins far from the formation");
    for uav in &states {
        assert_eq!(uav.len(), 9001);
        for (state, _) in uav {
            assert_limits(state);
        }
        assert_standard_formation(&uav[9000].0);
    }
    for tick in 0..=9000 {
        for (place, a) in states.iter().enumerate() {
            for b in &states[..place] {
                let (a, b) = (&a[tick].0, &b[tick].0);
                let apart_m = (a.position() - b.position()).norm();
                assert!(apart_m > 10.0, "uav {} and {} at tick {tick}", a.uav, b.uav);
            }
        }
    }
}

#[test]
fn section_4_2_obstacles_are_passed_and_the_formation_is_whole_again() {
    let scenario = preset("paper-4.2", &[]);
    let states = states(&scenario);
    let flown = ringwing_simulation::fly(&scenario).unwrap();
    assert_eq!(flown.verdict(), Verdict::Passed);
    for uav in &states {
        assert_standard_formation(&uav[9000].0);
    }
    for (name, centre, radius_m, repelled) in
        [("Obstacle 1", [900.0, 42.0], 10.0, [2, 3]), ("Obstacle 2", [580.0, -6.0], 20.0, [1, 4])]
    {
        let clearance_m =
            |state: &TrueState| (state.position() - nalgebra::Point2::from(centre)).norm() - radius_m;
        let closest = states.iter().flatten().map(|(state, _)| clearance_m(state)).fold(f64::MAX, f64::min);
        assert!(closest > 2.0, "{name}: {closest}");
        let reported = flown.summary.obstacles.iter().find(|obstacle| obstacle.name == name).unwrap();
        assert!((reported.clearance_m - closest).abs() < 1e-9);
        // The two UAVs that met it head on: its repulsion pushed them hardest while the formation passed it.
        let passing = |(state, _): &&(TrueState, f64)| (state.x_m - centre[0]).abs() < 100.0;
        let mut push: Vec<(f64, u32)> = (1..)
            .zip(&states)
            .map(|(uav, states)| {
                (states.iter().filter(passing).map(|(_, push)| *push).fold(0.0, f64::max), uav)
            })
            .collect();
        push.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut hardest = [push[0].1, push[1].1];
        hardest.sort_unstable();
        assert_eq!(hardest, repelled, "{name}: {push:?}");
    }
}

#[test]
fn section_4_1_from_a_hundred_random_starts() {
    let mut scenario = preset("paper-4.1", &[]);
    scenario.start.uavs.clear();
    thread::scope(|scope| {
        for first in [1, 51] {
            let scenario = &scenario;
            scope.spawn(move || {
                (first..first + 50).for_each(|seed| assert_forms(&Scenario { seed, ..scenario.clone() }));
            });
        }
    });
}

fn assert_forms(scenario: &Scenario) {
    let (_, last) = fly_to_end(scenario, |simulation| {
        for sensed in UavId::all(scenario.formation.uavs).filter_map(|uav| simulation.sensed(uav)) {
            assert!((12.0..=25.0).contains(&sensed.speed_m_s) && sensed.turn_rate_rad_s.abs() <= 0.5);
        }
    });
    assert_eq!(last.frame().tick, 9000);
    for uav in &last.frame().uavs {
        assert_standard_formation(uav.state.as_ref().expect("every UAV flies"));
    }
}
