//! The figures of a flight by name: the columns of a sweep's results, and the goals of a search.
//!
//! Never computes anything new: each figure is a number that the summary of a run also has, under the same name. Those of a
//! baseline are in its `deviation`.

use crate::flight::Outcome;
use ringwing_flight::WorldReport;
use ringwing_recorder::metrics::{ClosestPair, Deviation, FlightSummary};

/// A number of a flight.
#[derive(Clone, Copy)]
pub struct Figure {
    /// Its name in `summary.json`, ending with its unit.
    pub name: &'static str,
    /// What it is, in a few words, for axes and tables.
    pub label: &'static str,
    /// Which end of it is good.
    pub better: Better,
    value: Value,
}

/// Which values of a figure are the better ones.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Better {
    /// The lower the better, such as an error.
    Lower,
    /// The higher the better, such as a distance between UAVs.
    Higher,
}

/// Where a figure comes from. Each absent value is one that the flight does not have, never 0.
#[derive(Clone, Copy)]
enum Value {
    Summary(fn(&FlightSummary) -> Option<f64>),
    /// A count of the world; absent if a fault ended the world.
    World(fn(&WorldReport) -> f64),
    /// What faults have cost; absent unless the flight was flown beside its baseline.
    Deviation(fn(&Deviation) -> Option<f64>),
}

use Better::{Higher, Lower};
use Value::{Summary, World};

