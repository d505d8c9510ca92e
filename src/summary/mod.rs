//! How a run went: the verdict, and everything that `summary.json` and the printed summary say.
//!
//! Never reports 0 for a value that does not exist: the value is null in the JSON and a dash in the text.

mod disturbances;
mod faults;
mod line;
mod text;

use crate::{
    FAILED, VIOLATED,
    launcher::{Outcome, log_in},
};
use ringwing_flight::{Collider, Collision, Latency, WorldReport, real_time_factor};
use ringwing_recorder::{
    judge,
    metrics::{FlightSummary, ObstacleSummary},
};
use ringwing_scenario::Scenario;
use serde::Serialize;
use std::process::ExitCode;

/// The verdict on a run.
/// From the best to the worst.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Verdict {
    /// The run flew and met its requirements.
    Passed,
    /// The run flew, but violated a requirement.
    Violated,
    /// The run did not fly to its end, or something went wrong that no requirement covers.
    Failed,
}

impl Verdict {
    /// The exit code of the command.
    pub(crate) fn exit_code(self) -> ExitCode {
        match self {
            Self::Passed => ExitCode::SUCCESS,
            Self::Violated => ExitCode::from(VIOLATED),
            Self::Failed => ExitCode::from(FAILED),
        }
    }
}

/// A run in numbers. The names of the fields are those of `summary.json`.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Summary {
    scenario: String,
    seed: u64,
    /// The seed again. Programs that read every number as a float, such as `jq`, round one above 2^53.
    seed_text: String,
    uavs: u32,
    shape: ringwing_scenario::ShapeName,
    law: ringwing_scenario::Law,
    rate_hz: u32,
    real_time: bool,
    ticks: i64,
    simulated_s: f64,
    start_s: Option<f64>,
    wall_s: Option<f64>,
    real_time_factor: Option<f64>,
    payload_hash: Option<String>,
    pub(crate) verdict: Verdict,
    failures: Vec<String>,
    violations: Vec<String>,
    /// Whether chance had no part in the flight; the events by chance are in `flight`.
    repeatable: Option<bool>,
    unplanned_losses: Option<u64>,
    settling_s: Option<f64>,
    faults: Option<u64>,
    /// The longest recovery from a fault; `None` unless the formation was seen to recover from every fault.
    recovery_max_s: Option<f64>,
    slot_error_max_m: Option<f64>,
    slot_error_rms_m: Option<f64>,
    neighbour_error_max_m: Option<f64>,
    radius_error_max_m: Option<f64>,
    closest_pair_m: Option<f64>,
    closest_adjacent_m: Option<f64>,
    closest_other_m: Option<f64>,
    obstacles: Vec<ObstacleSummary>,
    collisions: Option<usize>,
    collision_list: Option<Vec<CollisionRow>>,
    failsafes: Option<u32>,
    refused_commands: Option<u64>,
    reused_commands: Option<u64>,
    missed_deadlines: Option<u64>,
    unanswered_ticks: Option<u64>,
    late_max_us: Option<f64>,
    latency: Option<Latency>,
    log: Option<String>,
    log_messages: Option<u64>,
    ticks_lost: Option<u64>,
    command: String,
    flight: Option<FlightSummary>,
}

/// What a log alone tells about a run.
#[derive(Debug, Default)]
pub(crate) struct LogFindings {
    pub(crate) flight: FlightSummary,
    /// Number of the last tick with a UAV in it.
    pub(crate) ticks: i64,
    /// What the world counted, if the recorder lived to write that.
    pub(crate) world: LoggedWorld,
    /// The collisions in the log, in order of time.
    pub(crate) collisions: Vec<Collision>,
    /// Why the log does not hold a whole flight.
    pub(crate) failures: Vec<String>,
    pub(crate) latency: Option<Latency>,
    /// Path of the log.
    pub(crate) log: String,
    pub(crate) messages: u64,
    /// The command that repeats the flight.
    pub(crate) command: String,
}

