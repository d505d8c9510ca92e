//! The worst that a bounded number of faults can do to a flight.
//!
//! A [`Budget`] says what is allowed, and an [`Arena`] what that means in a scenario; a [`Search`] chooses candidates,
//! [`run`] flies them and keeps a row for each in a file, and a [`Finding`] is the worst flight, made small.
//!
//! Must never go beyond the budget, and never let anything but scenario, budget, goal and seed decide a finding.

mod budget;
mod candidate;
mod finding;
mod flights;
mod goal;
mod search;
#[cfg(test)]
mod tests;

pub use budget::{Budget, BudgetError};
pub use candidate::{Arena, Candidate, Gene};
pub use finding::{Finding, find};
pub use flights::{End, FlightFile, HuntError, Hunted, Limits, run};
pub use goal::{Badness, Goal, brief};
pub use search::{Flown, Search, Strategy};

use ringwing_scenario::Scenario;

/// What is hunted, and where.
pub struct Hunt {
    /// The scenario, which has been validated.
    pub scenario: Scenario,
    /// What may be done to it.
    pub budget: Budget,
    /// The budget in the scenario.
    pub arena: Arena,
    /// What shall become bad.
    pub goal: Goal,
    /// How candidates are chosen.
    pub strategy: Strategy,
    /// The seed of the search.
    pub seed: u64,
}

impl Hunt {
    /// The scenario under the faults of a candidate.
    pub fn scenario_of(&self, candidate: &Candidate) -> Scenario {
        let mut scenario = self.scenario.clone();
        scenario.faults.extend(self.arena.faults(candidate));
        scenario
    }
}
