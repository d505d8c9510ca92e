//! How a run went: the verdict, and everything that `summary.json` says.
//!
//! Never reports 0 for a value that does not exist: the value is null in the JSON.

use crate::metrics::{Deviation, FlightSummary, ObstacleSummary, Verdict, judge};
use ringwing_flight::{Collision, Latency, Tick, WorldReport, real_time_factor};
use ringwing_scenario::{Law, Scenario, ShapeName};
use serde::Serialize;
use std::time::Duration;

/// A run in numbers. The names of the fields are those of `summary.json`.
#[derive(Debug, Clone, Serialize)]
pub struct Summary {
    /// Name of the scenario.
    pub scenario: String,
    /// The seed of every random draw.
    pub seed: u64,
    /// The seed again. Programs that read every number as a float, such as `jq`, round one above 2^53.
    pub seed_text: String,
    /// Number of UAVs.
    pub uavs: u32,
    /// The shape of the formation.
    pub shape: ShapeName,
    /// The shape after the last manoeuvre.
    pub shape_at_end: ShapeName,
    /// Whether the air stands still in all of the flight.
    pub air_is_still: bool,
    /// The control law.
    pub law: Law,
    /// Ticks a second.
    pub rate_hz: u32,
    /// Whether the flight followed the wall clock.
    pub real_time: bool,
    /// The last tick flown.
    pub ticks: i64,
    /// Simulated time up to that tick.
    pub simulated_s: f64,
    /// Wall-clock time from the command to the first tick; absent for a log.
    pub start_s: Option<f64>,
    /// Wall-clock time from the first tick to the last; absent for a log.
    pub wall_s: Option<f64>,
    /// Simulated time by wall-clock time.
    pub real_time_factor: Option<f64>,
    /// Hash of all payloads; equal hashes mean equal flights. Absent if the world ended early.
    pub payload_hash: Option<String>,
    /// The verdict on the run.
    pub verdict: Verdict,
    /// Why the run or its log is not whole.
    pub failures: Vec<String>,
    /// The requirements that the flight violated.
    pub violations: Vec<String>,
    /// Whether chance had no part in the flight; the events by chance are in `flight`.
    pub repeatable: Option<bool>,
    /// Number of processes that were lost although no fault asked for it.
    pub unplanned_losses: Option<u64>,
    /// The first time from which every slot error stays within 1 m for 5 s.
    pub settling_s: Option<f64>,
    /// Number of faults.
    pub faults: Option<u64>,
    /// The longest recovery from a fault; `None` unless the formation was seen to recover from every fault.
    pub recovery_max_s: Option<f64>,
    /// The largest slot error at the end.
    pub slot_error_max_m: Option<f64>,
    /// The root of the mean of the squared slot errors at the end.
    pub slot_error_rms_m: Option<f64>,
    /// The largest `| |p_i - p_j| - L |` of ring neighbours at the end.
    pub neighbour_error_max_m: Option<f64>,
    /// The largest `| |p_i - p_c| - R |` at the end.
    pub radius_error_max_m: Option<f64>,
    /// The smallest distance of any two UAVs.
    pub closest_pair_m: Option<f64>,
    /// The smallest distance of ring neighbours.
    pub closest_adjacent_m: Option<f64>,
    /// The smallest distance of two UAVs that are not ring neighbours.
    pub closest_other_m: Option<f64>,
    /// The closest approach to each obstacle, in the scenario's order.
    pub obstacles: Vec<ObstacleSummary>,
    /// Number of collisions.
    pub collisions: Option<usize>,
    /// The collisions, in order of time.
    pub collision_list: Option<Vec<CollisionRow>>,
    /// How many times an airframe went into its failsafe.
    pub failsafes: Option<u32>,
    /// Number of commands that airframes refused.
    pub refused_commands: Option<u64>,
    /// Number of times that an airframe flew on an older command.
    pub reused_commands: Option<u64>,
    /// Number of deadlines missed by a whole period or more.
    pub missed_deadlines: Option<u64>,
    /// Number of ticks without every answer.
    pub unanswered_ticks: Option<u64>,
    /// How long after its deadline the latest tick was opened.
    pub late_max_us: Option<f64>,
    /// How long the round trips of the ticks took.
    pub latency: Option<Latency>,
    /// What the faults have cost, if the flight was compared with the same one without them.
    pub deviation: Option<Deviation>,
    /// Path of the log.
    pub log: Option<String>,
    /// Number of messages in it.
    pub log_messages: Option<u64>,
    /// Number of ticks that nobody measured.
    pub ticks_lost: Option<u64>,
    /// The command that repeats the run.
    pub command: String,
    /// The flight in numbers.
    pub flight: Option<FlightSummary>,
}

