//! The scenario of a run: what flies, by which law, past which obstacles, and what it must achieve.
//!
//! [`model`] is the scenario itself. [`Source`] finds a scenario's text; [`Scenario::read`] parses it, applies the
//! [`Setting`]s of the command line, and reports all problems at once. [`preset`] holds the built-in scenarios, [`start`]
//! places the UAVs, and [`fault`] is the grammar of faults and their schedule.
//!
//! Never knows of processes, services or clocks.

#![cfg_attr(not(test), warn(clippy::disallowed_methods))]

mod event_text;
mod example;
pub mod fault;
mod flaw;
mod hint;
pub mod model;
mod origin;
pub mod preset;
mod problem;
mod read;
mod setting;
mod shape;
mod source;
pub mod start;
mod switch;
mod unit;
mod validate;

pub use fault::{Action, Fault, schedule::Schedule};
pub use model::{
    Airframe, Control, DeadReckoning, Draw, Failsafe, FormationSection, Georeference, Ipc, Law, Leader,
    Membership, Obstacle, Requirements, Scenario, Sensing, Start, StartState, Supervision, Switches, Time,
    Wake,
};
pub use preset::Preset;
pub use problem::{Place, Problem, ScenarioError};
pub use setting::Setting;
pub use source::Source;
pub use validate::{PAYLOAD_MAX_BYTES, UAVS_MAX, UAVS_MIN};
