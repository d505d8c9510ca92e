//! The programs of users that fly UAVs in place of the built-in law, as `[[agents]]` names them.
//!
//! [`find`] says before a flight whether a program can be started, and [`output`] keeps what it prints. In a run a program is an
//! agent of its own. In a simulated flight [`Programs`] starts it, and [`guest`] is the other end of the socket between them.
//!
//! Never decides which UAV flies with which program: the scenario does.

#![cfg_attr(not(test), warn(clippy::disallowed_methods))]

pub mod find;
pub mod guest;
mod host;
pub mod output;
mod program;
mod socket;

pub use find::{FindError, check, files};
pub use host::Programs;
pub use program::{ProgramError, SIMULATED_MARKER};

/// Makes Python write each line at once. A killed process would lose what it has not written.
pub const UNBUFFERED: (&str, &str) = ("PYTHONUNBUFFERED", "1");
