//! What the collision filter is for: nobody comes too near to anybody, whatever they start from, fly into, or sense.

use crate::support::{
    Flight, Recovery, at_rest, closest_pair_m, places, preset, scenario, slot_error_max_m, with_faults,
};
use nalgebra::Point2;
use ringwing_flight::{AircraftId, Avoided, Route, UavId, direction, draw::Draws};
use ringwing_scenario::{IntruderSection, ObstacleSection, Scenario};
use ringwing_simulation::{Simulation, fly};
use std::thread;

/// Nearer than this is a near miss, whoever is concerned.
const NEAR_MISS_M: f64 = 5.0;
/// Separates the draws of intruders from all others. Another value gives other intruders.
const INTRUDERS: [u64; 3] = [0x63_726f_7373, 0, 0];

/// How near a flight came to something, and when it was whole for good.
#[derive(Debug, Clone, Copy)]
struct Closest {
    /// The seed of the flight.
    seed: u64,
    /// The closest two aircraft.
    pair_m: f64,
    /// The smallest distance from the edge of an obstacle.
    clearance_m: f64,
    /// The smallest distance from an intruder.
    intruder_m: f64,
    /// From then on every slot error stayed below 1 m; infinite if that was not so at the end.
    settled_s: f64,
}

/// Flies `scenario` to its end.
fn closest_of(scenario: &Scenario) -> Closest {
    let mut simulation = Simulation::new(scenario).expect("a scenario that can be simulated");
    let mut closest = Closest {
        seed: scenario.seed,
        pair_m: f64::INFINITY,
        clearance_m: f64::INFINITY,
        intruder_m: f64::INFINITY,
        settled_s: 0.0,
    };
    let obstacles = scenario.all_obstacles();
    let intruders: Vec<Route> = scenario.intruders.iter().map(IntruderSection::route).collect();
    loop {
        let is_over = !simulation.step();
        let places = places(&simulation);
        closest.pair_m = closest.pair_m.min(closest_pair_m(&simulation));
        closest.clearance_m = closest.clearance_m.min(clearance_m(&obstacles, &places));
        // After the step, the sky is that of the next tick.
        let time_s = simulation.sky().now().seconds(scenario.time.rate_hz);
        closest.intruder_m = closest.intruder_m.min(intruder_m(&intruders, time_s, &places));
        let is_whole = slot_error_max_m(&simulation) < 1.0;
        match (is_whole, is_over) {
            (true, true) => return closest,
            (false, true) => return Closest { settled_s: f64::INFINITY, ..closest },
            (true, false) => {}
            (false, false) => closest.settled_s = simulation.now().0 as f64 * scenario.period_s(),
        }
    }
}

fn intruder_m(intruders: &[Route], time_s: f64, places: &[Point2<f64>]) -> f64 {
    let distance_m = |route: &Route| {
        let there = route.at(time_s).pose.position;
        places.iter().map(|place| (place - there).norm()).fold(f64::INFINITY, f64::min)
    };
    intruders.iter().map(distance_m).fold(f64::INFINITY, f64::min)
}

fn clearance_m(obstacles: &[ObstacleSection], places: &[Point2<f64>]) -> f64 {
    let to_edge = |place: &Point2<f64>, one: &ObstacleSection| {
        (place - Point2::from(one.position_m)).norm() - one.radius_m
    };
    let all = places.iter().flat_map(|place| obstacles.iter().map(move |one| to_edge(place, one)));
    all.fold(f64::INFINITY, f64::min)
}

/// Flies each of the scenarios that `make` gives for these seeds, on all processors.
fn fly_all(seeds: std::ops::RangeInclusive<u64>, make: impl Fn(u64) -> Scenario + Sync) -> Vec<Closest> {
    in_parallel(&seeds.collect::<Vec<_>>(), |seed| closest_of(&make(*seed)))
}

