//! One flight in the simulation, and everything that a study asks about it.
//!
//! Never opens a file and never prints: whoever flies many scenarios decides what to keep.

pub use crate::crewed::{FlightError, check};
use crate::{baseline::Baseline, crewed::CrewedFlight};
use ringwing_flight::{Event, TimedEvent, WorldReport};
use ringwing_recorder::metrics::{Deviation, FlightSummary, Frame, Verdict, judge};
use ringwing_scenario::{RequirementsSection, Scenario};
use ringwing_simulation::{Flown, Measurement};
use serde_json::{Map, Value};

/// Stands for a requirement where a flight violated what no scenario can allow: it ended with nobody in the formation, or
/// flew on without waiting for a process.
pub const ALWAYS: &str = "always";

/// How a flight went.
#[derive(Debug, Clone)]
pub struct Outcome {
    /// The verdict, as the processes' flight would have it.
    pub verdict: Verdict,
    /// The requirements that the flight violated; empty if it passed.
    pub violations: Vec<Violation>,
    /// The flight in numbers. [`Figure`](crate::Figure) names the single ones.
    pub summary: FlightSummary,
    /// What the world counted; `None` if a fault ended the world.
    pub report: Option<WorldReport>,
    /// Everything that happened, in order of time: [`Event::Collision`] says who collided, with what and where.
    pub events: Vec<TimedEvent>,
    /// What its faults have cost, if it was flown beside its baseline.
    pub deviation: Option<Deviation>,
}

/// A requirement that a flight violated.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Violation {
    /// The key in `[requirements]`, such as `separation_min_m`, or [`ALWAYS`].
    pub requirement: String,
    /// What was measured and what was required, as the summary says it. A requirement may have several, for example
    /// one for each obstacle.
    pub sentences: Vec<String>,
}

/// Flies `scenario`, which has been validated, to its end.
///
/// # Errors
/// The scenario flies in real time, its UAVs find no room to start, or a program that it names does not fly its UAV.
pub fn fly(scenario: &Scenario) -> Result<Outcome, FlightError> {
    let flown = fly_observed(scenario, |_| {})?;
    Ok(Outcome::judged(scenario, flown.summary, flown.report, flown.events))
}

/// As [`fly`], and flies the same scenario without its faults beside it, to measure what they cost.
///
/// # Errors
/// As [`fly`], for either flight.
pub fn fly_beside_baseline(scenario: &Scenario) -> Result<Outcome, FlightError> {
    let mut baseline = Baseline::new(scenario)?;
    let Flown { report, summary, events, .. } = fly_observed(scenario, |frame| {
        baseline.observe(frame);
    })?;
    let outcome = Outcome::judged(scenario, summary, report, events);
    Ok(Outcome { deviation: Some(baseline.finish()?), ..outcome })
}

/// Flies `scenario` to its end, and shows each tick to `observe`.
fn fly_observed(scenario: &Scenario, mut observe: impl FnMut(&Frame)) -> Result<Flown, FlightError> {
    let mut flight = CrewedFlight::begin(scenario)?;
    let mut measurement = Measurement::new(scenario);
    let mut goes_on = true;
    while goes_on {
        goes_on = flight.step()?;
        if let Some(frame) = measurement.observe(flight.simulation()) {
            observe(frame);
        }
    }
    Ok(measurement.finish(flight.simulation()))
}

impl Outcome {
    /// The outcome of a flight of `scenario` that was measured elsewhere, such as by real processes.
    pub fn judged(
        scenario: &Scenario,
        summary: FlightSummary,
        report: Option<WorldReport>,
        events: Vec<TimedEvent>,
    ) -> Self {
        // A world that a fault has ended leaves no report, but its collisions are among the events.
        let collided =
            report.as_ref().map_or_else(|| collisions(&events).count(), |report| report.collisions.len());
        let violations = violations(scenario, &summary, collided);
        let verdict = match &report {
            Some(report) if report.complete && violations.is_empty() => Verdict::Passed,
            Some(report) if report.complete => Verdict::Violated,
            _ => Verdict::Failed,
        };
        Self { verdict, violations, summary, report, events, deviation: None }
    }

    /// The hash of all payloads; equal hashes mean equal flights. `None` if a fault ended the world.
    pub fn payload_hash(&self) -> Option<&str> {
        self.report.as_ref().map(|report| report.payload_hash.as_str())
    }

