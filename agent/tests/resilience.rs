//! What the resilient law is for, in flights of pilots alone: issue 4's bounds, met with the times of `law.md`.

mod flight;

use flight::{Flight, Recovery, Weather, scenario};

/// How near everybody is to its slot when the ring is whole.
const WHOLE_M: f64 = 0.05;

/// A swarm at rest under the resilient law.
fn at_rest(uavs: u32, settings: &[&str]) -> Flight {
    let number = format!("uavs={uavs}");
    let settings: Vec<_> = settings.iter().copied().chain([number.as_str()]).collect();
    let mut flight = Flight::at_rest(scenario("resilient", &settings), Weather::default());
    flight.fly(1.0, |_| ());
    assert!(flight.slot_error_max_m() < 1e-9);
    flight
}

/// What becomes of a swarm at rest that loses `dead` at once.
fn recovery(uavs: u32, dead: &[u32]) -> (Flight, Recovery) {
    let mut flight = at_rest(uavs, &[]);
    flight.kill(dead);
    assert!(flight.slot_error_max_m() > 1.0, "the gap shows");
    let recovery = flight.recovery(30.0, WHOLE_M);
    assert!(flight.all_agree_with_the_truth());
    (flight, recovery)
}

#[test]
fn any_one_of_six_may_die() {
    for dead in 1..=6 {
        let (_, recovery) = recovery(6, &[dead]);
        assert!(recovery.whole_s < 10.0 && recovery.closest_m > 35.0, "{dead}: {recovery:?}");
    }
}

#[test]
fn several_may_die_at_once() {
    // How many fly, who dies, and half as much again as law.md's time.
    let losses: [(u32, &[u32], f64); 12] = [
        (6, &[1, 2], 17.25),
        (6, &[2, 3], 17.25),
        (6, &[4, 5], 17.25),
        (6, &[1, 4], 8.4),
        (6, &[2, 5], 8.4),
        (6, &[3, 6], 8.4),
        (6, &[1, 2, 3], 16.35),
        (6, &[3, 4, 5], 16.35),
        (6, &[5, 6, 1], 16.35),
        (8, &[1, 4, 6], 10.5),
        (8, &[2, 3, 4], 14.4),
        (12, &[1, 3, 5, 7, 9, 11], 20.25),
    ];
    for (uavs, dead, bound_s) in losses {
        let (_, recovery) = recovery(uavs, dead);
        assert!(recovery.whole_s < bound_s && recovery.closest_m > 15.0, "{dead:?} of {uavs}: {recovery:?}");
    }
}

#[test]
fn any_half_of_twelve_side_by_side_may_die() {
    for first in 0..12 {
        let dead: Vec<u32> = (first..first + 6).map(|place| place % 12 + 1).collect();
        let (_, recovery) = recovery(12, &dead);
        assert!(recovery.whole_s < 32.25 && recovery.closest_m > 15.0, "{dead:?}: {recovery:?}");
    }
}

#[test]
fn those_that_return_find_their_slots_open() {
    let losses: [(u32, &[u32]); 6] =
        [(6, &[2]), (6, &[4]), (6, &[6]), (6, &[2, 3]), (6, &[1, 2, 3]), (8, &[1, 4, 6])];
    for (uavs, dead) in losses {
        let mut flight = at_rest(uavs, &[]);
        flight.kill(dead);
        flight.fly(4.0, |_| ());
        assert!(flight.slot_error_max_m() > 1.0, "the gap shows");
        flight.restart(dead);
        let recovery = flight.recovery(30.0, WHOLE_M);
        assert!(recovery.whole_s < 20.0 && recovery.closest_of_all_m > 2.0, "{dead:?}: {recovery:?}");
        assert!(flight.all_agree_with_the_truth());
    }
}

#[test]
fn below_three_the_survivors_keep_their_own_slots() {
    let mut flight = at_rest(6, &[]);
    flight.kill(&[1, 2, 4, 5]);
    flight.fly(30.0, |_| ());
    assert!(flight.slot_error_max_m() < WHOLE_M && flight.all_agree_with_the_truth());
}

#[test]
fn radius_or_slots_are_kept_where_that_is_asked_for() {
    for on_loss in ["keep_radius", "keep_slots"] {
        let mut flight = at_rest(6, &[&format!("on_loss={on_loss}")]);
        flight.kill(&[2]);
        let recovery = flight.recovery(30.0, WHOLE_M);
        assert!(recovery.whole_s < 10.0 && recovery.closest_m > 35.0, "{on_loss}: {recovery:?}");
    }
}

#[test]
fn a_uav_may_die_while_the_formation_is_forming() {
    for seed in 1..=10 {
        let mut flight = Flight::new(scenario("resilient", &[&format!("seed={seed}")]), Weather::default());
        flight.fly(4.0, |_| ());
        flight.kill(&[seed % 6 + 1]);
        let recovery = flight.recovery(60.0, WHOLE_M);
        assert!(recovery.whole_s < 40.0, "seed {seed}: {recovery:?}");
    }
}

