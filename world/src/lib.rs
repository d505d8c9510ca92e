//! Time, airframes, obstacles and collisions.
//!
//! [`airframe`] is one UAV's body, [`sky`] all of them among the obstacles, and [`process`] the operating-system process
//! that integrates them tick by tick.
//!
//! Never knows of the formation: what the UAVs are up to is theirs.

pub mod airframe;
mod answers;
mod collisions;
mod ports;
pub mod process;
pub mod sky;
mod tally;

pub use airframe::{Airframe, Refusal};
pub use process::{Args, WorldError, run};
pub use sky::Sky;
