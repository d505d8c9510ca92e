//! Judges whether a flight met the requirements of its scenario.
//!
//! Must never pass what it cannot measure: a requirement without a measured value is violated. And whatever is required,
//! a flight that ends with nobody in the formation is no success.

use super::{ChanceEvent, FlightSummary, UnplannedLoss, fault_effects};
use ringwing_scenario::{RequirementsSection, Scenario};
use serde::{Deserialize, Serialize};

/// The verdict on a flight, from the best to the worst.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// It flew to its end and met its requirements.
    Passed,
    /// It flew to its end, but violated a requirement.
    Violated,
    /// It did not fly to its end, or something went wrong that no requirement covers.
    Failed,
}

impl Verdict {
    /// Its name in results.
    pub fn name(self) -> &'static str {
        match self {
            Self::Passed => "passed",
            Self::Violated => "violated",
            Self::Failed => "failed",
        }
    }
}

/// Losses named in a violation; the others are only counted. More make the sentence too long to read.
const NAMED_LOSSES: usize = 3;

/// What the flight of `scenario` violated, each as one sentence; empty if it passed.
///
/// `collisions` is their number, or `None` if nobody has counted them.
pub fn judge(scenario: &Scenario, summary: &FlightSummary, collisions: Option<usize>) -> Vec<String> {
    let required = &scenario.requirements;
    // Without a tick, a count of 0 means only that nobody has looked.
    let collisions = collisions.filter(|_| is_measured(summary));
    let mut violations: Vec<String> = judge_end(summary).into_iter().collect();
    violations.extend(summary.broke_lockstep.as_ref().map(broken_lockstep));
    violations.extend(required.collisions_max.and_then(|most| judge_collisions(most, collisions)));
    violations
        .extend(required.clearance_min_m.into_iter().flat_map(|m| judge_clearances(m, scenario, summary)));
    violations.extend(required.separation_min_m.and_then(|least_m| judge_separation(least_m, summary)));
    violations.extend(required.intruder_distance_min_m.and_then(|least_m| judge_intruders(least_m, summary)));
    violations.extend(required.settling_max_s.and_then(|most_s| judge_settling(most_s, summary)));
    violations.extend(required.recovery_max_s.and_then(|most_s| judge_recovery(most_s, summary)));
    violations.extend(required.slot_error_max_m.and_then(|most_m| judge_slot_error(most_m, summary)));
    violations.extend(required.keeping_error_rms_max_m.and_then(|most_m| judge_keeping(most_m, summary)));
    violations
        .extend(required.turn_rate_saturated_share_max.and_then(|most| judge_saturation(most, summary)));
    violations.extend(judge_losses(required.unplanned_losses_max, summary));
    violations.extend(judge_chance(required, summary));
    violations.extend(fault_effects::judge(required.faults_act, &summary.fault_effects));
    violations
}

fn is_measured(summary: &FlightSummary) -> bool {
    summary.ticks > 0
}

fn judge_end(summary: &FlightSummary) -> Option<String> {
    match (is_measured(summary), summary.commanded) {
        (false, _) => Some("no tick of the flight was measured".into()),
        (true, 0) => Some("no UAV flies on command at the end".into()),
        (true, _) => None,
    }
}

fn broken_lockstep(ChanceEvent { what, time_s }: &ChanceEvent) -> String {
    format!("lockstep was broken at {time_s:.2} s: {what}")
}

fn judge_collisions(most: u32, collisions: Option<usize>) -> Option<String> {
    let Some(collisions) = collisions else {
        return Some(format!("collisions not measured, required at most {most}"));
    };
    let plural = if collisions == 1 { "" } else { "s" };
    (collisions > most as usize).then(|| format!("{collisions} collision{plural}, required at most {most}"))
}

fn judge_clearances(least_m: f64, scenario: &Scenario, summary: &FlightSummary) -> Vec<String> {
    let obstacles = scenario.all_obstacles();
    if obstacles.is_empty() {
        return vec![format!(
            "clearance not measured, as there is no obstacle, required at least {least_m} m"
        )];
    }
    // An obstacle that no UAV was measured against has no entry. Unchecked, it would pass.
    let has_clearance = |name: &str| summary.obstacles.iter().any(|measured| measured.name == name);
    let missing = obstacles.iter().filter(|obstacle| !has_clearance(&obstacle.name));
    let missing = missing.map(|obstacle| {
        format!("clearance of {} not measured, required at least {least_m} m", obstacle.name)
    });
    let too_close = summary.obstacles.iter().filter(|measured| measured.clearance_m < least_m);
    let too_close = too_close.map(|measured| {
        format!(
            "clearance of {} {:.2} m (uav {} at {:.2} s), required at least {least_m} m",
            measured.name, measured.clearance_m, measured.uav, measured.time_s
        )
    });
    missing.chain(too_close).collect()
}

