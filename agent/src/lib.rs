//! One UAV's flight.
//!
//! [`law`] is the paper's control law, [`link`] what the UAV has heard of another, [`pilot`] puts both together once a
//! tick, [`process`] is the operating-system process round them. [`impairment`] is what faults do to what is received,
//! on its way from an `inlet` to the pilot.
//!
//! Never reads the world's truth, nor the state of any UAV that is not its ring neighbour.

mod faults;
pub mod impairment;
mod inlet;
pub mod law;
pub mod link;
pub mod membership;
pub mod pilot;
pub mod process;

pub use pilot::{Decision, Pilot};
pub use process::{AgentError, Args, run};
