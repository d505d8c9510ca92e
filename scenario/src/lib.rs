//! The scenario of a run: what flies, by which law, past which obstacles, and what it must achieve.
//!
//! [`model`] is the scenario itself, [`formation`] the geometry it implies, [`read`] turns a file into one and says all
//! that is wrong with it at once, [`validate`] knows which values are possible, [`preset`] holds those that come with
//! ringwing, [`start`] places the UAVs.
//!
//! Never knows of processes, services or clocks.

pub mod formation;
pub mod model;

pub use formation::Formation;
pub use model::{
    Airframe, Control, DeadReckoning, Draw, Failsafe, FormationSection, Law, Leader, Obstacle, Requirements,
    Scenario, Sensing, Start, StartState, Supervision, Time,
};