/// Every figure, in the order of the summary.
pub const FIGURES: [Figure; 46] = [
    figure("settling_s", "settled after", Lower, Summary(|flight| flight.settling_s)),
    figure("recovery_max_s", "longest recovery from a fault", Lower, Summary(|flight| flight.recovery_max_s)),
    figure(
        "slot_error_max_m",
        "largest slot error at the end",
        Lower,
        Summary(|flight| flight.slot_error_max_m),
    ),
    figure(
        "slot_error_rms_m",
        "slot error at the end, root mean square",
        Lower,
        Summary(|flight| flight.slot_error_rms_m),
    ),
    figure(
        "keeping_error_rms_m",
        "slot error over the second half, root mean square",
        Lower,
        Summary(|flight| flight.keeping_error_rms_m),
    ),
    figure(
        "estimate_error_rms_m",
        "own-position error over the second half, root mean square",
        Lower,
        Summary(|flight| flight.estimate_error_rms_m),
    ),
    figure(
        "neighbour_error_max_m",
        "distances to L, largest error",
        Lower,
        Summary(|flight| flight.neighbour_error_max_m),
    ),
    figure(
        "radius_error_max_m",
        "distances to R, largest error",
        Lower,
        Summary(|flight| flight.radius_error_max_m),
    ),
    figure("closest_pair_m", "closest pair", Higher, Summary(|flight| distance_m(flight.closest_pair))),
    figure(
        "closest_pair_time_s",
        "time of the closest pair",
        Higher,
        Summary(|flight| time_s(flight.closest_pair)),
    ),
    figure(
        "closest_adjacent_m",
        "closest ring neighbours",
        Higher,
        Summary(|flight| distance_m(flight.closest_adjacent)),
    ),
    figure(
        "closest_other_m",
        "closest of all others",
        Higher,
        Summary(|flight| distance_m(flight.closest_other)),
    ),
    figure("clearance_m", "smallest clearance of an obstacle", Higher, Summary(clearance_m)),
    figure("intruder_distance_m", "closest to an intruder", Higher, Summary(intruder_distance_m)),
    figure("near_misses", "near misses", Lower, Summary(|flight| Some(flight.near_misses as f64))),
    figure(
        "filter_share",
        "commands changed by the filter, share",
        Lower,
        Summary(|flight| flight.filter_share),
    ),
    figure(
        "filter_episodes",
        "times that a filter began to act",
        Lower,
        // Without filters there is no share. Then the count of 0 means nothing, and the figure is absent.
        Summary(|flight| flight.filter_share.map(|_| flight.filter_episodes as f64)),
    ),
    figure(
        "filter_longest_s",
        "longest time that a filter acted",
        Lower,
        Summary(|flight| flight.filter_longest_s),
    ),
    figure(
        "filter_turn_mean_deg",
        "heading off the law's wish, mean",
        Lower,
        Summary(|flight| flight.filter_turn_mean_deg),
    ),
    figure(
        "filter_turn_max_deg",
        "heading off the law's wish, largest",
        Lower,
        Summary(|flight| flight.filter_turn_max_deg),
    ),
    figure(
        "filter_speed_mean_m_s",
        "speed off the law's wish, mean",
        Lower,
        Summary(|flight| flight.filter_speed_mean_m_s),
    ),
    figure(
        "filter_speed_max_m_s",
        "speed off the law's wish, largest",
        Lower,
        Summary(|flight| flight.filter_speed_max_m_s),
    ),
    figure(
        "speed_saturated_share",
        "speeds cut to the limits, share",
        Lower,
        Summary(|flight| flight.speed_saturated_share),
    ),
    figure(
        "turn_rate_saturated_share",
        "turn rates cut to the limit, share",
        Lower,
        Summary(|flight| flight.turn_rate_saturated_share),
    ),
    figure("speed_min_m_s", "lowest speed", Higher, Summary(|flight| flight.speed_min_m_s)),
    figure("speed_max_m_s", "highest speed", Lower, Summary(|flight| flight.speed_max_m_s)),
    figure("turn_rate_max_rad_s", "largest turn rate", Lower, Summary(|flight| flight.turn_rate_max_rad_s)),
    figure(
        "views",
        "views of who is alive at the end",
        Lower,
        Summary(|flight| Some(f64::from(flight.views))),
    ),
    figure(
        "disagreed_until_s",
        "last disagreement on who is alive",
        Lower,
        Summary(|flight| flight.disagreed_until_s),
    ),
    figure(
        "commanded",
        "UAVs that fly on command at the end",
        Higher,
        Summary(|flight| Some(f64::from(flight.commanded))),
    ),
    figure("faults", "faults", Lower, Summary(|flight| Some(flight.faults as f64))),
    figure(
        "whole_since_s",
        "every slot error within 1 m since",
        Lower,
        Summary(|flight| flight.whole_since_s),
    ),
    figure("fault_moments", "ticks with a fault", Lower, Summary(|flight| Some(flight.fault_moments as f64))),
    figure(
        "recoveries_cut_short",
        "recoveries cut short by the next fault",
        Lower,
        Summary(|flight| Some(flight.recoveries_cut_short as f64)),
    ),
    figure(
        "unplanned_losses",
        "processes lost although no fault asked for it",
        Lower,
        Summary(|flight| Some(flight.unplanned_losses as f64)),
    ),
    figure(
        "chance_events",
        "events that happened by chance",
        Lower,
        Summary(|flight| Some(flight.chance_events as f64)),
    ),
    figure(
        "samples_lost",
        "samples lost on links with faults",
        Lower,
        Summary(|flight| Some(samples_lost(flight))),
    ),
    figure("ticks", "ticks measured", Higher, Summary(|flight| Some(flight.ticks as f64))),
    figure("collisions", "collisions", Lower, World(|world| world.collisions.len() as f64)),
    figure("failsafes", "times that a failsafe took over", Lower, World(|world| f64::from(world.failsafes))),
    figure("refused_commands", "commands refused", Lower, World(|world| world.refused_commands as f64)),
    figure(
        "reused_commands",
        "ticks flown on an older command",
        Lower,
        World(|world| world.reused_commands as f64),
    ),
    figure(
        "unanswered_ticks",
        "ticks without every answer",
        Lower,
        World(|world| world.unanswered_ticks as f64),
    ),
    figure(
        "deviation_peak_m",
        "largest deviation from the flight without faults",
        Lower,
        Value::Deviation(|cost| cost.peak_m),
    ),
    figure(
        "deviation_area_m_s",
        "deviation from the flight without faults, integral over time",
        Lower,
        Value::Deviation(|cost| Some(cost.area_m_s)),
    ),
    figure(
        "deviation_back_s",
        "time back to the flight without faults",
        Lower,
        Value::Deviation(|cost| cost.back_s),
    ),
];

