//! The paper's two simulations, Section 4.

use crate::harness::{Finished, Swarm, in_process::Flight};
use ringwing_flight::Tick;
use ringwing_recorder::schema::UavState;
use ringwing_scenario::{Scenario, Source};
use std::thread;

const TOLERANCE_M: f64 = 0.05;

fn preset(name: &str) -> Scenario {
    Scenario::read(&Source::find(name).unwrap(), &[]).unwrap()
}

/// Every UAV's states, from the log.
fn states(run: &Finished) -> Vec<Vec<UavState>> {
    let log = run.log();
    (1..=6).map(|uav| log.states(uav)).collect()
}

fn assert_standard_formation(uav: &UavState) {
    assert!(uav.slot_error_m.unwrap() < TOLERANCE_M, "{uav:?}");
    for (distance_m, wanted_m) in
        [(uav.previous_distance_m, 40.0), (uav.next_distance_m, 40.0), (uav.leader_distance_m, 40.0)]
    {
        assert!((distance_m.unwrap() - wanted_m).abs() < TOLERANCE_M, "{uav:?}");
    }
    assert!((uav.speed_m_s - 15.0).abs() < 0.01 && uav.heading_rad.abs() < 0.001, "{uav:?}");
}

fn assert_limits(uav: &UavState) {
    assert!((12.0..=25.0).contains(&uav.speed_m_s) && uav.turn_rate_rad_s.abs() <= 0.5, "{uav:?}");
}

fn distance_m(a: &UavState, b: &UavState) -> f64 {
    (a.x_m - b.x_m).hypot(a.y_m - b.y_m)
}

#[test]
fn section_4_1_the_formation_is_generated_and_kept() {
    let run = Swarm::fly("paper-4.1").finish();
    run.assert_ended_with(0);
    let states = states(&run);
    let first = states.iter().map(|uav| uav[0].slot_error_m.unwrap()).fold(0.0, f64::max);
    assert!(first > 20.0, "the flight begins far from the formation");
    for uav in &states {
        assert_eq!(uav.len(), 9001);
        uav.iter().for_each(assert_limits);
        assert_standard_formation(&uav[9000]);
    }
    for tick in 0..=9000 {
        for (place, a) in states.iter().enumerate() {
            for b in &states[..place] {
                let apart_m = distance_m(&a[tick], &b[tick]);
                assert!(apart_m > 10.0, "uav {} and {} at tick {tick}", a[tick].uav, b[tick].uav);
            }
        }
    }
}

#[test]
fn section_4_2_obstacles_are_passed_and_the_formation_is_whole_again() {
    let run = Swarm::fly("paper-4.2").finish();
    run.assert_ended_with(0);
    let (log, states) = (run.log(), states(&run));
    for uav in &states {
        assert_standard_formation(&uav[9000]);
    }
    for (name, centre, radius_m, repelled) in
        [("Obstacle 1", (900.0, 42.0), 10.0, [2, 3]), ("Obstacle 2", (580.0, -6.0), 20.0, [1, 4])]
    {
        let clearance_m = |state: &UavState| (state.x_m - centre.0).hypot(state.y_m - centre.1) - radius_m;
        let closest = states.iter().flatten().map(clearance_m).fold(f64::MAX, f64::min);
        assert!(closest > 2.0, "{name}: {closest}");
        let reported = run.summary["obstacles"].as_array().unwrap();
        let reported = reported.iter().find(|obstacle| obstacle["name"] == name).unwrap();
        assert!((reported["clearance_m"].as_f64().unwrap() - closest).abs() < 1e-9);
        // Who met it head on: the two that its repulsion pushed hardest while the formation passed it.
        let passing = |state: &&UavState| (state.x_m - centre.0).abs() < 100.0;
        let mut push: Vec<(f64, u32)> = (1..=6)
            .map(|uav| {
                let of_tick: Vec<f64> = log.controls(uav).iter().map(|control| control.repulsion_m).collect();
                let near = states[uav as usize - 1].iter().filter(passing);
                (near.map(|state| of_tick[state.tick as usize]).fold(0.0, f64::max), uav)
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
    let mut scenario = preset("paper-4.1");
    scenario.start.uavs.clear();
    let fly = |seeds: std::ops::RangeInclusive<u64>| {
        let scenario = scenario.clone();
        move || seeds.for_each(|seed| assert_forms(&Scenario { seed, ..scenario.clone() }))
    };
    let half = thread::spawn(fly(1..=50));
    fly(51..=100)();
    half.join().unwrap();
}

/// The processes fly what this flies, to the bit: `determinism` shows it.
fn assert_forms(scenario: &Scenario) {
    let mut flight = Flight::new(scenario);
    flight.fly_to(Tick(9000), |flight| {
        for airframe in flight.sky.airframes() {
            let (speed, turn_rate) = airframe.rates();
            assert!((12.0..=25.0).contains(&speed) && turn_rate.abs() <= 0.5);
        }
    });
    let centre = nalgebra::Point2::from(flight.leader().position_m);
    let errors = flight.slot_errors_m(scenario);
    let airframes = flight.sky.airframes();
    for (place, airframe) in airframes.iter().enumerate() {
        let next = &airframes[(place + 1) % airframes.len()];
        let to_next = (airframe.pose().position - next.pose().position).norm();
        let to_centre = (airframe.pose().position - centre).norm();
        assert!(errors[place] < TOLERANCE_M, "seed {}", scenario.seed);
        assert!((to_next - 40.0).abs() < TOLERANCE_M && (to_centre - 40.0).abs() < TOLERANCE_M);
        assert!((airframe.rates().0 - 15.0).abs() < 0.01 && airframe.pose().heading_rad.abs() < 0.001);
    }
}
