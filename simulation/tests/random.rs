//! Whatever happens to a swarm, flying the same scenario again gives the same flight.

use ringwing_flight::{Event, LinkCounts, TimedEvent};
use ringwing_recorder::metrics::LinkTotals;
use ringwing_scenario::Scenario;
use ringwing_simulation::{Flown, Measurement, Simulation, fly, random};
use std::{collections::BTreeSet, thread};

/// Seeds of the scenarios to fly. A failure names its seed: `random::scenario(seed)` is all it takes to repeat it.
const SEEDS: std::ops::Range<u64> = 0..300;

fn assert_balanced(seed: u64, counts: &LinkCounts) {
    let LinkCounts { offered, delivered, lost, corrupted, duplicated, in_flight, .. } = *counts;
    assert_eq!(offered + duplicated, delivered + lost + corrupted + in_flight, "seed {seed}: {counts:?}");
}

fn assert_totals_balanced(seed: u64, totals: &LinkTotals) {
    let LinkTotals { offered, delivered, lost, corrupted, duplicated, in_flight, .. } = *totals;
    assert_eq!(offered + duplicated, delivered + lost + corrupted + in_flight, "seed {seed}: {totals:?}");
}

/// Flies `scenario` step by step and checks what holds in every tick.
fn fly_checked(scenario: &Scenario, seed: u64) -> Flown {
    let mut simulation = Simulation::new(scenario).expect("room for all");
    let mut measurement = Measurement::new(scenario);
    let mut goes_on = true;
    while goes_on {
        goes_on = simulation.step();
        measurement.observe(&simulation);
        simulation.links().iter().for_each(|counts| assert_balanced(seed, counts));
        let next = simulation.flown().expect("a tick was flown").next();
        let is_of_next = |event: &TimedEvent| event.tick == next;
        assert!(simulation.events().iter().all(is_of_next), "seed {seed}: {:?}", simulation.events());
    }
    measurement.finish(&simulation)
}

/// Flies the scenario of `seed` twice; returns the names of its events and its verdict.
fn fly_twice(seed: u64) -> BTreeSet<&'static str> {
    let scenario = random::scenario(seed);
    let (one, other) = (fly_checked(&scenario, seed), fly(&scenario).expect("room for all"));
    assert_eq!(one.report, other.report, "seed {seed}");
    assert_eq!(one.events, other.events, "seed {seed}");
    assert_eq!(one.summary, other.summary, "seed {seed}");
    assert_eq!(one.summary.last_tick, Some(scenario.last_tick()), "seed {seed}");
    one.summary.links.iter().for_each(|totals| assert_totals_balanced(seed, totals));
    let by_chance = |timed: &&TimedEvent| timed.event.is_by_chance();
    assert_eq!(one.events.iter().find(by_chance), None, "seed {seed}");
    one.events.iter().map(|timed| timed.event.name()).chain([one.verdict().name()]).collect()
}

#[test]
fn the_same_random_scenario_gives_the_same_flight_and_every_kind_of_event_occurs() {
    let half = |parity: u64| SEEDS.filter(move |seed| seed % 2 == parity).flat_map(fly_twice).collect();
    let occurred: BTreeSet<&str> = thread::scope(|scope| {
        let odd = scope.spawn(|| half(1));
        let even: BTreeSet<&str> = half(0);
        even.union(&odd.join().expect("every flight is repeatable")).copied().collect()
    });
    let expected = [
        "collision",
        "failsafe",
        "fault.airframe",
        "fault.freeze",
        "fault.healed",
        "fault.kill",
        "fault.link",
        "fault.refused",
        "fault.slow",
        "fault.start",
        "fault.stop",
        "fault.thaw",
        "near miss",
        "passed",
        "violated",
    ];
    assert_eq!(occurred, expected.into());
}

/// The impairments that leave an agent without senses for longest.
const OWN_SENSE_FAULTS: [&str; 8] = [
    "link own->3 blackout for 1.2 s",
    "link own->all blackout for 1.2 s",
    "link own->3 delay 1.5 s",
    "link own->all hold for 2 s",
    "link own->all gilbert loss 60 % burst 800 ms",
    "link own->3 gilbert 5 % 1 %",
    "link own->all rate 0.7 samples/s queue 1",
    "link own->2 corrupt 99 %",
];

#[test]
fn random_flights_whose_agents_lose_their_own_senses_repeat() {
    let mut silent = 0;
    for seed in 0..25_u64 {
        for fault in OWN_SENSE_FAULTS {
            let mut scenario = random::scenario(seed);
            scenario.time.duration_s = 5.0;
            let at_s = 0.5 + (seed as f64) / 50.0;
            let sentence = format!("at {at_s} s {fault}");
            scenario.faults.push(sentence.parse().expect("a fault"));
            let [one, other] = [(); 2].map(|()| fly(&scenario).expect("room for all"));
            assert_eq!(one.report, other.report, "seed {seed}: {sentence}");
            assert_eq!(one.summary, other.summary, "seed {seed}: {sentence}");
            silent += usize::from(one.report.is_some_and(|report| report.failsafes > 0));
        }
    }
    assert!(silent > 100, "only {silent} of 200 flights had an airframe in its failsafe");
}

#[test]
fn another_seed_is_another_flight() {
    let hash = |seed| fly(&random::scenario(seed)).unwrap().report.unwrap().payload_hash;
    assert_ne!(hash(1), hash(2));
    // The seed of the flight itself counts too: it draws what each link loses.
    let mut scenario = random::scenario(1);
    scenario.faults = vec!["at 0 s link all loss 30 %".parse().unwrap()];
    let lossy = |seed| {
        let flown = fly(&Scenario { seed, start: start_of(&scenario), ..scenario.clone() }).unwrap();
        assert!(flown.events.iter().any(|timed| matches!(timed.event, Event::LinkFault { .. })));
        flown.report.unwrap().payload_hash
    };
    assert_ne!(lossy(1), lossy(2));
}

/// The drawn starts of `scenario`, listed, so that another seed leaves them as they are.
fn start_of(scenario: &Scenario) -> ringwing_scenario::StartSection {
    let uavs = ringwing_scenario::start::states(scenario).expect("room for all");
    ringwing_scenario::StartSection { uavs, ..scenario.start.clone() }
}