const fn figure(name: &'static str, label: &'static str, better: Better, value: Value) -> Figure {
    Figure { name, label, better, value }
}

impl Figure {
    /// The figure of this name.
    pub fn named(name: &str) -> Option<&'static Self> {
        FIGURES.iter().find(|figure| figure.name == name)
    }

    /// Whether only a flight beside its baseline has it.
    pub fn needs_baseline(&self) -> bool {
        matches!(self.value, Value::Deviation(_))
    }

    /// Its value in a flight; `None` if the flight has no such value, such as a settling time when it never settled.
    pub fn of(&self, outcome: &Outcome) -> Option<f64> {
        match self.value {
            Summary(get) => get(&outcome.summary),
            World(get) => outcome.report.as_ref().map(get),
            Value::Deviation(get) => outcome.deviation.as_ref().and_then(get),
        }
    }
}

fn distance_m(pair: Option<ClosestPair>) -> Option<f64> {
    pair.map(|pair| pair.distance_m)
}

fn time_s(pair: Option<ClosestPair>) -> Option<f64> {
    pair.map(|pair| pair.time_s)
}

fn clearance_m(flight: &FlightSummary) -> Option<f64> {
    // `reduce` has no starting value: a flight without obstacles has no clearance, and not an infinite one.
    flight.obstacles.iter().map(|obstacle| obstacle.clearance_m).reduce(f64::min)
}

fn intruder_distance_m(flight: &FlightSummary) -> Option<f64> {
    flight.intruders.iter().map(|intruder| intruder.distance_m).reduce(f64::min)
}

fn samples_lost(flight: &FlightSummary) -> f64 {
    flight.links.iter().map(|link| link.lost).sum::<u64>() as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flight::fly;
    use ringwing_scenario::{Scenario, Source};
    use serde_json::Value as Json;
    use std::collections::BTreeSet;

    /// Figures of the summary that have another name here, or that say nothing about how a flight went: a simulation
    /// loses no tick.
    const ELSEWHERE: [&str; 3] = ["broke_lockstep", "last_tick", "ticks_lost"];

    fn paper() -> Outcome {
        let mut scenario = Scenario::read(&Source::find("paper-4.2").unwrap(), &[]).unwrap();
        scenario.time.duration_s = 70.0;
        fly(&scenario).unwrap()
    }

    #[test]
    fn every_number_of_the_summary_is_a_figure() {
        let outcome = paper();
        let Json::Object(fields) = serde_json::to_value(&outcome.summary).unwrap() else { panic!("a table") };
        let numbers = fields.iter().filter(|(_, value)| value.is_number() || value.is_null());
        let missing: Vec<_> =
            numbers.map(|(name, _)| name.as_str()).filter(|name| Figure::named(name).is_none()).collect();
        assert_eq!(missing, ELSEWHERE);
    }

    #[test]
    fn a_figure_has_the_value_of_the_summary() {
        let outcome = paper();
        let of = |name: &str| Figure::named(name).unwrap().of(&outcome);
        let pair = outcome.summary.closest_pair.unwrap();
        assert_eq!(
            (of("closest_pair_m"), of("closest_pair_time_s")),
            (Some(pair.distance_m), Some(pair.time_s))
        );
        assert_eq!(of("settling_s"), outcome.summary.settling_s);
        assert_eq!((of("commanded"), of("collisions"), of("faults")), (Some(6.0), Some(0.0), Some(0.0)));
        assert_eq!(
            of("clearance_m"),
            Some(outcome.summary.obstacles[0].clearance_m.min(outcome.summary.obstacles[1].clearance_m))
        );
        // Without a fault there is no recovery, which is not a recovery in no time.
        assert_eq!(of("recovery_max_s"), None);
    }

    #[test]
    fn names_are_different() {
        let names: BTreeSet<_> = FIGURES.iter().map(|figure| figure.name).collect();
        assert_eq!(names.len(), FIGURES.len());
    }
}
