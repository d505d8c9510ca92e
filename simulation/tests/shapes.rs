//! Formations of every shape: the swarm forms them from drawn starts, and closes them after losses.

use crate::support::{Flight, at_rest, preset, scenario, with_faults};
use nalgebra::{Point2, Vector2};
use ringwing_flight::UavId;
use ringwing_scenario::{OffsetSection, Scenario, ShapeName};
use ringwing_simulation::Simulation;
use std::thread;

/// Every shape that has a name.
const SHAPES: [&str; 6] = ["ring", "vee", "echelon", "ellipse", "grid", "star"];
/// How long all slot errors must stay below the bound. Shorter, and a swarm that swings through its slots would count.
const HOLD_S: f64 = 5.0;
/// Slot error below which a formation is formed.
const FORMED_M: f64 = 0.05;
/// The longest flight. A swarm that has not formed by then is stuck.
const LONGEST_S: f64 = 150.0;

/// How a swarm formed its shape.
#[derive(Debug, Clone, Copy)]
struct Forming {
    /// From then on every slot error stayed below 0.05 m; infinite if that did not happen.
    formed_s: f64,
    /// The closest that two UAVs came.
    closest_m: f64,
}

/// A swarm from drawn starts, each UAV with a slot near its start.
fn drawn(shape: &str, uavs: u32, seed: u64, settings: &[&str]) -> Scenario {
    let own = [format!("shape={shape}"), format!("uavs={uavs}"), format!("seed={seed}")];
    let own: Vec<&str> = own.iter().map(String::as_str).chain(["assignment=nearest"]).collect();
    scenario("resilient", &[&own, settings].concat())
}

/// Flies `scenario` until its formation is formed.
fn form(scenario: &Scenario) -> Forming {
    let mut simulation = Simulation::new(scenario).expect("a scenario that can be simulated");
    let ring = scenario.whole_ring();
    let slots: Vec<_> = UavId::all(scenario.formation.uavs).map(|uav| ring.slot(uav.0).offset()).collect();
    let mut forming = Forming { formed_s: 0.0, closest_m: f64::INFINITY };
    while simulation.step() {
        let now_s = simulation.now().0 as f64 * scenario.period_s();
        let airframes = simulation.sky().airframes().iter();
        let places: Vec<Point2<f64>> = airframes.map(|airframe| airframe.pose().position).collect();
        forming.closest_m = forming.closest_m.min(closest_m(&places));
        let centre = Point2::from(simulation.leader().position_m);
        let is_in_slot =
            |(place, slot): (&Point2<f64>, &Vector2<f64>)| (place - centre - slot).norm() < FORMED_M;
        if !places.iter().zip(&slots).all(is_in_slot) {
            forming.formed_s = now_s;
        } else if now_s - forming.formed_s > HOLD_S {
            return forming;
        }
        if now_s > LONGEST_S {
            break;
        }
    }
    Forming { formed_s: f64::INFINITY, ..forming }
}

fn closest_m(places: &[Point2<f64>]) -> f64 {
    let pairs = places.iter().enumerate().flat_map(|(at, one)| places[..at].iter().map(move |two| one - two));
    pairs.map(|apart| apart.norm()).fold(f64::INFINITY, f64::min)
}

/// Forms the scenarios that `make` gives for these seeds, on all processors.
fn form_all(seeds: std::ops::RangeInclusive<u64>, make: impl Fn(u64) -> Scenario + Sync) -> Vec<Forming> {
    let workers = thread::available_parallelism().map_or(1, usize::from);
    let seeds: Vec<u64> = seeds.collect();
    let share = |worker: usize| seeds.iter().skip(worker).step_by(workers);
    let fly = |worker| share(worker).map(|seed| form(&make(*seed))).collect::<Vec<_>>();
    let fly = &fly;
    thread::scope(|scope| {
        let flying: Vec<_> = (0..workers).map(|worker| scope.spawn(move || fly(worker))).collect();
        flying.into_iter().flat_map(|one| one.join().expect("a flight")).collect()
    })
}

fn median_s(flights: &[Forming]) -> f64 {
    let mut formed: Vec<f64> = flights.iter().map(|flight| flight.formed_s).collect();
    formed.sort_by(f64::total_cmp);
    formed[formed.len() / 2]
}

#[test]
fn every_shape_forms_from_drawn_starts_about_as_soon_as_the_ring() {
    let flights = |shape: &str| form_all(300_001..=300_008, |seed| drawn(shape, 6, seed, &[]));
    let ring_s = median_s(&flights("ring"));
    for shape in SHAPES {
        let flights = flights(shape);
        assert!(
            flights.iter().all(|one| one.formed_s.is_finite() && one.closest_m > 2.0),
            "{shape}: {flights:?}"
        );
        assert!(median_s(&flights) < 1.4 * ring_s, "{shape}: {} s, the ring {ring_s} s", median_s(&flights));
    }
}

