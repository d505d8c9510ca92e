//! The worst flight of a hunt, made small, as a scenario that a person reads and flies.
//!
//! Never shows a flight that is less bad than what the hunt has found, or that goes beyond the budget.

use super::{Hunt, goal::Badness, search::Flown};
use crate::{
    flight::{Outcome, fly},
    shrink::{Kept, Progress, Smallest, brief, shrink_keeping, size},
};
use ringwing_recorder::metrics::Verdict;
use ringwing_scenario::Scenario;

/// What a hunt has found.
#[derive(Debug, Clone)]
pub struct Finding {
    /// The scenario of the worst flight.
    pub original: Scenario,
    /// The small scenario, and how it was found.
    pub smallest: Smallest,
    /// How bad the worst flight was.
    pub found: Badness,
    /// How bad the small scenario is: as bad as `found`, or worse.
    pub badness: Badness,
    /// How bad the scenario is without the faults of the budget.
    pub without: Badness,
}

/// Makes the worst flight of `hunt` small; `None` if the scenario is as bad without the faults of the budget. `stops` says
/// whether to end early, and `show` is called whenever the scenario has become smaller.
///
/// # Errors
/// The scenario cannot be simulated.
pub fn find(
    hunt: &Hunt,
    worst: &Flown,
    stops: impl Fn() -> bool,
    show: impl FnMut(Progress<'_>),
) -> Result<Option<Finding>, String> {
    let badness = |scenario: &Scenario| {
        fly(scenario).map(|outcome| hunt.goal.badness(&outcome)).map_err(|error| error.to_string())
    };
    let without = badness(&hunt.scenario)?;
    // Otherwise the finding would blame the budget's faults for what the scenario does without them.
    if worst.badness <= without {
        return Ok(None);
    }
    let kept = Kept {
        shows: |outcome: &Outcome| {
            outcome.verdict != Verdict::Failed && hunt.goal.badness(outcome) >= worst.badness
        },
        allows: |scenario: &Scenario| hunt.arena.excess(&scenario.faults).is_none(),
        is_at_one_moment: hunt.goal.is_at_one_moment(),
    };
    let original = hunt.scenario_of(&worst.candidate);
    let smallest = shrink_keeping(&original, &kept, stops, show);
    // Fly it again: the small scenario may be worse than the flight that was found, and the comments say how bad it
    // is.
    let small = badness(&smallest.scenario)?;
    Ok(Some(Finding { original, smallest, found: worst.badness, badness: small, without }))
}

impl Finding {
    /// The scenario with comments that say what it does, and how it was found in `source` by `flights` flights.
    pub fn to_text(&self, hunt: &Hunt, source: &str, flights: u64) -> String {
        let Hunt { goal, budget, seed, .. } = hunt;
        // A line break in a file's name would end the comment.
        let source = source.replace(char::is_control, " ");
        format!(
            "# The worst that {flights} flights found for {source}, by {goal}: {} (without the budget's faults: {}).\n\
             # Budget: {budget}\n# Seed of the search: {seed}\n\
             # It was shrunk from ({}) to ({}) in {} more flights{}.\n# Keys that are left out keep their defaults.\n\n{}",
            goal.brief(self.badness),
            goal.brief(self.without),
            size(&self.original),
            size(&self.smallest.scenario),
            self.smallest.flights,
            if self.smallest.is_stopped { "; that was interrupted" } else { "" },
            brief(&self.smallest.scenario)
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hunt::{Arena, Candidate, Gene, Goal, Strategy};

    fn hunt(goal: &str) -> Hunt {
        let mut scenario = Scenario::default();
        scenario.time.duration_s = 8.0;
        scenario.faults = vec!["at 2 s link 1->2 delay 50 ms for 1 s".parse().unwrap()];
        let budget = "2 kills, 1 freeze of at most 1 s, from 1 s to 6 s".parse().unwrap();
        Hunt {
            arena: Arena::new(&budget, &scenario).unwrap(),
            goal: Goal::new(goal, None).unwrap(),
            strategy: Strategy::Evolution,
            seed: 1,
            scenario,
            budget,
        }
    }

    /// One kill, one kill that is left out, and a freeze.
    fn worst(hunt: &Hunt) -> Flown {
        let gene = |time, target| Gene { time, target, length: 0.7, kind: 0.0, magnitude: 0.0 };
        let candidate: Candidate = vec![gene(0.8131, 0.2), gene(0.2, 1.0), gene(0.31, 0.4)];
        let badness = hunt.goal.badness(&fly(&hunt.scenario_of(&candidate)).unwrap());
        Flown { number: 3, candidate, badness }
    }

    #[test]
    fn a_finding_is_small_as_bad_and_within_the_budget() {
        let hunt = hunt("commanded");
        let worst = worst(&hunt);
        let finding = find(&hunt, &worst, || false, |_| ()).unwrap().unwrap();
        assert!(finding.badness >= worst.badness && worst.badness > finding.without, "{finding:?}");
        let small = &finding.smallest.scenario;
        assert_eq!(hunt.arena.excess(&small.faults), None, "{:?}", small.faults);
        assert!(small.faults.len() < hunt.scenario_of(&worst.candidate).faults.len(), "{:?}", small.faults);
    }

    #[test]
    fn the_text_of_a_finding_reads_back_and_is_as_bad() {
        let hunt = hunt("commanded");
        let finding = find(&hunt, &worst(&hunt), || false, |_| ()).unwrap().unwrap();
        let text = finding.to_text(&hunt, "two\nlines.toml", 90);
        assert!(
            text.starts_with("# The worst that 90 flights found for two lines.toml, by lowest commanded: ")
        );
        let read = Scenario::resolved(&text).unwrap();
        assert_eq!(hunt.goal.badness(&fly(&read).unwrap()), finding.badness);
    }

    #[test]
    fn a_flight_that_is_no_worse_than_without_the_faults_is_no_finding() {
        let hunt = hunt("ticks");
        assert!(find(&hunt, &worst(&hunt), || false, |_| ()).unwrap().is_none());
    }
}
