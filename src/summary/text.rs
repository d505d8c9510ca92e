//! The summary as people read it: a table of what was measured, the verdict, and how to repeat the run.
//!
//! Never computes a value; each is in the summary already.

use super::{
    deviation::write_deviation,
    disturbances::{write_chance, write_losses, write_recoveries},
    faults::effect_lines,
    line::{NOT_SEEN, is_narrow, line, paragraph},
};
use crate::output;
use ringwing_flight::{Latency, counted};
use ringwing_recorder::{
    Summary,
    metrics::{ClosestPair, FlightSummary, LinkTotals, ObstacleSummary, UavSummary, Verdict},
};
use ringwing_scenario::ShapeName;
use std::{fmt, io};

/// Largest swarm whose UAVs are listed one by one. More lines push the verdict's context off a terminal.
const LISTED_UAVS: usize = 12;
/// Most obstacles that are listed one by one. Of more, the summary shows the one that a UAV came closest to.
const LISTED_OBSTACLES: usize = 8;
/// UAVs named after an obstacle that repelled them; the summary only counts the others. More names make the line too
/// long for a terminal.
const LISTED_REPELLED: usize = 6;

/// A summary as text: `{:#}` is coloured, and `{:80}` fits a terminal of 80 columns.
pub(crate) struct SummaryText<'a>(pub(crate) &'a Summary);

impl fmt::Display for SummaryText<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let summary = self.0;
        let mode = if summary.real_time { "real time" } else { "lockstep" };
        let Summary { scenario, uavs, rate_hz, seed, .. } = summary;
        let (mut swarm, law) = (counted(*uavs, "UAV"), summary.law.name());
        if summary.shape != ShapeName::Ring {
            swarm = format!("{swarm}, {}", summary.shape.name());
        }
        paragraph(f, "", &format!("{scenario}: {swarm}, {law} law, {rate_hz} Hz, {mode}, seed {seed}"))?;
        writeln!(f)?;
        if let Some(flight) = &summary.flight {
            write_uavs(f, flight)?;
            write_commanded(f, flight, *uavs)?;
            write_formation(f, flight, summary.shape_at_end)?;
            // In wind or with errors of sensors a formation never quite rests, so the errors at the end say little.
            if !summary.air_is_still || flight.estimate_error_rms_m.is_some() {
                write_keeping(f, flight)?;
            }
            write_obstacles(f, flight)?;
            write_intruders(f, flight)?;
            write_filter(f, flight)?;
            for [label, value, remark] in effect_lines(&flight.fault_effects) {
                line(f, &label, &value, &remark)?;
            }
            write_recoveries(f, flight)?;
            write_losses(f, flight)?;
            write_agreement(f, flight)?;
            write_saturation(f, flight)?;
            write_links(f, flight)?;
            write_lost_ticks(f, flight)?;
        }
        if let Some(cost) = &summary.deviation {
            write_deviation(f, cost)?;
        }
        write_world(f, summary)?;
        write_verdict(f, summary)
    }
}

/// A distance with its unit, or a dash if it does not exist.
fn metres(value: Option<f64>) -> String {
    value.map_or_else(|| "-".into(), |value| format!("{value:.3} m"))
}

fn write_uavs(f: &mut fmt::Formatter<'_>, flight: &FlightSummary) -> fmt::Result {
    // A flight that was never measured has no UAVs to list.
    if flight.uavs.is_empty() || flight.uavs.len() > LISTED_UAVS {
        return Ok(());
    }
    if is_narrow(f) {
        flight.uavs.iter().try_for_each(|uav| write_uav_in_words(f, uav))?;
        return writeln!(f);
    }
    writeln!(f, "  at the end   slot error   to previous       to next     to leader")?;
    for uav in &flight.uavs {
        let distances =
            [uav.slot_error_m, uav.previous_distance_m, uav.next_distance_m, uav.leader_distance_m];
        let [slot, previous, next, leader] = distances.map(metres);
        let state = if uav.commanded { "" } else { "   failsafe" };
        writeln!(f, "  uav {:<6} {slot:>12} {previous:>13} {next:>13} {leader:>13}{state}", uav.uav)?;
    }
    writeln!(f)
}