/// The world's account of the flight, as far as the log holds it.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct LoggedWorld {
    pub(crate) payload_hash: Option<String>,
    /// The number of collisions.
    pub(crate) collisions: Option<usize>,
    pub(crate) failsafes: Option<u32>,
    pub(crate) refused_commands: Option<u64>,
    pub(crate) reused_commands: Option<u64>,
    pub(crate) missed_deadlines: Option<u64>,
    pub(crate) unanswered_ticks: Option<u64>,
    pub(crate) late_max_us: Option<f64>,
    pub(crate) latency: Option<Latency>,
}

/// A collision as the summary lists it.
#[derive(Debug, Clone, Serialize)]
struct CollisionRow {
    time_s: f64,
    uav: u32,
    /// `uav 4`, or the obstacle's name.
    with: String,
    position_m: [f64; 2],
}

fn collision_rows(collisions: &[Collision], scenario: &Scenario) -> Vec<CollisionRow> {
    let with = |collider| match collider {
        Collider::Uav(uav) => uav.to_string(),
        Collider::Obstacle(index) => scenario.obstacle_name(index),
    };
    let row = |&Collision { time_s, uav, with: collider, position_m }: &Collision| CollisionRow {
        time_s,
        uav: uav.0,
        with: with(collider),
        position_m,
    };
    collisions.iter().map(row).collect()
}

impl Summary {
    /// The summary of a run of `scenario` that ended with `outcome`; `command` repeats the run.
    pub(crate) fn new(scenario: &Scenario, outcome: &Outcome, recorded: bool, command: String) -> Self {
        let world = outcome.world.as_ref();
        let (failures, violations) = judged(scenario, outcome);
        let wall_s = outcome.flight_time.as_secs_f64();
        let count = |get: fn(&WorldReport) -> u64| world.map(get);
        let flight = outcome.recorder.as_ref().map(|report| report.summary.clone());
        let flown = Self::flown(scenario, outcome.ticks, flight);
        Self {
            start_s: Some(outcome.start_time.as_secs_f64()),
            wall_s: Some(wall_s),
            real_time_factor: real_time_factor(flown.simulated_s, wall_s),
            payload_hash: world.map(|world| world.payload_hash.clone()),
            verdict: verdict(&failures, &violations),
            failures,
            violations,
            collisions: world.map(|world| world.collisions.len()),
            collision_list: world.map(|world| collision_rows(&world.collisions, scenario)),
            failsafes: world.map(|world| world.failsafes),
            refused_commands: count(|world| world.refused_commands),
            reused_commands: count(|world| world.reused_commands),
            missed_deadlines: count(|world| world.missed_deadlines),
            unanswered_ticks: count(|world| world.unanswered_ticks),
            late_max_us: world.map(|world| world.late_max_us),
            latency: world.and_then(|world| world.latency),
            log: recorded.then(|| log_in(&outcome.folder).display().to_string()),
            // With `--no-record` there is a recorder too, for the measures, but no log.
            log_messages: outcome.recorder.as_ref().filter(|_| recorded).map(|report| report.messages),
            command,
            ..flown
        }
    }

    /// The summary of a flight from its log, which does not hold the wall-clock times of the run.
    pub(crate) fn of_log(scenario: &Scenario, found: LogFindings) -> Self {
        // The log of a recorder that was replaced may lack events; the world has counted every collision.
        let collisions = found.world.collisions.unwrap_or(found.collisions.len());
        let violations = judge(scenario, &found.flight, Some(collisions));
        Self {
            verdict: verdict(&found.failures, &violations),
            failures: found.failures,
            violations,
            collisions: Some(collisions),
            collision_list: Some(collision_rows(&found.collisions, scenario)),
            failsafes: found.world.failsafes,
            refused_commands: found.world.refused_commands,
            reused_commands: found.world.reused_commands,
            missed_deadlines: found.world.missed_deadlines,
            unanswered_ticks: found.world.unanswered_ticks,
            late_max_us: found.world.late_max_us,
            payload_hash: found.world.payload_hash,
            latency: found.latency,
            log: Some(found.log),
            log_messages: Some(found.messages),
            command: found.command,
            ..Self::flown(scenario, found.ticks, Some(found.flight))
        }
    }