fn judge_separation(least_m: f64, summary: &FlightSummary) -> Option<String> {
    let Some(pair) = summary.closest_pair else {
        return Some(format!(
            "closest pair not measured, as no two UAVs flew, required at least {least_m} m"
        ));
    };
    (pair.distance_m < least_m).then(|| {
        format!(
            "closest pair {:.2} m (uav {} and {} at {:.2} s), required at least {least_m} m",
            pair.distance_m, pair.uav, pair.other, pair.time_s
        )
    })
}

fn judge_intruders(least_m: f64, summary: &FlightSummary) -> Option<String> {
    // The nearest intruder decides: if it keeps the distance, all do.
    let closest = summary.intruders.iter().min_by(|one, other| one.distance_m.total_cmp(&other.distance_m));
    let Some(closest) = closest else {
        return Some(format!(
            "distance of intruders not measured, because nobody intrudes, required at least {least_m} m"
        ));
    };
    (closest.distance_m < least_m).then(|| {
        format!(
            "intruder {} at {:.2} m (uav {} at {:.2} s), required at least {least_m} m",
            closest.intruder, closest.distance_m, closest.uav, closest.time_s
        )
    })
}

fn judge_settling(most_s: f64, summary: &FlightSummary) -> Option<String> {
    match (summary.settling_s, summary.whole_since_s) {
        (Some(settling_s), _) if settling_s > most_s => {
            Some(format!("the formation settled at {settling_s:.2} s, required within {most_s} s"))
        }
        (Some(_), _) => None,
        (None, Some(since_s)) => Some(format!(
            "settling not seen to the end: every slot error was within 1 m from {since_s:.2} s on, but not yet for 5 s, \
             required within {most_s} s"
        )),
        (None, None) if is_measured(summary) => {
            Some(format!("the formation never settled, required within {most_s} s"))
        }
        (None, None) => Some(format!("settling not measured, required within {most_s} s")),
    }
}

fn judge_recovery(most_s: f64, summary: &FlightSummary) -> Option<String> {
    match summary.recovery_max_s {
        None if summary.fault_moments == 0 => Some(format!(
            "recovery not measured, as there was no fault or manoeuvre, required within {most_s} s"
        )),
        None => {
            Some(format!("recovery not seen after every fault and manoeuvre, required within {most_s} s"))
        }
        Some(recovery_s) if recovery_s > most_s => {
            Some(format!("longest recovery {recovery_s:.2} s, required within {most_s} s"))
        }
        Some(_) => None,
    }
}

fn judge_slot_error(most_m: f64, summary: &FlightSummary) -> Option<String> {
    match summary.slot_error_max_m {
        None => Some(format!("largest slot error at the end not measured, required at most {most_m} m")),
        Some(error_m) if error_m > most_m => {
            // The largest error is one of these values to the bit, so comparing them is safe.
            let worst = summary.uavs.iter().find(|uav| uav.commanded && uav.slot_error_m == Some(error_m));
            let whose = worst.map_or_else(String::new, |uav| format!(" (uav {})", uav.uav));
            Some(format!("largest slot error at the end {error_m:.3} m{whose}, required at most {most_m} m"))
        }
        Some(_) => None,
    }
}

fn judge_keeping(most_m: f64, summary: &FlightSummary) -> Option<String> {
    let label = "slot error over the second half of the flight";
    match summary.keeping_error_rms_m {
        None => Some(format!("{label} not measured, required at most {most_m} m root mean square")),
        Some(error_m) if error_m > most_m => {
            Some(format!("{label} {error_m:.3} m root mean square, required at most {most_m} m"))
        }
        Some(_) => None,
    }
}

fn judge_saturation(most: f64, summary: &FlightSummary) -> Option<String> {
    let most_percent = 100.0 * most;
    match summary.turn_rate_saturated_share {
        None => {
            Some(format!("turn rates of commands not measured, required cut in at most {most_percent} %"))
        }
        Some(share) if share > most => Some(format!(
            "turn rate cut in {:.1} % of the commands, required in at most {most_percent} %",
            100.0 * share
        )),
        Some(_) => None,
    }
}

fn judge_losses(most: u32, summary: &FlightSummary) -> Option<String> {
    let losses = summary.unplanned_losses;
    if losses <= u64::from(most) {
        return None;
    }
    let told = |UnplannedLoss { process, time_s, cause, .. }: &UnplannedLoss| {
        format!("{process} {cause} at {time_s:.2} s")
    };
    let named: Vec<String> = summary.unplanned_loss_list.iter().take(NAMED_LOSSES).map(told).collect();
    let more = losses - named.len() as u64;
    let rest = if more > 0 { format!(" and {more} more") } else { String::new() };
    let plural = if losses == 1 { "process" } else { "processes" };
    Some(format!("{losses} {plural} lost unplanned ({}{rest}), required at most {most}", named.join(", ")))
}

fn judge_chance(required: &RequirementsSection, summary: &FlightSummary) -> Option<String> {
    let first = summary.chance_event_list.first().filter(|_| required.repeatable)?;
    Some(format!("not repeatable: {} at {:.2} s, required to be repeatable", first.what, first.time_s))
}

#[cfg(test)]
mod tests;
