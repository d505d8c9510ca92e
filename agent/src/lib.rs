//! One UAV's flight.
//!
//! [`law`] is the paper's control law; [`own`], [`neighbours`] and [`lead`] are what the UAV knows of itself, of the others
//! and of the leader; [`membership`] is who of them lives, [`slots`] where each should be. [`pilot`] puts all that together
//! once a tick, [`process`] is the operating-system process round it.
//! [`arrivals`] and [`impairment`] are what becomes of what is received, by its time and by faults, on its way from an
//! `inlet` of the `ports` to the pilot.
//!
//! Never reads the world's truth, nor the state of any UAV that is not its ring neighbour.

pub mod arrivals;
mod faults;
pub mod impairment;
mod inlet;
pub mod law;
pub mod lead;
pub mod link;
pub mod membership;
pub mod neighbours;
pub mod own;
pub mod pilot;
mod ports;
pub mod process;
pub mod slots;

pub use pilot::{Decision, Pilot};
pub use process::{AgentError, Args, run};