/// Writes the row of a UAV for a terminal that is too narrow for the table.
fn write_uav_in_words(f: &mut fmt::Formatter<'_>, uav: &UavSummary) -> fmt::Result {
    let distances = [uav.slot_error_m, uav.previous_distance_m, uav.next_distance_m, uav.leader_distance_m];
    let [slot, previous, next, leader] = distances.map(metres);
    let state = if uav.commanded { "" } else { ", failsafe" };
    let rest = format!("off its slot, {previous} to previous, {next} to next, {leader} to leader{state}");
    line(f, &format!("uav {} at the end", uav.uav), &slot, &rest)
}

/// Writes how many UAVs fly on command, unless all do.
fn write_commanded(f: &mut fmt::Formatter<'_>, flight: &FlightSummary, uavs: u32) -> fmt::Result {
    if flight.ticks == 0 || flight.commanded == uavs {
        return Ok(());
    }
    line(f, "UAVs on command at the end", &format!("{} of {uavs}", flight.commanded), "")
}

/// When the formation settled, and a remark.
fn settling(flight: &FlightSummary) -> (String, String) {
    match (flight.settling_s, flight.whole_since_s) {
        (Some(settling_s), _) => (format!("{settling_s:.2} s"), String::new()),
        // It may have settled just before the end, so this is not the same as never.
        (None, Some(since_s)) => {
            (NOT_SEEN.into(), format!("within 1 m since {since_s:.2} s, which is less than 5 s"))
        }
        (None, None) if flight.ticks == 0 => ("-".into(), "no tick was measured".into()),
        (None, None) => ("never".into(), String::new()),
    }
}

fn write_formation(f: &mut fmt::Formatter<'_>, flight: &FlightSummary, shape: ShapeName) -> fmt::Result {
    let (settling, remark) = settling(flight);
    // Only a ring has one distance for all.
    let distances = if shape == ShapeName::Ring { ["L", "R"] } else { ["neighbours", "leader"] };
    let [neighbours, leader] = distances.map(|to| format!("distances to {to}, largest error"));
    line(f, "settled within 1 m of every slot", &settling, &remark)?;
    line(f, "largest slot error at the end", &metres(flight.slot_error_max_m), "")?;
    line(f, &neighbours, &metres(flight.neighbour_error_max_m), "at the end")?;
    line(f, &leader, &metres(flight.radius_error_max_m), "at the end")?;
    write_pair(f, "closest ring neighbours", flight.closest_adjacent)?;
    write_pair(f, "closest of all others", flight.closest_other)
}

fn write_keeping(f: &mut fmt::Formatter<'_>, flight: &FlightSummary) -> fmt::Result {
    line(f, "slot error over the second half", &metres(flight.keeping_error_rms_m), "root mean square")?;
    match flight.estimate_error_rms_m {
        Some(error_m) => {
            line(f, "own-position error, second half", &metres(Some(error_m)), "root mean square")
        }
        None => Ok(()),
    }
}

fn write_pair(f: &mut fmt::Formatter<'_>, label: &str, pair: Option<ClosestPair>) -> fmt::Result {
    let who = pair.map(|pair| format!("uav {} and {} at {:.2} s", pair.uav, pair.other, pair.time_s));
    line(f, label, &metres(pair.map(|pair| pair.distance_m)), &who.unwrap_or_default())
}

