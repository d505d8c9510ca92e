//! Judges whether a flight met the requirements of its scenario.
//!
//! Must never pass what it cannot measure: a requirement that applies but has no measured value is violated.

use super::FlightSummary;
use ringwing_scenario::RequirementsSection;
use serde::{Deserialize, Serialize};

/// The verdict on a flight.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// It flew to its end and met its requirements.
    Passed,
    /// It flew to its end, but violated a requirement.
    Violated,
    /// It did not fly to its end.
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

/// The requirements that the flight violated, each as one sentence; empty if it passed.
pub fn judge(requirements: &RequirementsSection, summary: &FlightSummary, collisions: usize) -> Vec<String> {
    let mut violations = Vec::new();
    violations.extend(requirements.collisions_max.and_then(|most| judge_collisions(most, collisions)));
    if let Some(least_m) = requirements.clearance_min_m {
        violations.extend(judge_clearances(least_m, summary));
    }
    violations.extend(requirements.separation_min_m.and_then(|least_m| judge_separation(least_m, summary)));
    violations.extend(requirements.settling_max_s.and_then(|most_s| judge_settling(most_s, summary)));
    violations.extend(requirements.slot_error_max_m.and_then(|most_m| judge_slot_error(most_m, summary)));
    violations
}

fn judge_collisions(most: u32, collisions: usize) -> Option<String> {
    let plural = if collisions == 1 { "" } else { "s" };
    (collisions > most as usize).then(|| format!("{collisions} collision{plural}, required at most {most}"))
}

fn judge_clearances(least_m: f64, summary: &FlightSummary) -> impl Iterator<Item = String> {
    let too_close = summary.obstacles.iter().filter(move |obstacle| obstacle.clearance_m < least_m);
    too_close.map(move |obstacle| {
        format!(
            "clearance of {} {:.2} m (uav {} at {:.2} s), required at least {least_m} m",
            obstacle.name, obstacle.clearance_m, obstacle.uav, obstacle.time_s
        )
    })
}

fn judge_separation(least_m: f64, summary: &FlightSummary) -> Option<String> {
    // A swarm of one has no pair, and so nothing that could be too close.
    let pair = summary.closest_pair.filter(|pair| pair.distance_m < least_m)?;
    Some(format!(
        "closest pair {:.2} m (uav {} and {} at {:.2} s), required at least {least_m} m",
        pair.distance_m, pair.uav, pair.other, pair.time_s
    ))
}

fn judge_settling(most_s: f64, summary: &FlightSummary) -> Option<String> {
    match summary.settling_s {
        None => Some(format!("the formation never settled, required within {most_s} s")),
        Some(settling_s) if settling_s > most_s => {
            Some(format!("the formation settled at {settling_s:.2} s, required within {most_s} s"))
        }
        Some(_) => None,
    }
}

fn judge_slot_error(most_m: f64, summary: &FlightSummary) -> Option<String> {
    match summary.slot_error_max_m {
        None => Some(format!("no slot error is known at the end, required at most {most_m} m")),
        Some(error_m) if error_m > most_m => {
            // The largest error is one of these values to the bit, so comparing them is safe.
            let worst = summary.uavs.iter().find(|uav| uav.commanded && uav.slot_error_m == Some(error_m));
            let whose = worst.map_or_else(String::new, |uav| format!(" (uav {})", uav.uav));
            Some(format!("largest slot error at the end {error_m:.3} m{whose}, required at most {most_m} m"))
        }
        Some(_) => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metrics::{ClosestPair, ObstacleSummary};

    fn strict() -> RequirementsSection {
        RequirementsSection {
            collisions_max: Some(0),
            clearance_min_m: Some(2.0),
            separation_min_m: Some(10.0),
            settling_max_s: Some(20.0),
            slot_error_max_m: Some(0.05),
        }
    }

    fn flight(clearance_m: f64, distance_m: f64, settling_s: f64, slot_error_m: f64) -> FlightSummary {
        let name = "tower".into();
        FlightSummary {
            settling_s: Some(settling_s),
            slot_error_max_m: Some(slot_error_m),
            closest_pair: Some(ClosestPair { distance_m, uav: 2, other: 5, time_s: 12.31 }),
            obstacles: vec![ObstacleSummary { name, clearance_m, uav: 3, time_s: 60.0, repelled: vec![3] }],
            ..FlightSummary::default()
        }
    }

    #[test]
    fn a_flight_at_its_limits_passes() {
        assert_eq!(judge(&strict(), &flight(2.0, 10.0, 20.0, 0.05), 0), Vec::<String>::new());
    }

    #[test]
    fn each_violation_names_what_was_and_what_was_required() {
        assert_eq!(
            judge(&strict(), &flight(-0.5, 1.3, 31.4, 0.7), 1),
            [
                "1 collision, required at most 0",
                "clearance of tower -0.50 m (uav 3 at 60.00 s), required at least 2 m",
                "closest pair 1.30 m (uav 2 and 5 at 12.31 s), required at least 10 m",
                "the formation settled at 31.40 s, required within 20 s",
                "largest slot error at the end 0.700 m, required at most 0.05 m",
            ]
        );
    }

    #[test]
    fn an_unknown_value_violates_its_requirement_and_without_requirements_nothing_is_violated() {
        assert_eq!(
            judge(&strict(), &FlightSummary::default(), 0),
            [
                "the formation never settled, required within 20 s",
                "no slot error is known at the end, required at most 0.05 m",
            ]
        );
        assert_eq!(
            judge(&RequirementsSection::default(), &flight(-9.0, 0.0, 99.0, 99.0), 7),
            Vec::<String>::new()
        );
    }
}