/// Calls `fly` for each of `flights`, on all processors.
fn in_parallel<I: Sync, O: Send>(flights: &[I], fly: impl Fn(&I) -> O + Sync) -> Vec<O> {
    let workers = thread::available_parallelism().map_or(1, usize::from);
    let share = |worker: usize| flights.iter().skip(worker).step_by(workers);
    let fly = |worker| share(worker).map(&fly).collect::<Vec<_>>();
    let fly = &fly;
    thread::scope(|scope| {
        let flying: Vec<_> = (0..workers).map(|worker| scope.spawn(move || fly(worker))).collect();
        flying.into_iter().flat_map(|one| one.join().expect("a flight")).collect()
    })
}

/// A swarm from drawn starts, each UAV with the slot near its start.
fn drawn(uavs: u32, seed: u64, duration_s: f64, settings: &[&str]) -> Scenario {
    let (uavs, seed) = (format!("uavs={uavs}"), format!("seed={seed}"));
    let own = ["assignment=nearest", uavs.as_str(), seed.as_str()];
    let mut scenario = scenario("resilient", &[&own, settings].concat());
    scenario.time.duration_s = duration_s;
    scenario
}

/// `circles` obstacles of 5 to 20 m at random places in the way of the formation.
fn field(circles: u32, seed: u64) -> Scenario {
    drawn(6, seed, 150.0, &[&format!("circles={circles}")])
}

/// Six UAVs in their slots, and an obstacle whose centre is exactly on the line that one of them flies. `number` tells which
/// UAV that is, and how large and how far ahead the obstacle is.
fn blocked(number: u32, settings: &[&str]) -> Scenario {
    let mut scenario = at_rest(scenario("resilient", settings));
    scenario.time.duration_s = 20.0;
    let start = &scenario.start.uavs[number as usize % 6];
    let size = f64::from(number / 6) / 50.0;
    // Beyond all starts.
    // The golden section spreads the distances evenly, however many numbers are flown.
    let ahead_m = 120.0 + 60.0 * (0.382 * f64::from(number)).fract();
    let place = Point2::from(start.position_m) + direction(start.heading_deg.to_radians()) * ahead_m;
    let radius_m = 5.0 + 15.0 * size;
    scenario.obstacles = vec![ObstacleSection {
        position_m: place.into(),
        radius_m,
        braking_distance_m: radius_m + 20.0,
        ..preset("paper-4.2", &[]).obstacles[0].clone()
    }];
    scenario
}

/// `count` intruders that cross the formation at random, each on a straight line through where some UAV's slot may be.
fn crossed(count: u32, cooperative: bool, seed: u64) -> Scenario {
    let scenario = drawn(6, seed, 100.0, &["radar_noise_m=0.5"]);
    let mut draws = Draws::new(seed, INTRUDERS, 0);
    let radius_m = scenario.formation().radius_m();
    let mut intruder = || {
        let (time_s, heading_deg) = (25.0 + 50.0 * draws.uniform(), 360.0 * draws.uniform() - 180.0);
        let speed_m_s = 12.0 + 13.0 * draws.uniform();
        let beside_m = [(); 2].map(|()| radius_m * (2.0 * draws.uniform() - 1.0));
        let aim = Point2::new(scenario.leader.speed_m_s * time_s + beside_m[0], beside_m[1]);
        let start = aim - direction(heading_deg.to_radians()) * (speed_m_s * time_s);
        IntruderSection {
            position_m: start.into(),
            heading_deg,
            speed_m_s,
            cooperative,
            turn_rate_rad_s: 0.0,
            waypoints_m: Vec::new(),
            repeat: false,
        }
    };
    let intruders = (0..count).map(|_| intruder()).collect();
    Scenario { intruders, ..scenario }
}

fn median_settling_s(flights: &[Closest]) -> f64 {
    let mut settled: Vec<f64> = flights.iter().map(|flight| flight.settled_s).collect();
    settled.sort_by(f64::total_cmp);
    settled[settled.len() / 2]
}