fn write_obstacles(f: &mut fmt::Formatter<'_>, flight: &FlightSummary) -> fmt::Result {
    let obstacles = &flight.obstacles;
    if obstacles.len() <= LISTED_OBSTACLES {
        return obstacles.iter().try_for_each(|obstacle| write_obstacle(f, obstacle));
    }
    // A field of drawn obstacles has dozens, and the smallest clearance is the one that may violate a requirement.
    let closest = obstacles.iter().min_by(|one, other| one.clearance_m.total_cmp(&other.clearance_m));
    let Some(closest) = closest else { return Ok(()) };
    let who = format!("of {}: uav {} at {:.2} s", closest.name, closest.uav, closest.time_s);
    let label = format!("smallest of {} clearances", obstacles.len());
    line(f, &label, &metres(Some(closest.clearance_m)), &who)
}

fn write_obstacle(f: &mut fmt::Formatter<'_>, obstacle: &ObstacleSummary) -> fmt::Result {
    let repelled = match obstacle.repelled.as_slice() {
        [] => "repelled no uav".to_owned(),
        uavs => format!("repelled uav {}", listed(uavs)),
    };
    let who = format!("uav {} at {:.2} s; {repelled}", obstacle.uav, obstacle.time_s);
    line(f, &format!("clearance of {}", obstacle.name), &metres(Some(obstacle.clearance_m)), &who)
}

fn write_intruders(f: &mut fmt::Formatter<'_>, flight: &FlightSummary) -> fmt::Result {
    for closest in &flight.intruders {
        let who = format!("uav {} at {:.2} s", closest.uav, closest.time_s);
        line(
            f,
            &format!("closest to intruder {}", closest.intruder),
            &metres(Some(closest.distance_m)),
            &who,
        )?;
    }
    if flight.near_misses == 0 { Ok(()) } else { line(f, "near misses", &flight.near_misses.to_string(), "") }
}

/// Writes how the collision filters acted, if there are any.
fn write_filter(f: &mut fmt::Formatter<'_>, flight: &FlightSummary) -> fmt::Result {
    let Some(share) = flight.filter_share else { return Ok(()) };
    let label = "collision filter acted";
    // A filter that never acted departed from nothing, so the second line would have no numbers.
    let Some(longest_s) = flight.filter_longest_s else {
        return line(f, label, "never", "");
    };
    let times = counted(flight.filter_episodes, "time");
    line(f, label, &format!("{:.1} %", 100.0 * share), &format!("{times}, for {longest_s:.2} s at most"))?;
    let angle = |value: Option<f64>| value.map_or_else(|| "-".into(), |value| format!("{value:.1} deg"));
    let speed = |value: Option<f64>| value.map_or_else(|| "-".into(), |value| format!("{value:.1} m/s"));
    let most =
        format!("{}, at most {}", speed(flight.filter_speed_mean_m_s), speed(flight.filter_speed_max_m_s));
    let turn = format!("at most {}; {most}", angle(flight.filter_turn_max_deg));
    line(f, "off the law's wish, mean", &angle(flight.filter_turn_mean_deg), &turn)
}

/// Writes when the UAVs last disagreed on who is alive, if they ever did.
fn write_agreement(f: &mut fmt::Formatter<'_>, flight: &FlightSummary) -> fmt::Result {
    let Some(until_s) = flight.disagreed_until_s else { return Ok(()) };
    line(
        f,
        "views of who is alive at the end",
        &flight.views.to_string(),
        &format!("differed until {until_s:.2} s"),
    )
}

