//! The simulation and the processes fly the same: payload hash, every measure, the verdict, and what happened when.

use crate::harness::{Finished, Swarm};
use ringwing_flight::{Collision, Event, Part, ProcessAction, Reporter, TimedEvent};
use ringwing_recorder::{
    log::reader::Reader,
    metrics::{FlightSummary, Verdict},
};
use ringwing_scenario::{Scenario, Source, preset};
use ringwing_simulation::{Flown, fly, random};
use serde_json::{Value, json};
use std::env;

/// By the wall clock, how long a run of these tests waits for an answer. A busy machine must not decide how it goes.
const PATIENCE_S: f64 = 60.0;
/// Random scenarios of the usual test. Each takes a second or two with real processes.
const RANDOM_FLIGHTS: u64 = 12;
/// Random scenarios of the test for whoever has the time; the simulation's own tests fly the same ones.
const ALL_RANDOM_FLIGHTS: u64 = 300;

/// Flies `scenario` by processes and in the simulation; returns what differs, one line each.
fn differences(scenario: &Scenario) -> Vec<String> {
    let run = Swarm::fly_scenario(scenario).finish();
    run.assert_nothing_left();
    let flown = fly(scenario).expect("the simulation flies it");
    let mut differences = Vec::new();
    let (simulated, real) = (figures(scenario, &flown), &run.summary);
    for (key, value) in simulated.as_object().expect("an object") {
        differences.extend(difference(key, value, &real[key]));
    }
    differences.extend(flight_differences(&flown, &real["flight"]));
    differences.extend(event_difference(&flown.events, &logged_events(&run, scenario)));
    differences
}

/// What differs in the recorder's measures.
///
/// The counts of links come from the agents, and not with the journal: of an agent that ends, or for a recorder that is
/// replaced, the last ones may be lost. So they are compared only if every process lives from its beginning to its end.
fn flight_differences(flown: &Flown, real: &Value) -> Vec<String> {
    let has_all_links = !flown.events.iter().any(|timed| starts_or_ends(&timed.event));
    // The same type on both sides, so that its defaults and its numbers are read alike.
    let Ok(real) = serde_json::from_value::<FlightSummary>(real.clone()) else {
        return vec![format!("flight: measured in the simulation, flown {real}")];
    };
    let fields = |summary| serde_json::to_value(summary).expect("a summary is plain data");
    let (simulated, real) = (fields(&flown.summary), fields(&real));
    // Which link faults acted comes with these counts.
    let is_compared = |key: &str| !matches!(key, "links" | "fault_effects") || has_all_links;
    let compared = simulated.as_object().expect("an object").iter().filter(|(key, _)| is_compared(key));
    compared.filter_map(|(key, value)| difference(&format!("flight.{key}"), value, &real[key])).collect()
}

/// Whether a fault starts or ends a process in this event.
fn starts_or_ends(event: &Event) -> bool {
    use ProcessAction::{Freeze, Thaw};
    matches!(event, Event::ProcessFault { action, .. } if !matches!(action, Freeze | Thaw))
}

fn difference(key: &str, simulated: &Value, real: &Value) -> Option<String> {
    (simulated != real).then(|| format!("{key}: simulated {simulated}, flown {real}"))
}

/// The figures of `summary.json` that do not depend on a wall clock, as the simulation has them.
fn figures(scenario: &Scenario, flown: &Flown) -> Value {
    let report = flown.report.as_ref().expect("the world lives to the end");
    let collisions: Vec<_> =
        report.collisions.iter().map(|collision| collision_row(scenario, collision)).collect();
    json!({
        "verdict": flown.verdict(),
        "failures": [],
        "violations": flown.violations,
        "payload_hash": report.payload_hash,
        "ticks": report.last_tick,
        "collisions": report.collisions.len(),
        "collision_list": collisions,
        "failsafes": report.failsafes,
        "refused_commands": report.refused_commands,
        "reused_commands": report.reused_commands,
        "missed_deadlines": report.missed_deadlines,
        "unanswered_ticks": report.unanswered_ticks,
    })
}