/// The flights that came nearer than allowed, or never became whole.
fn failed(flights: &[Closest], pair_m: f64) -> Vec<Closest> {
    let has_failed = |one: &&Closest| {
        one.pair_m < pair_m || one.intruder_m < 2.0 || one.clearance_m <= 0.0 || one.settled_s.is_infinite()
    };
    flights.iter().filter(has_failed).copied().collect()
}

#[test]
fn from_drawn_starts_nobody_comes_near_anybody() {
    for (uavs, seeds, settling_s) in [(6, 200_001..=200_016, 12.0), (12, 200_001..=200_006, 18.0)] {
        let flights = fly_all(seeds, |seed| drawn(uavs, seed, 60.0, &[]));
        assert!(failed(&flights, NEAR_MISS_M).is_empty(), "{:?}", failed(&flights, NEAR_MISS_M));
        let median_s = median_settling_s(&flights);
        assert!(median_s < settling_s, "n = {uavs}: {median_s} s");
    }
}

#[test]
fn without_the_filter_and_with_slots_by_number_they_collide() {
    let settings = ["assignment=number", "collision_filter=false"];
    let flights = fly_all(200_001..=200_016, |seed| drawn(6, seed, 60.0, &settings));
    assert!(flights.iter().any(|flight| flight.pair_m < 2.0), "else the tests here show nothing");
}

/// Senses of traffic as a poor receiver has them.
const LATE_SENSES: [&str; 3] = ["traffic_delay_s=0.3", "traffic_noise_m=2", "traffic_loss=0.2"];

#[test]
fn late_noisy_and_lost_senses_of_traffic_suffice() {
    let flights = fly_all(300_001..=300_016, |seed| drawn(6, seed, 60.0, &LATE_SENSES));
    assert!(failed(&flights, 2.0).is_empty(), "{:?}", failed(&flights, 2.0));
}

#[test]
fn a_field_of_obstacles_is_crossed_without_a_hit() {
    let flights = fly_all(400_001..=400_008, |seed| field(10, seed));
    assert!(failed(&flights, NEAR_MISS_M).is_empty(), "{:?}", failed(&flights, NEAR_MISS_M));
    let unfiltered = |seed| {
        let mut scenario = field(20, seed);
        scenario.control.collision_filter = false;
        scenario
    };
    let hits = fly_all(400_001..=400_016, unfiltered);
    assert!(hits.iter().any(|flight| flight.clearance_m <= 0.0), "else the fields are empty");
}

#[test]
fn an_obstacle_exactly_on_the_line_of_a_uav_is_not_hit() {
    let hits = |filter: &str| {
        let flights = fly_all(0..=299, |number| blocked(number as u32, &[filter, "rate_hz=50"]));
        flights.iter().filter(|flight| flight.clearance_m <= 0.0).count()
    };
    assert_eq!(hits("collision_filter=true"), 0);
    // Eq. (13) alone pushes such a UAV back, and not to a side.
    assert!(hits("collision_filter=false") > 50, "else they are not in the way");
}

#[test]
fn intruders_that_cross_the_formation_are_avoided() {
    for cooperative in [true, false] {
        let flights = fly_all(500_001..=500_008, |seed| crossed(2, cooperative, seed));
        assert!(failed(&flights, NEAR_MISS_M).is_empty(), "{:?}", failed(&flights, NEAR_MISS_M));
    }
    let unfiltered = |seed| {
        let mut scenario = crossed(2, true, seed);
        scenario.control.collision_filter = false;
        scenario
    };
    let near = fly_all(500_001..=500_008, unfiltered);
    assert!(near.iter().any(|flight| flight.intruder_m < 5.0), "else they cross somewhere else");
}

#[test]
fn the_presets_with_a_filter_meet_their_requirements_and_the_papers_law_does_not() {
    for name in ["field", "traffic"] {
        let violations = |settings: &[&str]| fly(&preset(name, settings)).expect("a flight").violations;
        assert_eq!(violations(&[]), [""; 0], "{name}");
        assert_ne!(violations(&["control.law=paper"]), [""; 0], "{name}");
    }
}