    /// The part of a summary that the flight decides; the rest is left empty.
    fn flown(scenario: &Scenario, ticks: i64, flight: Option<FlightSummary>) -> Self {
        let of = |get: fn(&FlightSummary) -> Option<f64>| flight.as_ref().and_then(get);
        // A run that ends before its flight stops at the approach, a tick before tick 0.
        let ticks = ticks.max(0);
        Self {
            scenario: scenario.name.clone(),
            seed: scenario.seed,
            seed_text: scenario.seed.to_string(),
            uavs: scenario.formation.uavs,
            shape: scenario.formation.shape,
            law: scenario.control.law,
            rate_hz: scenario.time.rate_hz,
            real_time: scenario.time.real_time,
            ticks,
            simulated_s: ticks as f64 / f64::from(scenario.time.rate_hz),
            start_s: None,
            wall_s: None,
            real_time_factor: None,
            payload_hash: None,
            // A placeholder: both callers judge the run. If one ever forgets, no run passes by mistake.
            verdict: Verdict::Failed,
            failures: Vec::new(),
            violations: Vec::new(),
            repeatable: flight.as_ref().map(|flight| flight.chance_events == 0),
            unplanned_losses: flight.as_ref().map(|flight| flight.unplanned_losses),
            settling_s: of(|flight| flight.settling_s),
            faults: flight.as_ref().map(|flight| flight.faults),
            recovery_max_s: of(|flight| flight.recovery_max_s),
            slot_error_max_m: of(|flight| flight.slot_error_max_m),
            slot_error_rms_m: of(|flight| flight.slot_error_rms_m),
            neighbour_error_max_m: of(|flight| flight.neighbour_error_max_m),
            radius_error_max_m: of(|flight| flight.radius_error_max_m),
            closest_pair_m: of(|flight| flight.closest_pair.map(|pair| pair.distance_m)),
            closest_adjacent_m: of(|flight| flight.closest_adjacent.map(|pair| pair.distance_m)),
            closest_other_m: of(|flight| flight.closest_other.map(|pair| pair.distance_m)),
            obstacles: flight.as_ref().map(|flight| flight.obstacles.clone()).unwrap_or_default(),
            collisions: None,
            collision_list: None,
            failsafes: None,
            refused_commands: None,
            reused_commands: None,
            missed_deadlines: None,
            unanswered_ticks: None,
            late_max_us: None,
            latency: None,
            log: None,
            log_messages: None,
            ticks_lost: flight.as_ref().map(|flight| flight.ticks_lost),
            command: String::new(),
            flight,
        }
    }

    /// Why the run or its log is not whole.
    pub(crate) fn failures(&self) -> &[String] {
        &self.failures
    }

    /// The content of `summary.json`.
    pub(crate) fn to_json(&self) -> String {
        serde_json::to_string_pretty(self).expect("a summary has only strings for keys")
    }
}

/// The failures of the run and the requirements that it violated.
fn judged(scenario: &Scenario, outcome: &Outcome) -> (Vec<String>, Vec<String>) {
    let mut failures = outcome.failures.clone();
    // If the run failed, the failure explains the missing report.
    if failures.is_empty() && outcome.world.is_none() {
        failures.push("the world left no report".into());
    }
    let Some(report) = &outcome.recorder else {
        if failures.is_empty() {
            failures.push("the recorder left no report, so the flight was not measured".into());
        }
        return (failures, Vec::new());
    };
    let collisions = outcome.world.as_ref().map(|world| world.collisions.len());
    (failures, judge(scenario, &report.summary, collisions))
}

fn verdict(failures: &[String], violations: &[String]) -> Verdict {
    match (failures.is_empty(), violations.is_empty()) {
        (false, _) => Verdict::Failed,
        (true, false) => Verdict::Violated,
        (true, true) => Verdict::Passed,
    }
}

#[cfg(test)]
mod tests;