    /// The collisions, in order of time.
    pub fn collisions(&self) -> impl Iterator<Item = &TimedEvent> {
        collisions(&self.events)
    }

    /// The keys of the violated requirements, in the order of the alphabet.
    pub fn violated(&self) -> impl Iterator<Item = &str> {
        self.violations.iter().map(|violation| violation.requirement.as_str())
    }
}

fn collisions(events: &[TimedEvent]) -> impl Iterator<Item = &TimedEvent> {
    events.iter().filter(|timed| matches!(timed.event, Event::Collision { .. }))
}

/// Judges each requirement alone, because `judge` returns sentences and a study compares keys.
fn violations(scenario: &Scenario, summary: &FlightSummary, collisions: usize) -> Vec<Violation> {
    // Most flights violate nothing, and then one judgement is enough.
    if judge(scenario, summary, Some(collisions)).is_empty() {
        return Vec::new();
    }
    // What every flight has to do, whatever its scenario requires.
    let nothing = RequirementsSection { unplanned_losses_max: u32::MAX, ..RequirementsSection::default() };
    let judged = |requirements: RequirementsSection| {
        judge(&Scenario { requirements, ..scenario.clone() }, summary, Some(collisions))
    };
    let always = judged(nothing.clone());
    let alone = |(requirement, value): (String, Value)| {
        let mut only = keys_of(&nothing);
        only.insert(requirement.clone(), value);
        let only = serde_json::from_value(only.into()).expect("a key of the section it was taken from");
        // What every flight has to do is violated beside each requirement, and would be blamed on all of them.
        let sentences: Vec<_> =
            judged(only).into_iter().filter(|sentence| !always.contains(sentence)).collect();
        (!sentences.is_empty()).then_some(Violation { requirement, sentences })
    };
    let mut violations: Vec<_> = keys_of(&scenario.requirements).into_iter().filter_map(alone).collect();
    if !always.is_empty() {
        violations.insert(0, Violation { requirement: ALWAYS.into(), sentences: always });
    }
    violations
}

/// The requirements that `required` has, with their limits.
fn keys_of(required: &RequirementsSection) -> Map<String, Value> {
    match serde_json::to_value(required) {
        Ok(Value::Object(keys)) => keys,
        other => unreachable!("requirements are a table, not {other:?}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ringwing_scenario::Fault;
    use ringwing_simulation::fly as simulate;

    /// A flight of 5 s under the faults of `sentences`.
    fn short(sentences: &[&str]) -> Scenario {
        let mut scenario = Scenario::default();
        scenario.time.duration_s = 5.0;
        scenario.faults =
            sentences.iter().map(|sentence| sentence.parse().expect(sentence)).collect::<Vec<Fault>>();
        scenario
    }

    #[test]
    fn an_outcome_is_that_of_the_simulation() {
        let scenario = short(&["at 1 s kill uav 3"]);
        let (outcome, flown) = (fly(&scenario).unwrap(), simulate(&scenario).unwrap());
        assert_eq!(outcome.verdict, flown.verdict());
        assert_eq!(outcome.summary, flown.summary);
        assert_eq!(outcome.payload_hash(), Some(flown.report.unwrap().payload_hash.as_str()));
        assert_eq!((outcome.verdict, outcome.events), (Verdict::Passed, flown.events));
    }

    #[test]
    fn each_violated_requirement_is_named_by_its_key() {
        let mut scenario = short(&[]);
        scenario.requirements.separation_min_m = Some(1000.0);
        scenario.requirements.settling_max_s = Some(0.01);
        scenario.requirements.collisions_max = Some(0);
        let outcome = fly(&scenario).unwrap();
        assert_eq!(outcome.verdict, Verdict::Violated);
        assert_eq!(outcome.violated().collect::<Vec<_>>(), ["separation_min_m", "settling_max_s"]);
        let all: Vec<_> = outcome.violations.into_iter().flat_map(|violation| violation.sentences).collect();
        assert_eq!(all, simulate(&scenario).unwrap().violations);
    }

    #[test]
    fn a_flight_whose_world_ends_has_failed_and_has_no_hash() {
        let outcome = fly(&short(&["at 1 s kill world"])).unwrap();
        assert_eq!((outcome.verdict, outcome.payload_hash()), (Verdict::Failed, None));
    }
}