#[test]
fn a_flight_without_conflicts_is_flown_as_the_law_wishes() {
    let mut flight = Flight::new(&at_rest(scenario("resilient", &["collision_filter=true"])));
    flight.fly(20.0, |flight| {
        for uav in UavId::all(6) {
            let account = flight.simulation.account(uav).expect("an account");
            let wish = (account.wish_speed_m_s, account.wish_turn_rate_rad_s);
            assert_eq!((account.speed_m_s, account.turn_rate_rad_s), wish);
            assert_eq!(account.avoided, Avoided::NOTHING);
        }
    });
}

#[test]
fn a_fault_can_blind_the_filter_and_the_log_tells_what_it_avoided() {
    // UAV 4 starts ahead of UAV 1 and flies towards it. They are no ring neighbours, so the law has no repulsion for them.
    let head_on = |faults: &[&str]| {
        let mut scenario = at_rest(scenario("resilient", &["collision_filter=true"]));
        scenario.start.uavs[3] = scenario.start.uavs[0];
        scenario.start.uavs[3].position_m[0] += 150.0;
        scenario.start.uavs[3].heading_deg = 180.0;
        let mut flight = Flight::new(&with_faults(scenario, faults));
        let (mut avoided, mut closest_m) = (Vec::new(), f64::INFINITY);
        flight.fly(10.0, |flight| {
            let place = |uav: u32| flight.simulation.sky().airframes()[uav as usize - 1].pose().position;
            closest_m = closest_m.min((place(1) - place(4)).norm());
            avoided.extend(flight.simulation.account(UavId(1)).map(|account| account.avoided));
        });
        (closest_m, avoided.contains(&Avoided::aircraft(AircraftId::uav(UavId(4)))))
    };
    let (clear_m, names_it) = head_on(&[]);
    assert!(clear_m > NEAR_MISS_M && names_it, "{clear_m} m, named: {names_it}");
    let (_, is_named) = head_on(&["at 0 s link traffic->all blackout"]);
    assert!(!is_named, "what is not sensed is not avoided");
}

/// UAV `dead` of a ring at rest is killed.
#[derive(Debug)]
struct Loss {
    uavs: u32,
    dead: u32,
    recovery: Recovery,
}

impl Loss {
    fn fly(uavs: u32, dead: u32, settings: &[&str]) -> Self {
        let uavs_key = format!("uavs={uavs}");
        let settings = [&[uavs_key.as_str(), "rate_hz=50"], settings].concat();
        let mut flight = Flight::new(&at_rest(scenario("resilient", &settings)));
        // By then every plan for a whole ring is made.
        flight.fly(3.0, |_| ());
        flight.kill(&[dead]);
        // The others overtake a UAV that was in front for as long as this.
        Self { uavs, dead, recovery: flight.recover(45.0, 0.05) }
    }
}

/// Kills each UAV of rings of these sizes, one a flight.
fn single_losses(sizes: std::ops::RangeInclusive<u32>, settings: &[&str]) -> Vec<Loss> {
    let losses: Vec<_> = sizes.flat_map(|uavs| (1..=uavs).map(move |dead| (uavs, dead))).collect();
    in_parallel(&losses, |(uavs, dead)| Loss::fly(*uavs, *dead, settings))
}

/// The settings under which a dead UAV may meet somebody.
const FAILSAFES: [[&str; 2]; 4] = [
    ["failsafe=loiter", "collision_filter=true"],
    ["failsafe=loiter", "collision_filter=false"],
    ["failsafe=hold", "collision_filter=false"],
    ["failsafe=vanish", "collision_filter=false"],
];

#[test]
fn one_that_flies_on_without_its_agent_meets_nobody() {
    for settings in &FAILSAFES {
        for Loss { uavs, dead, recovery } in single_losses(3..=6, settings) {
            let is_harmless = recovery.closest_m > 15.0 && recovery.whole_s < 10.0;
            assert!(is_harmless, "{settings:?}: {dead} of {uavs} dies: {recovery:?}");
        }
    }
}

