//! How much of something a swarm can take: the value at which success falls below what is asked for.
//!
//! A [`Question`] puts values into a fault's sentence or a key; a [`Search`] says which values to fly; a [`Trial`] decides
//! after as few flights as are needed. Must never let anything but scenario, value and seed decide a flight.

mod chance;
mod flights;
mod question;
mod search;
mod trial;

pub use flights::Pilots;
pub use question::{Asked, Delays, Question};
pub use search::{Finding, Range, Search, Tried};
pub use trial::{Decision, Trial};

use chance::depends_on_seed;
use flights::fly_trial;

/// How a search is flown.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plan {
    /// Share of flights that shall succeed.
    pub success: f64,
    /// Probability with which the bracket holds the margin.
    pub confidence: f64,
    /// Most flights at one value.
    pub flights_max: u64,
    /// The first seed at each value; the others follow.
    pub first_seed: u64,
}

/// Searches the answer to `question`; `show` gets the values so far and the one that is being flown. The search is not over
/// if `pilots` were stopped: then [`Search::next`] still asks for a value.
///
/// # Errors
/// A value does not fit the scenario, or its UAVs find no room to start.
pub fn search(
    question: &Question,
    plan: &Plan,
    pilots: &Pilots,
    mut show: impl FnMut(&Search, f64, &Trial),
) -> Result<Search, String> {
    let mut search = Search::new(question.range, plan.success, 1.0 - plan.confidence);
    while let Some((value, trial)) = search.next() {
        let scenario = question.scenario(value).map_err(|problem| problem.to_string())?;
        let is_certain = !depends_on_seed(&scenario);
        let most = if is_certain { 1 } else { plan.flights_max };
        let flown =
            fly_trial(&scenario, plan.first_seed, most, trial, pilots, |trial| show(&search, value, trial))?;
        match flown {
            Some(trial) => search.note(value, trial, is_certain),
            None => break,
        }
    }
    Ok(search)
}
