//! How a run went: the verdict, the table that people read and the JSON that scripts read.

use crate::{FAILED, VIOLATED, launcher::Outcome};
use ringwing_flight::{Collider, Collision, Latency, WorldReport};
use ringwing_recorder::metrics::{
    ClosestPair, FaultRecovery, FlightSummary, LinkTotals, ObstacleSummary, judge,
};
use ringwing_scenario::Scenario;
use serde::Serialize;
use std::{fmt, process::ExitCode};

/// Swarms up to this size are listed UAV by UAV.
const LISTED_UAVS: usize = 12;
/// So many faults are told one by one.
const LISTED_FAULTS: usize = 12;

/// What the run was worth.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Verdict {
    /// Flew and met its requirements.
    Passed,
    /// Flew, but violated a requirement.
    Violated,
    /// Did not fly to its end, or not as it should.
    Failed,
}

impl Verdict {
    /// What the command ends with.
    pub(crate) fn exit_code(self) -> ExitCode {
        match self {
            Self::Passed => ExitCode::SUCCESS,
            Self::Violated => ExitCode::from(VIOLATED),
            Self::Failed => ExitCode::from(FAILED),
        }
    }
}

/// A run in numbers; a value that does not exist is null, never 0.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Summary {
    scenario: String,
    seed: u64,
    uavs: u32,
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
    settling_s: Option<f64>,
    faults: Option<u64>,
    /// The longest that a fault was felt; none if one was felt to the end, or there was none.
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

/// What a log alone tells of a run.
#[derive(Debug, Default)]
pub(crate) struct Told {
    pub(crate) flight: FlightSummary,
    pub(crate) ticks: i64,
    pub(crate) collisions: usize,
    pub(crate) failures: Vec<String>,
    pub(crate) payload_hash: Option<String>,
    pub(crate) latency: Option<Latency>,
    pub(crate) log: String,
    pub(crate) messages: u64,
    pub(crate) command: String,
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
    /// What became of `scenario`; `command` flies it again.
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
            real_time_factor: (wall_s > 0.0).then(|| flown.simulated_s / wall_s),
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
            log: recorded.then(|| outcome.folder.join("run.mcap").display().to_string()),
            log_messages: outcome.recorder.as_ref().filter(|_| recorded).map(|report| report.messages),
            command,
            ..flown
        }
    }

    /// The same from what a log tells, which knows nothing of wall-clock time.
    pub(crate) fn of_log(scenario: &Scenario, told: Told) -> Self {
        let violations = judge(&scenario.requirements, &told.flight, told.collisions);
        Self {
            verdict: verdict(&told.failures, &violations),
            failures: told.failures,
            violations,
            collisions: Some(told.collisions),
            payload_hash: told.payload_hash,
            latency: told.latency,
            log: Some(told.log),
            log_messages: Some(told.messages),
            command: told.command,
            ..Self::flown(scenario, told.ticks, Some(told.flight))
        }
    }

    /// What was flown; how it came about is not known yet.
    fn flown(scenario: &Scenario, ticks: i64, flight: Option<FlightSummary>) -> Self {
        let of = |get: fn(&FlightSummary) -> Option<f64>| flight.as_ref().and_then(get);
        Self {
            scenario: scenario.name.clone(),
            seed: scenario.seed,
            uavs: scenario.formation.uavs,
            law: scenario.control.law,
            rate_hz: scenario.time.rate_hz,
            real_time: scenario.time.real_time,
            ticks,
            simulated_s: ticks as f64 / f64::from(scenario.time.rate_hz),
            start_s: None,
            wall_s: None,
            real_time_factor: None,
            payload_hash: None,
            verdict: Verdict::Failed,
            failures: Vec::new(),
            violations: Vec::new(),
            settling_s: of(|flight| flight.settling_s),
            faults: flight.as_ref().map(|flight| flight.faults),
            recovery_max_s: of(longest_recovery_s),
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

    /// As `summary.json` holds it.
    pub(crate) fn to_json(&self) -> String {
        serde_json::to_string_pretty(self).expect("a summary has only strings for keys")
    }
}

fn longest_recovery_s(flight: &FlightSummary) -> Option<f64> {
    let all: Option<Vec<f64>> = flight.recoveries.iter().map(|recovery| recovery.recovery_s).collect();
    all?.into_iter().reduce(f64::max)
}

/// Why the run failed, and what it violated.
fn judged(scenario: &Scenario, outcome: &Outcome) -> (Vec<String>, Vec<String>) {
    let mut failures = outcome.failures.clone();
    if failures.is_empty() && outcome.world.is_none() {
        failures.push("the world left no report".into());
    }
    let Some(report) = &outcome.recorder else {
        if failures.is_empty() {
            failures.push("the recorder left no report: nothing is known of the flight".into());
        }
        return (failures, Vec::new());
    };
    let collisions = outcome.world.as_ref().map_or(0, |world| world.collisions.len());
    (failures, judge(&scenario.requirements, &report.summary, collisions))
}

fn verdict(failures: &[String], violations: &[String]) -> Verdict {
    match (failures.is_empty(), violations.is_empty()) {
        (false, _) => Verdict::Failed,
        (true, false) => Verdict::Violated,
        (true, true) => Verdict::Passed,
    }
}

impl fmt::Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mode = if self.real_time { "real time" } else { "lockstep" };
        let Self { scenario, uavs, rate_hz, seed, .. } = self;
        writeln!(f, "{scenario}: {uavs} UAVs, {} law, {rate_hz} Hz, {mode}, seed {seed}\n", self.law.name())?;
        if let Some(flight) = &self.flight {
            write_uavs(f, flight)?;
            write_formation(f, flight)?;
            flight.obstacles.iter().try_for_each(|obstacle| write_obstacle(f, obstacle))?;
            write_recoveries(f, flight)?;
            write_agreement(f, flight)?;
            write_saturation(f, flight)?;
            write_links(f, flight)?;
        }
        self.write_world(f)?;
        self.write_verdict(f)
    }
}