/// `scenario` with the places of a triangle of six.
fn with_offsets(mut scenario: Scenario) -> Scenario {
    let places = [(40.0, 0.0), (10.0, -20.0), (10.0, 20.0), (-20.0, -40.0), (-20.0, 0.0), (-20.0, 40.0)];
    scenario.formation.shape = ShapeName::Offsets;
    scenario.formation.offsets = places.map(|(ahead_m, left_m)| OffsetSection { ahead_m, left_m }).into();
    scenario
}

#[test]
fn listed_offsets_are_flown_where_they_are_listed() {
    let mut scenario = with_offsets(drawn("ring", 6, 7, &[]));
    scenario.formation.bearing_deg = -90.0;
    assert!(form(&scenario).formed_s < 40.0);
    // Turned by a quarter to the left, ahead is north and left is west.
    let third = scenario.formation().slot(3, Point2::origin());
    assert!((third - Point2::new(-20.0, 10.0)).norm() < 1e-9, "{third}");
}

#[test]
fn every_shape_closes_after_a_loss_and_opens_on_a_return() {
    let at_rest_in = |shape| at_rest(scenario("resilient", &[&format!("shape={shape}")]));
    let mut swarms: Vec<Scenario> = SHAPES.map(at_rest_in).into();
    swarms.push(at_rest(with_offsets(scenario("resilient", &[]))));
    for swarm in swarms {
        // UAV 4 is the tip of the vee.
        for lost in [2, 4] {
            let what = format!("{:?} without {lost}", swarm.formation.shape);
            let mut flight = Flight::new(&swarm);
            flight.fly(1.0, |_| ());
            flight.kill(&[lost]);
            let closing = flight.recover(25.0, 0.05);
            assert!(closing.felt_m > 5.0, "{what}: else nothing had to close, {closing:?}");
            assert!(closing.whole_s < 20.0 && closing.closest_commanded_m > 8.0, "{what}: {closing:?}");
            assert!(flight.all_agree_with_the_truth(), "{what}");
            flight.start(&[lost]);
            let opening = flight.recover(60.0, 0.05);
            assert!(opening.whole_s < 55.0 && flight.moment().commanded == 6, "{what}: {opening:?}");
        }
    }
}

#[test]
fn the_swarm_changes_its_shape_as_planned() {
    for seed in [1, 2] {
        let flown =
            ringwing_simulation::fly(&preset("shape-change", &[&format!("seed={seed}")])).expect("a flight");
        assert_eq!(flown.summary.faults, 0, "a manoeuvre is no fault");
        assert_eq!(flown.summary.fault_moments, 3);
        assert!(
            flown.summary.recovery_max_s.is_some_and(|longest_s| longest_s < 20.0),
            "{:?}",
            flown.summary
        );
        assert!(flown.summary.closest_pair.is_some_and(|pair| pair.distance_m > 8.0), "{:?}", flown.summary);
    }
}

#[test]
fn a_loss_during_a_manoeuvre_and_a_return_after_it_are_healed() {
    let faults = ["at 38 s kill uav 2", "at 66 s start uav 2"];
    let mut flight = Flight::new(&with_faults(preset("shape-change", &[]), &faults));
    let error_at = |flight: &mut Flight, at_s: f64| {
        flight.fly_to((at_s * 100.0) as i64);
        flight.slot_error_max_m()
    };
    assert!(error_at(&mut flight, 34.0) < 0.05, "a ring of six");
    assert!(error_at(&mut flight, 39.0) > 5.0, "else nothing had to move");
    assert!(error_at(&mut flight, 59.0) < 0.05 && flight.moment().commanded == 5, "a vee of five");
    assert!(error_at(&mut flight, 119.0) < 0.05 && flight.moment().commanded == 6, "a ring of six");
    assert!(flight.all_agree_with_the_truth());
}

/// The figures of ARCHITECTURE.md: `cargo test --release -p ringwing-simulation -- --ignored --nocapture of_the_shapes`.
#[test]
#[ignore = "flies for some minutes"]
fn figures_of_the_shapes() {
    for setting in ["collision_filter=true", "collision_filter=false", "law=paper"] {
        for uavs in [6, 12] {
            for shape in SHAPES {
                let flights = form_all(1..=200, |seed| drawn(shape, uavs, seed, &[setting]));
                let count = |is: &dyn Fn(&Forming) -> bool| flights.iter().filter(|one| is(one)).count();
                let nearest_m = flights.iter().map(|one| one.closest_m).fold(f64::INFINITY, f64::min);
                println!(
                    "{setting}, {shape}, n = {uavs}: median {:.2} s, {} stuck, {} collide, closest {nearest_m:.2} m",
                    median_s(&flights),
                    count(&|one| one.formed_s.is_infinite()),
                    count(&|one| one.closest_m < 2.0),
                );
            }
        }
    }
}
