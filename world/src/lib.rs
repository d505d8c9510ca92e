//! Time, airframes, obstacles and collisions.
//!
//! [`airframe`] is one UAV's body, [`sky`] all of them among the obstacles, [`schedule`] the deadlines of real time,
//! [`process`] the operating-system process that integrates them tick by tick, [`measure`] what it keeps of that for a
//! benchmark.
//!
//! Never knows of the formation: what the UAVs are up to is theirs.

pub mod airframe;
pub mod airspace;
mod answers;
mod collisions;
pub mod measure;
mod ports;
pub mod process;
pub mod schedule;
pub mod sky;
mod wall_clock;

pub use airframe::{Airframe, Refusal};
pub use airspace::{Airspace, CommandCounts};
pub use measure::MeasureArgs;
pub use process::{Args, WorldError, run};
pub use sky::Sky;
