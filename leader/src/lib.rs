//! The virtual leader: the centre of the formation, which every agent follows.
//!
//! [`path`] says where it is at each tick, [`process`] is the operating-system process that publishes it.
//!
//! Never knows who follows.

pub mod path;
pub mod process;

pub use path::Path;
pub use process::{Args, LeaderError, run};
