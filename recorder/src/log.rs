//! The log: one MCAP file that can be opened at any time. Two equal flights write the same bytes.
//!
//! `write` writes it, with the file of `sink`. `takeover` rescues the log of a recorder that
//! died: `salvage` reads it, `replay` puts its ticks together again, and `copy` moves its records. [`reader`] reads any log
//! for the tools, `input` opens it, [`meter`] measures its flight again, [`recover`] rebuilds a damaged one, and `gap` counts
//! lost ticks. [`run_folder`] says where the logs of runs are.
//!
//! Must never contain a wall-clock time, unless the timing of ticks is wanted.

pub(crate) mod copy;
pub(crate) mod gap;
mod input;
pub mod meter;
pub mod reader;
pub mod recover;
pub(crate) mod replay;
pub mod run_folder;
pub(crate) mod salvage;
mod sink;
pub(crate) mod takeover;
mod write;

pub(crate) use write::LogWriter;
pub use write::Opening;

/// The metadata about the run: its name, seed, swarm and mode.
pub(crate) const RUN: &str = "run";
/// The metadata about the outcome: verdict, metrics and the world's report.
pub(crate) const RESULT: &str = "result";
/// The attachment with the scenario, from which the flight can be repeated.
pub(crate) const SCENARIO: &str = "scenario.toml";
/// The attachment with the panels to view the log in Foxglove.
pub(crate) const LAYOUT: &str = "foxglove-layout.json";