#[test]
fn a_uav_may_die_in_front_of_an_obstacle() {
    for dead in 1..=6 {
        let mut scenario = scenario("resilient", &[]);
        scenario.obstacles = flight::obstacles_of_the_paper();
        let mut flight = Flight::at_rest(scenario, Weather::default());
        flight.fly(30.0, |_| ());
        flight.kill(&[dead]);
        let mut clearance_m = f64::INFINITY;
        flight.fly(60.0, |flight| clearance_m = clearance_m.min(flight.clearance_m()));
        assert!(clearance_m > 0.0, "{dead} dies: {clearance_m}");
        assert!(clearance_m < 30.0, "the obstacle is in the way");
        assert!(flight.slot_error_max_m() < WHOLE_M);
    }
}

#[test]
fn late_neighbours_cost_nothing_in_the_end() {
    let median_s = |weather: Weather, timeout: &str| {
        let flight_s = |seed: u32| {
            let settings = [format!("seed={seed}"), format!("loss_timeout_s={timeout}")];
            let mut flight =
                Flight::new(scenario("resilient", &settings.each_ref().map(String::as_str)), weather);
            let recovery = flight.recovery(60.0, 1.0);
            let error_m = flight.slot_error_max_m();
            assert!(error_m < WHOLE_M, "{weather:?}, timeout {timeout}, seed {seed}: {error_m} m");
            recovery.whole_s
        };
        let mut times: Vec<_> = (1..=20).map(flight_s).collect();
        times.sort_by(f64::total_cmp);
        f64::midpoint(times[9], times[10])
    };
    let undelayed_s = median_s(Weather::default(), "6");
    for delay_ticks in [20, 50, 100, 200, 500] {
        let weather = Weather { delay_ticks, ..Weather::default() };
        let delayed_s = median_s(weather, "6");
        assert!(delayed_s < 1.2 * undelayed_s, "{delay_ticks}: {delayed_s} s instead of {undelayed_s} s");
        median_s(weather, "0.1");
    }
}

#[test]
fn the_papers_law_cannot_bear_late_neighbours() {
    for (delay_ticks, at_least_m) in [(20, 4.0), (50, 10.0), (100, 20.0)] {
        let weather = Weather { delay_ticks, ..Weather::default() };
        let mut flight = Flight::at_rest(scenario("paper", &[]), weather);
        flight.fly(60.0, |_| ());
        assert!(flight.slot_error_max_m() > at_least_m, "{delay_ticks}: {}", flight.slot_error_max_m());
    }
}

#[test]
fn lost_doubled_late_and_interrupted_messages_move_nobody() {
    let storm = Weather {
        jitter_ticks: 10,
        loss: 30,
        duplicates: 20,
        outage_ticks: 100,
        between_ticks: 900,
        ..Weather::default()
    };
    for seed in 1..=10 {
        let scenario = scenario("resilient", &[&format!("seed={seed}"), "loss_timeout_s=3"]);
        let mut flight = Flight::at_rest(scenario, storm);
        let mut worst_m = 0.0_f64;
        flight.fly(90.0, |flight| worst_m = worst_m.max(flight.slot_error_rms_m()));
        assert!(worst_m < 0.5, "seed {seed}: {worst_m}");
    }
}

#[test]
fn three_and_four_form_from_everywhere_where_the_papers_law_gets_stuck() {
    let stuck = |law: &str, uavs: u32| {
        let is_stuck = |seed: &u32| {
            let mut flight = Flight::new(
                scenario(law, &[&format!("uavs={uavs}"), &format!("seed={seed}")]),
                Weather::default(),
            );
            flight.fly(60.0, |_| ());
            flight.slot_error_max_m() > 1.0
        };
        (1..=200_u32).filter(is_stuck).count()
    };
    for (uavs, at_least) in [(3, 60), (4, 30)] {
        assert_eq!(stuck("resilient", uavs), 0, "n = {uavs}");
        assert!(stuck("paper", uavs) >= at_least, "n = {uavs}: what there is to mend");
    }
}

#[test]
fn a_silent_leader_is_flown_on_with() {
    let mut flight = at_rest(6, &[]);
    flight.is_leader_silent = true;
    let mut worst_m = 0.0_f64;
    flight.fly(30.0, |flight| worst_m = worst_m.max(flight.slot_error_max_m()));
    assert!(flight.says_that_the_leader_is_silent());
    flight.is_leader_silent = false;
    flight.fly(10.0, |flight| worst_m = worst_m.max(flight.slot_error_max_m()));
    assert!(!flight.says_that_the_leader_is_silent());
    assert!(worst_m < 1e-6, "{worst_m}");
}

#[test]
fn late_senses_of_its_own_are_made_up_for_by_what_was_commanded() {
    let error_m = |law: &str| {
        let mut flight = Flight::at_rest(scenario(law, &[]), Weather::default());
        flight.senses_late_ticks = 50;
        flight.fly(30.0, |_| ());
        flight.slot_error_max_m()
    };
    assert!(error_m("resilient") < WHOLE_M);
    assert!(error_m("paper") > 5.0, "what there is to mend");
}
