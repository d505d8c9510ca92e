//! The scenario of a run: what flies, by which law, past which obstacles, and what it must achieve.
//!
//! [`model`] is the scenario itself, [`formation`] the geometry it implies, [`LivingRing`]
//! that of those who are left, [`motion`] how what flies in it moves.
//! [`Source`] finds a scenario's text, [`Scenario::read`] makes one of it with the [`Setting`]s of the command line, or
//! says all that is wrong with it at once. [`preset`] holds those that come with ringwing, [`start`] places the UAVs,
//! [`fault`] is the vocabulary of what is done to a run on purpose, [`draw`] what is drawn by its seed.
//!
//! Never knows of processes, services or clocks.

pub mod draw;
mod example;
pub mod fault;
mod flaw;
pub mod formation;
mod hint;
mod living;
pub mod model;
pub mod motion;
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
pub use formation::Formation;
pub use living::{LivingRing, Slot};
pub use model::{
    Airframe, Control, DeadReckoning, Draw, Failsafe, FormationSection, Georeference, Ipc, Law, Leader,
    Membership, Obstacle, OnLoss, Requirements, Scenario, Sensing, Start, StartState, Supervision, Switches,
    Time, Wake,
};
pub use motion::{Pose, direction, wrap};
pub use preset::Preset;
pub use problem::{Place, Problem, ScenarioError};
pub use setting::Setting;
pub use source::Source;
pub use validate::{PAYLOAD_MAX_BYTES, UAVS_MAX, UAVS_MIN};
