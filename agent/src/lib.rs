//! One UAV's agent: what it receives goes in, the command for its airframe and its own state come out.
//!
//! [`UavAgent`] is everything an agent does in a tick: [`reception`] decides which samples it can use, the [`pilot`]
//! what to do with them. The pilot flies the paper's control [`law`], through the collision filter of [`safety`];
//! [`membership`] tells it who is alive. [`controller`] is the seam behind which a user's own law flies instead. [`process`] is
//! the operating-system process around them, and the only module here that knows ports, clocks and threads.
//!
//! Never reads the world's truth, nor the state of any UAV that is not its ring neighbour.

#![cfg_attr(not(test), warn(clippy::disallowed_methods))]

pub mod controller;
pub mod law;
pub mod membership;
pub mod pilot;
pub mod process;
pub mod reception;
pub mod safety;
pub mod uav_agent;

pub use controller::{Controller, Wish};
pub use pilot::{Decision, Pilot, Situation};
pub use process::{AgentArgs, AgentError, Start, run, run_controller};
pub use reception::Inputs;
pub use uav_agent::{Answer, UavAgent};
