//! The virtual leader: the centre of the formation, which every agent follows.
//!
//! [`path`] says where the leader is at each tick; [`process`] publishes that, tick by tick.
//!
//! Must never know who follows.

#![cfg_attr(not(test), warn(clippy::disallowed_methods))]

pub mod path;
pub mod process;

pub use path::Path;
pub use process::{LeaderArgs, run};