/// What a run that has just ended tells about itself.
#[derive(Debug)]
pub struct RunFindings<'a> {
    /// What the world counted; `None` if it died.
    pub world: Option<&'a WorldReport>,
    /// What was measured; `None` if no recorder left a report.
    pub flight: Option<FlightSummary>,
    /// Why the run failed, if it did.
    pub failures: Vec<String>,
    /// The last tick flown.
    pub ticks: i64,
    /// Wall-clock time from the command to the first tick.
    pub start_time: Duration,
    /// Wall-clock time from the first tick to the last.
    pub flight_time: Duration,
    /// Path of the log, if there is one.
    pub log: Option<String>,
    /// Number of messages in it.
    pub messages: Option<u64>,
    /// The command that repeats the run.
    pub command: String,
}

/// What a log alone tells about a run.
#[derive(Debug, Default)]
pub struct LogFindings {
    /// What was measured.
    pub flight: FlightSummary,
    /// Number of the last tick with a UAV in it.
    pub ticks: i64,
    /// What the world counted, if the recorder lived to write that.
    pub world: LoggedWorld,
    /// The collisions in the log, in order of time.
    pub collisions: Vec<Collision>,
    /// Why the log does not hold a whole flight.
    pub failures: Vec<String>,
    /// How long the round trips of the ticks took, in logs with timing.
    pub latency: Option<Latency>,
    /// Path of the log.
    pub log: String,
    /// Number of its messages.
    pub messages: u64,
    /// The command that repeats the flight.
    pub command: String,
}

/// The world's account of the flight, as far as the log holds it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LoggedWorld {
    /// Hash of all payloads.
    pub payload_hash: Option<String>,
    /// The number of collisions.
    pub collisions: Option<usize>,
    /// How many times an airframe went into its failsafe.
    pub failsafes: Option<u32>,
    /// Number of commands that airframes refused.
    pub refused_commands: Option<u64>,
    /// Number of times that an airframe flew on an older command.
    pub reused_commands: Option<u64>,
    /// Number of deadlines missed by a whole period or more.
    pub missed_deadlines: Option<u64>,
    /// Number of ticks without every answer.
    pub unanswered_ticks: Option<u64>,
    /// How long after its deadline the latest tick was opened.
    pub late_max_us: Option<f64>,
    /// How long the round trips of the ticks took.
    pub latency: Option<Latency>,
}

/// A collision as the summary lists it.
#[derive(Debug, Clone, Serialize)]
pub struct CollisionRow {
    /// Simulated time.
    pub time_s: f64,
    /// The UAV; if two UAVs collided, the one with the lower number.
    pub uav: u32,
    /// `uav 4`, `intruder 1`, or the obstacle's name.
    pub with: String,
    /// Where the UAV was, in the local frame.
    pub position_m: [f64; 2],
}

fn collision_rows(collisions: &[Collision], scenario: &Scenario) -> Vec<CollisionRow> {
    let row = |&Collision { time_s, uav, with: collider, position_m }: &Collision| CollisionRow {
        time_s,
        uav: uav.0,
        with: scenario.collider_name(collider),
        position_m,
    };
    collisions.iter().map(row).collect()
}

impl Summary {
    /// The summary of a run of `scenario` that has just ended.
    pub fn of_run(scenario: &Scenario, found: RunFindings) -> Self {
        let (failures, violations) = judged(scenario, &found);
        let wall_s = found.flight_time.as_secs_f64();
        let world = found.world;
        let count = |get: fn(&WorldReport) -> u64| world.map(get);
        let flown = Self::flown(scenario, found.ticks, found.flight);
        Self {
            start_s: Some(found.start_time.as_secs_f64()),
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
            log: found.log,
            log_messages: found.messages,
            command: found.command,
            ..flown
        }
    }

    /// The summary of a flight from its log, which does not hold the wall-clock times of the run.
    pub fn of_log(scenario: &Scenario, found: LogFindings) -> Self {
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
            shape_at_end: scenario.shape_at(Tick(ticks)),
            air_is_still: scenario.wind.is_still(),
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
            deviation: None,
            log: None,
            log_messages: None,
            ticks_lost: flight.as_ref().map(|flight| flight.ticks_lost),
            command: String::new(),
            flight,
        }
    }

    /// The content of `summary.json`.
    ///
    /// # Panics
    /// Never: a summary has only strings for keys.
    pub fn to_json(&self) -> String {
        serde_json::to_string_pretty(self).expect("a summary has only strings for keys")
    }
}

/// The failures of the run and the requirements that it violated.
fn judged(scenario: &Scenario, found: &RunFindings) -> (Vec<String>, Vec<String>) {
    let mut failures = found.failures.clone();
    // If the run failed, the failure explains the missing report.
    if failures.is_empty() && found.world.is_none() {
        failures.push("the world left no report".into());
    }
    let Some(flight) = &found.flight else {
        if failures.is_empty() {
            failures.push("the recorder left no report, so the flight was not measured".into());
        }
        return (failures, Vec::new());
    };
    let collisions = found.world.map(|world| world.collisions.len());
    (failures, judge(scenario, flight, collisions))
}

fn verdict(failures: &[String], violations: &[String]) -> Verdict {
    match (failures.is_empty(), violations.is_empty()) {
        (false, _) => Verdict::Failed,
        (true, false) => Verdict::Violated,
        (true, true) => Verdict::Passed,
    }
}