/// The first few of `uavs`, and the number of the others.
fn listed(uavs: &[u32]) -> String {
    let shown: Vec<String> = uavs.iter().take(LISTED_REPELLED).map(u32::to_string).collect();
    let more = uavs.len().saturating_sub(LISTED_REPELLED);
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

/// Writes the counts of all links with faults together; `summary.json` and the log's `/links` have each link.
fn write_links(f: &mut fmt::Formatter<'_>, flight: &FlightSummary) -> fmt::Result {
    let links = &flight.links;
    if links.is_empty() {
        return Ok(());
    }
    // The totals balance: what was offered or copied is delivered, lost, corrupted or still on the way.
    let sum = |count: fn(&LinkTotals) -> u64| links.iter().map(count).sum::<u64>();
    let (offered, lost, late) = (sum(|link| link.offered), sum(|link| link.lost), sum(|link| link.late));
    let (copies, left) = (sum(|link| link.duplicated), sum(|link| link.in_flight));
    let corrupted = sum(|link| link.corrupted);
    let remark = format!(
        "{lost} lost, {corrupted} corrupted, {copies} duplicated, {late} late, {left} still on the way"
    );
    line(
        f,
        &format!("samples on {} with faults", counted(links.len(), "link")),
        &offered.to_string(),
        &remark,
    )
}

/// Writes how many ticks nobody has measured, if there are any.
fn write_lost_ticks(f: &mut fmt::Formatter<'_>, flight: &FlightSummary) -> fmt::Result {
    match flight.ticks_lost {
        0 => Ok(()),
        lost => line(f, "ticks not measured", &lost.to_string(), &format!("of {}", lost + flight.ticks)),
    }
}

/// The text for standard output: as wide as its terminal, and with the colours that it shows.
pub(crate) fn for_terminal(summary: &Summary) -> String {
    let (columns, out, text) = (output::columns(&io::stdout()), io::stdout(), SummaryText(summary));
    if output::is_coloured(&out) { format!("{text:#columns$}") } else { format!("{text:columns$}") }
}

fn write_world(f: &mut fmt::Formatter<'_>, summary: &Summary) -> fmt::Result {
    line(f, "collisions", &summary.collisions.map_or_else(|| "-".into(), |count| count.to_string()), "")?;
    if let Some(Latency { p50_us, p99_us, max_us }) = summary.latency {
        let tail = format!("p99 {p99_us:.0} us, max {max_us:.0} us");
        line(f, "latency of a tick, all answers", &format!("p50 {p50_us:.0} us"), &tail)?;
    }
    // In lockstep there are no deadlines.
    if let (true, Some(missed), Some(late_us)) =
        (summary.real_time, summary.missed_deadlines, summary.late_max_us)
    {
        let reused = summary.reused_commands.unwrap_or_default();
        let reused = counted(reused, "command");
        let remark = format!("latest {late_us:.0} us, {reused} used again");
        line(f, "missed deadlines", &missed.to_string(), &remark)?;
    }
    write_pace(f, summary)
}

fn write_pace(f: &mut fmt::Formatter<'_>, summary: &Summary) -> fmt::Result {
    // A log does not hold the wall-clock times of its run.
    let (Some(wall), Some(start)) = (summary.wall_s, summary.start_s) else { return Ok(()) };
    let factor = summary.real_time_factor.map_or_else(|| "-".into(), |factor| format!("{factor:.0}x"));
    let remark = format!("{:.1} s in {wall:.2} s, after a start of {start:.2} s", summary.simulated_s);
    line(f, "real-time factor", &factor, &remark)
}

fn write_verdict(f: &mut fmt::Formatter<'_>, summary: &Summary) -> fmt::Result {
    let (verdict, style) = match summary.verdict {
        Verdict::Passed => ("passed", output::GOOD),
        Verdict::Violated => ("VIOLATED", output::BAD),
        Verdict::Failed => ("FAILED", output::BAD),
    };
    writeln!(f, "\n  verdict  {}", output::painted(style, verdict, f.alternate()))?;
    for reason in summary.failures.iter().chain(&summary.violations) {
        paragraph(f, "           ", reason)?;
    }
    if let Some(flight) = &summary.flight {
        write_chance(f, flight)?;
    }
    // The rest is for copying, so its lines are never broken.
    if let Some(log) = &summary.log {
        let messages = summary
            .log_messages
            .map_or_else(String::new, |count| format!(" ({})", counted(count, "message")));
        writeln!(f, "  log      {log}{messages}")?;
    }
    writeln!(f, "  payload  {}", summary.payload_hash.as_deref().unwrap_or("-"))?;
    writeln!(f, "  repeat   {}", summary.command)
}