/// One line: what, its value, and anything that goes with it.
fn line(f: &mut fmt::Formatter<'_>, what: &str, value: &str, more: &str) -> fmt::Result {
    writeln!(f, "{}", format!("  {what:<34} {value:<14} {more}").trim_end())
}

/// A value with its unit, or a dash where there is none.
fn metres(value: Option<f64>) -> String {
    value.map_or_else(|| "-".into(), |value| format!("{value:.3} m"))
}

fn write_uavs(f: &mut fmt::Formatter<'_>, flight: &FlightSummary) -> fmt::Result {
    if flight.uavs.is_empty() || flight.uavs.len() > LISTED_UAVS {
        return Ok(());
    }
    writeln!(f, "  at the end   slot error   to previous       to next     to leader")?;
    for uav in &flight.uavs {
        let distances =
            [uav.slot_error_m, uav.previous_distance_m, uav.next_distance_m, uav.leader_distance_m];
        let [slot, previous, next, leader] = distances.map(metres);
        let state = if uav.commanded { "" } else { "   in its failsafe" };
        writeln!(f, "  uav {:<6} {slot:>12} {previous:>13} {next:>13} {leader:>13}{state}", uav.uav)?;
    }
    writeln!(f)
}

fn write_formation(f: &mut fmt::Formatter<'_>, flight: &FlightSummary) -> fmt::Result {
    let settling =
        flight.settling_s.map_or_else(|| "never".into(), |settling_s| format!("{settling_s:.2} s"));
    line(f, "settled within 1 m of every slot", &settling, "")?;
    line(f, "largest slot error at the end", &metres(flight.slot_error_max_m), "")?;
    line(f, "distances to L, largest error", &metres(flight.neighbour_error_max_m), "at the end")?;
    line(f, "distances to R, largest error", &metres(flight.radius_error_max_m), "at the end")?;
    write_pair(f, "closest ring neighbours", flight.closest_adjacent)?;
    write_pair(f, "closest of all others", flight.closest_other)
}

fn write_pair(f: &mut fmt::Formatter<'_>, what: &str, pair: Option<ClosestPair>) -> fmt::Result {
    let who = pair.map(|pair| format!("uav {} and {} at {:.2} s", pair.uav, pair.other, pair.time_s));
    line(f, what, &metres(pair.map(|pair| pair.distance_m)), &who.unwrap_or_default())
}

fn write_obstacle(f: &mut fmt::Formatter<'_>, obstacle: &ObstacleSummary) -> fmt::Result {
    let repelled = match obstacle.repelled.as_slice() {
        [] => "repelled nobody".to_owned(),
        uavs => format!("repelled uav {}", hardest_first(uavs)),
    };
    let who = format!("uav {} at {:.2} s; {repelled}", obstacle.uav, obstacle.time_s);
    line(f, &format!("clearance of {}", obstacle.name), &metres(Some(obstacle.clearance_m)), &who)
}

