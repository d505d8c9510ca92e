//! Many simulated flights, and what they say about a swarm.
//!
//! [`flight`] flies one scenario and returns its [`Outcome`]; [`figure`] names every number of it. Everything else here
//! is built on these two, apart from [`recorded`], which writes the log of one flight.
//!
//! Never changes a flight: a flight depends only on its scenario, so the order and the number of flights decide nothing.

pub mod baseline;
mod crewed;
pub mod figure;
pub mod files;
pub mod flight;
pub mod hunt;
pub mod margin;
pub mod recorded;
pub mod shell;
pub mod shrink;
pub mod statistics;
pub mod sweep;
pub mod theory;

pub use baseline::Baseline;
pub use figure::Figure;
pub use flight::{Outcome, Violation, fly, fly_beside_baseline};