#[test]
#[ignore = "takes minutes without optimization; run it after a change of the failsafe or of the slots"]
fn one_of_up_to_sixteen_that_flies_on_without_its_agent_meets_nobody() {
    for settings in &FAILSAFES {
        let losses = single_losses(3..=16, settings);
        print_losses(&format!("{settings:?}"), &losses);
        let near = losses.iter().find(|loss| loss.recovery.closest_m <= NEAR_MISS_M);
        assert!(near.is_none(), "{settings:?}: {near:?}");
    }
}

/// Prints a row of the figures of ARCHITECTURE.md.
#[expect(clippy::print_stdout, reason = "prints the table that the test is for")]
fn print_losses(name: &str, losses: &[Loss]) {
    let by = |of: fn(&Recovery) -> f64| losses.iter().map(move |loss| of(&loss.recovery));
    println!(
        "{name}: {} losses; closest pair {:.2} m, of living {:.2} m; whole again after {:.2} s at most",
        losses.len(),
        by(|one| one.closest_m).fold(f64::INFINITY, f64::min),
        by(|one| one.closest_commanded_m).fold(f64::INFINITY, f64::min),
        by(|one| one.whole_s).fold(0.0, f64::max),
    );
}

/// Prints a row of the figures of ARCHITECTURE.md.
#[expect(clippy::print_stdout, reason = "prints the table that the test is for")]
fn print(name: &str, flights: &[Closest]) {
    let count = |is: &dyn Fn(&Closest) -> bool| flights.iter().filter(|one| is(one)).count();
    let nearest_m = |of: fn(&Closest) -> f64| flights.iter().map(of).fold(f64::INFINITY, f64::min);
    println!(
        "{name}: {} flights; closest pair {:.2} m, {} below 5 m; {} hit an obstacle; {} hit an intruder, closest {:.2} m; \
         {} unsettled, median settling {:.2} s",
        flights.len(),
        nearest_m(|one| one.pair_m),
        count(&|one| one.pair_m < NEAR_MISS_M),
        count(&|one| one.clearance_m <= 0.0),
        count(&|one| one.intruder_m < 2.0),
        nearest_m(|one| one.intruder_m),
        count(&|one| one.settled_s.is_infinite()),
        median_settling_s(flights),
    );
    let seeds: Vec<u64> = failed(flights, NEAR_MISS_M).iter().map(|one| one.seed).collect();
    if !seeds.is_empty() {
        println!("    failed with the seeds {seeds:?}");
    }
}

/// `cargo test --release -p ringwing-simulation -- --ignored --nocapture figures`.
#[test]
#[ignore = "flies for an hour"]
fn figures_of_drawn_starts() {
    for uavs in [6, 12, 24] {
        let flights = fly_all(1_000_001..=1_001_000, |seed| drawn(uavs, seed, 150.0, &[]));
        print(&format!("drawn starts, n = {uavs}"), &flights);
    }
}

#[test]
#[ignore = "flies for many minutes"]
fn figures_of_late_noisy_and_lost_senses() {
    print("late senses", &fly_all(1_000_001..=1_001_000, |seed| drawn(6, seed, 150.0, &LATE_SENSES)));
}

#[test]
#[ignore = "flies for many minutes"]
fn figures_of_storms() {
    let storm = |seed: u64| preset("storm", &[&format!("seed={seed}")]);
    print("storm", &fly_all(1..=1000, storm));
}

#[test]
#[ignore = "flies for many minutes"]
fn figures_of_fields() {
    for circles in [5, 10, 20, 30] {
        print(&format!("{circles} circles"), &fly_all(2_000_001..=2_000_500, |seed| field(circles, seed)));
    }
}

#[test]
#[ignore = "flies for many minutes"]
fn figures_of_intruders() {
    for (count, cooperative) in [1, 2, 3].into_iter().flat_map(|count| [(count, true), (count, false)]) {
        let flights = fly_all(3_000_001..=3_000_500, |seed| crossed(count, cooperative, seed));
        print(&format!("{count} intruders, cooperative: {cooperative}"), &flights);
    }
}