fn write_recoveries(f: &mut fmt::Formatter<'_>, flight: &FlightSummary) -> fmt::Result {
    for FaultRecovery { fault, time_s, recovery_s } in flight.recoveries.iter().take(LISTED_FAULTS) {
        let value = recovery_s.map_or_else(|| "not".into(), |recovery_s| format!("{recovery_s:.2} s"));
        line(f, "whole again after a fault", &value, &format!("{fault} at {time_s:.2} s"))?;
    }
    let more = flight.faults.saturating_sub(LISTED_FAULTS as u64);
    if more > 0 {
        line(f, "faults beyond these", &more.to_string(), "")?;
    }
    Ok(())
}

/// Nothing to say of a swarm that never disagreed.
fn write_agreement(f: &mut fmt::Formatter<'_>, flight: &FlightSummary) -> fmt::Result {
    let Some(until_s) = flight.disagreed_until_s else { return Ok(()) };
    line(
        f,
        "views of who lives at the end",
        &flight.views.to_string(),
        &format!("differed until {until_s:.2} s"),
    )
}

/// Some numbers, and how many more.
fn hardest_first(uavs: &[u32]) -> String {
    const SHOWN: usize = 6;
    let shown: Vec<String> = uavs.iter().take(SHOWN).map(u32::to_string).collect();
    let more = uavs.len().saturating_sub(SHOWN);
    let rest = if more > 0 { format!(" and {more} more") } else { String::new() };
    shown.join(", ") + &rest
}

fn write_saturation(f: &mut fmt::Formatter<'_>, flight: &FlightSummary) -> fmt::Result {
    let percent =
        |share: Option<f64>| share.map_or_else(|| "-".into(), |share| format!("{:.1} %", 100.0 * share));
    let (speed, turn_rate) =
        (percent(flight.speed_saturated_share), percent(flight.turn_rate_saturated_share));
    line(f, "commands cut to the limits", &speed, &format!("of speeds, {turn_rate} of turn rates"))
}

/// All links with faults together: which did what, summary.json and the log's `/links` tell.
fn write_links(f: &mut fmt::Formatter<'_>, flight: &FlightSummary) -> fmt::Result {
    let links = &flight.links;
    if links.is_empty() {
        return Ok(());
    }
    let sum = |count: fn(&LinkTotals) -> u64| links.iter().map(count).sum::<u64>();
    let (offered, lost, late) = (sum(|link| link.offered), sum(|link| link.lost), sum(|link| link.late));
    let (copies, left) = (sum(|link| link.duplicated), sum(|link| link.in_flight));
    let more = format!("{lost} lost, {copies} duplicated, {late} late, {left} still on their way");
    line(f, &format!("samples on {} links with faults", links.len()), &offered.to_string(), &more)
}

impl Summary {
    fn write_world(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        line(f, "collisions", &self.collisions.map_or_else(|| "-".into(), |count| count.to_string()), "")?;
        if let Some(Latency { p50_us, p99_us, max_us }) = self.latency {
            let tail = format!("p99 {p99_us:.0} us, max {max_us:.0} us");
            line(f, "latency of a tick, all answers", &format!("p50 {p50_us:.0} us"), &tail)?;
        }
        if let (true, Some(missed), Some(late_us)) = (self.real_time, self.missed_deadlines, self.late_max_us)
        {
            let reused = self.reused_commands.unwrap_or_default();
            let more = format!("latest {late_us:.0} us, {reused} commands used again");
            line(f, "missed deadlines", &missed.to_string(), &more)?;
        }
        self.write_pace(f)
    }

    fn write_pace(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (Some(wall), Some(start)) = (self.wall_s, self.start_s) else { return Ok(()) };
        let factor = self.real_time_factor.map_or_else(|| "-".into(), |factor| format!("{factor:.0}x"));
        let more = format!("{:.1} s in {wall:.2} s, after a start of {start:.2} s", self.simulated_s);
        line(f, "real-time factor", &factor, &more)
    }

    fn write_verdict(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let verdict = match self.verdict {
            Verdict::Passed => "passed",
            Verdict::Violated => "VIOLATED",
            Verdict::Failed => "FAILED",
        };
        writeln!(f, "\n  verdict  {verdict}")?;
        for reason in self.failures.iter().chain(&self.violations) {
            writeln!(f, "           {reason}")?;
        }
        if let Some(log) = &self.log {
            let messages = self.log_messages.map_or_else(String::new, |count| format!(" ({count} messages)"));
            writeln!(f, "  log      {log}{messages}")?;
        }
        writeln!(f, "  payload  {}", self.payload_hash.as_deref().unwrap_or("-"))?;
        writeln!(f, "  repeat   {}", self.command)
    }
}