fn collision_row(scenario: &Scenario, collision: &Collision) -> Value {
    json!({
        "time_s": collision.time_s,
        "uav": collision.uav,
        "with": scenario.collider_name(collision.with),
        "position_m": collision.position_m,
    })
}

/// The events in the run's log, without the recorder's own, which tell of the log and not of the flight.
fn logged_events(run: &Finished, scenario: &Scenario) -> Vec<TimedEvent> {
    let mut reader = Reader::open(&run.folder).expect("the run has a log");
    let of_flight = |timed: &TimedEvent| timed.event.reporter() != Reporter::Recorder;
    reader.ticks(scenario).flat_map(|tick| tick.events).filter(of_flight).collect()
}

/// The first event that is not the same in both.
fn event_difference(simulated: &[TimedEvent], real: &[TimedEvent]) -> Option<String> {
    let place =
        (0..simulated.len().max(real.len())).find(|place| simulated.get(*place) != real.get(*place))?;
    Some(format!("event {place}: simulated {:?}, flown {:?}", simulated.get(place), real.get(place)))
}

fn assert_same(name: &str, scenario: &Scenario) {
    let differences = differences(scenario);
    assert!(differences.is_empty(), "{name}:\n{}", differences.join("\n"));
}

fn assert_random_flights_are_the_same(seeds: impl Iterator<Item = u64>) {
    let mut wrong = Vec::new();
    for seed in seeds {
        let differences = differences(&random::scenario(seed));
        if !differences.is_empty() {
            wrong.push(format!("seed {seed}:\n{}", differences.join("\n")));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn every_preset_flies_the_same_simulated_and_by_processes() {
    for preset in preset::all() {
        let mut scenario = Scenario::read(&Source::find(preset.name).unwrap(), &[]).unwrap();
        scenario.supervision.answer_timeout_s = PATIENCE_S;
        assert_same(preset.name, &scenario);
    }
}

#[test]
fn a_dozen_random_scenarios_fly_the_same_simulated_and_by_processes() {
    assert_random_flights_are_the_same(0..RANDOM_FLIGHTS);
}

/// Takes ten minutes on two cores. `RINGWING_RANDOM_FLIGHTS=40..60` flies only these seeds.
#[test]
#[ignore = "takes ten minutes; run it after a change of the bus, the launcher, the world or the agent"]
fn all_random_scenarios_fly_the_same_simulated_and_by_processes() {
    let seeds = env::var("RINGWING_RANDOM_FLIGHTS").map_or(0..ALL_RANDOM_FLIGHTS, |text| {
        let (first, end) = text.split_once("..").expect("a range of seeds such as 40..60");
        let seed = |text: &str| text.parse().expect("a seed");
        seed(first)..seed(end)
    });
    assert_random_flights_are_the_same(seeds);
}

#[test]
fn a_world_that_a_fault_ends_fails_the_run_in_both() {
    let mut scenario = Scenario::read(&Source::find("paper-4.1").unwrap(), &[]).unwrap();
    scenario.faults = ["at 1 s kill uav 3", "at 2 s link all loss 5 %", "at 2 s kill world"]
        .iter()
        .map(|sentence| sentence.parse().unwrap())
        .collect();
    let run = Swarm::fly_scenario(&scenario).finish();
    run.assert_nothing_left();
    let flown = fly(&scenario).unwrap();
    assert_eq!((run.text("verdict"), run.summary["payload_hash"].is_null()), ("failed", true));
    assert_eq!((flown.verdict(), flown.report.is_none()), (Verdict::Failed, true));
    assert_eq!(flown.events, logged_events(&run, &scenario));
    let last = &flown.events.last().unwrap().event;
    assert!(matches!(last, Event::ProcessFault { part: Part::World, .. }), "{last:?}");
}
