//! The virtual leader: the centre of the formation, which every agent follows.
//!
//! [`path`] says where the leader is at each tick; [`process`] publishes that, tick by tick.
//!
//! Must never know who follows.

pub mod path;
pub mod process;

pub use path::Path;
pub use process::{Args, run};
