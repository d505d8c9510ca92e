//! Makes a flight that violates a requirement small, so that a reader sees what it takes to violate it.
//!
//! `search` tries smaller scenarios and keeps each that shows the same [`Symptom`], or whatever else a caller has
//! [`Kept`]; `sentence` makes the numbers of a fault smaller; `uavs` takes UAVs away; `text` writes the result. Nothing is
//! drawn at random, so the same scenario gives the same result.
//!
//! Never changes a requirement, the law or the seed: the small flight has to fail for the same reason.

mod search;
mod sentence;
mod symptom;
mod text;
mod uavs;

pub use search::{Kept, Progress, Shrunk, Smallest, shrink, shrink_keeping};
pub use symptom::Symptom;
pub(crate) use text::{brief, size};

use crate::flight::FlightError;

/// Why a scenario cannot be made smaller.
#[derive(Debug, thiserror::Error)]
pub enum ShrinkError {
    /// It cannot be flown in the simulation.
    #[error(transparent)]
    Flight(#[from] FlightError),
    /// A fault ended the world, so no requirement was judged on a whole flight.
    #[error("scenario {0:?}: a fault ends the world, so the flight has no end to judge: remove that fault")]
    Ended(String),
    /// It violates nothing.
    #[error(
        "scenario {0:?}: passes, so there is nothing to shrink: give a scenario that violates a requirement"
    )]
    Passed(String),
    /// It violates other requirements than the wanted one.
    #[error("scenario {name:?}: does not violate {wanted}; it violates {violated}")]
    OtherRequirement {
        /// The scenario.
        name: String,
        /// The requirement that was asked for.
        wanted: String,
        /// The requirements that it violates.
        violated: String,
    },
}
