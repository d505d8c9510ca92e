//! Flies one flight of a sweep with real processes.
//!
//! Never decides what a flight is worth: it turns the summary of a run into the outcome that a simulated flight has.

use crate::own_run;
use ringwing_flight::{Collider, Collision, IntruderId, UavId, WorldReport};
use ringwing_recorder::metrics::{Deviation, FlightSummary};
use ringwing_scenario::Scenario;
use ringwing_study::Outcome;
use serde::Deserialize;

/// What a flight of a sweep takes from the summary of a run.
#[derive(Deserialize)]
struct Run {
    failures: Vec<String>,
    payload_hash: Option<String>,
    ticks: i64,
    collision_list: Option<Vec<CollisionRow>>,
    failsafes: Option<u32>,
    refused_commands: Option<u64>,
    reused_commands: Option<u64>,
    missed_deadlines: Option<u64>,
    unanswered_ticks: Option<u64>,
    flight: Option<FlightSummary>,
    deviation: Option<Deviation>,
}

#[derive(Deserialize)]
struct CollisionRow {
    time_s: f64,
    uav: u32,
    with: String,
    position_m: [f64; 2],
}

/// Flies `scenario` with processes, and measures it against its baseline if asked to; `Err` says why it could not be flown.
pub(super) fn fly(scenario: &Scenario, with_baseline: bool) -> Result<Outcome, String> {
    // A baseline is compared with the log. Without a log there still is a recorder that measures, and a row needs no more.
    let measured = if with_baseline { "--baseline" } else { "--no-record" };
    let run: Run = own_run::fly(scenario, &[measured], None).map_err(|error| error.to_string())?;
    let Some(summary) = run.flight.clone() else {
        return Err(run.failures.join("; "));
    };
    let report = report(scenario, &run);
    let outcome = Outcome::judged(scenario, summary, report, Vec::new());
    Ok(Outcome { deviation: run.deviation, ..outcome })
}

/// The world's report, from the summary; `None` if the world left none.
fn report(scenario: &Scenario, run: &Run) -> Option<WorldReport> {
    let collisions = run.collision_list.as_ref()?.iter().filter_map(|row| collision(scenario, row)).collect();
    Some(WorldReport {
        last_tick: run.ticks,
        complete: run.failures.is_empty(),
        payload_hash: run.payload_hash.clone()?,
        collisions,
        failsafes: run.failsafes?,
        refused_commands: run.refused_commands?,
        reused_commands: run.reused_commands?,
        missed_deadlines: run.missed_deadlines?,
        unanswered_ticks: run.unanswered_ticks?,
        late_max_us: 0.0,
        latency: None,
    })
}

fn collision(scenario: &Scenario, row: &CollisionRow) -> Option<Collision> {
    // A number of `what`, as in `uav 3`.
    let number = |what: &str| row.with.strip_prefix(what)?.parse().ok();
    let of_obstacle = || scenario.all_obstacles().iter().position(|obstacle| obstacle.name == row.with);
    let with = if let Some(uav) = number("uav ") {
        Collider::Uav(UavId(uav))
    } else if let Some(intruder) = number("intruder ") {
        Collider::Intruder(IntruderId(intruder))
    } else {
        Collider::Obstacle(of_obstacle()? as u32)
    };
    Some(Collision { time_s: row.time_s, uav: UavId(row.uav), with, position_m: row.position_m })
}
