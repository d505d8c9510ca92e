//! The recorder: writes a run to one MCAP file and measures the flight.
//!
//! | room | what it does | pure |
//! | --- | --- | --- |
//! | [`metrics`] | measures and judges the flight, on plain frames | yes |
//! | [`schema`] | the topics and messages of the log | yes |
//! | [`summary`] | a run in numbers, as `summary.json` has it | yes |
//! | [`show`] | what viewers see: scenes, map, faults, panels | yes |
//! | [`follower`] | follows a flight with `metrics` and `show` | yes |
//! | [`stream`] | the messages of a flight, for a log or for live viewers | yes |
//! | [`log`] | the file: writes, takes over, reads, recovers it | no |
//! | `process` | the process: subscribes, puts ticks together, records; [`Observation`] only watches | no |
//!
//! Each room uses only those above it. Must never change the flight: the recorder sends nothing that an airframe, an
//! agent or the leader receives.

#![cfg_attr(not(test), warn(clippy::disallowed_methods))]

mod clock;
mod error;
pub mod flat;
pub mod follower;
pub mod log;
pub mod metrics;
mod process;
pub mod schema;
pub mod show;
pub mod stream;
pub mod summary;
#[cfg(test)]
mod testing;

pub use clock::Clock;
pub use error::RecorderError;
pub use log::gap::Gap;
pub use metrics::{FlightSummary, Metrics, judge};
pub use process::{
    Observation, RecorderArgs, Seen,
    recording::{ADDED_FAULTS, RecorderReport, Recording},
    run,
};
pub use summary::Summary;
