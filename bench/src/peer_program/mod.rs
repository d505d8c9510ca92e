//! Programs that a user brings along (`--peer NAME=COMMAND`): they take the places of world and agents.
//!
//! [`program`] says which program to start, [`processes`] starts it and watches over its processes, and [`records`] checks
//! the timestamps that they leave. `PEERS.md` is the contract with the authors of such programs.
//!
//! Must never trust a program: it may fail, hang, or leave wrong timestamps.

pub(crate) mod processes;
pub(crate) mod program;
mod records;
