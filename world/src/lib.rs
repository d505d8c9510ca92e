//! Time, airframes, obstacles, intruders and collisions.
//!
//! The pure part of the crate knows no process, service or clock: [`airframe`] is the body of one UAV, `response` how fast
//! it does what it is told, `wind` the air around it, `sensors` what it senses of its own flight, [`sky`] all of them among the obstacles, and [`airspace`] what a tick
//! does to them, with the report on the flight.
//!
//! [`process`] is the operating-system process that drives the airspace.
//!
//! Never knows the formation: where the UAVs should be is the agents' business.

#![cfg_attr(not(test), warn(clippy::disallowed_methods))]

pub mod airframe;
pub mod airspace;
mod by_x;
mod collisions;
mod encounters;
mod flight_hash;
mod intruder;
mod obstacle;
pub mod process;
mod response;
mod sensors;
pub mod sky;
mod wind;

pub use airframe::{Airframe, Refusal};
pub use airspace::{Airspace, CommandCounts, Sensing};
pub use process::{WorldArgs, run};
pub use sky::Sky;
