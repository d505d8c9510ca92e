//! `ringwing bench`: how long a control tick takes across processes, where the time goes, and what other transports
//! cost.
//!
//! - `args` says what to measure, as `axes` of `case`s, and `order` shuffles them.
//! - `runner` measures each case in its own process (`case_args`): the swarm itself, or a `transport` or a
//!   `peer_program` in its place. `scratch` is the temporary folder of a benchmark.
//! - `measure` keeps the timestamps of every tick and writes them as a `trace` to a `trace_file`, with the
//!   `usage` of all processes from `proc_files`.
//! - `hops` computes latencies from a trace; `latencies` (`hdr` in files) and `statistics` describe them, and
//!   `result` holds everything.
//! - A result is shown as a `table`, as a `page` with `charts`, as `histogram_files`, or beside another one
//!   (`compare`). All figures come from `quantity`, all names from `label`.
//! - `doctor` looks at the `machine` through `kernel_files`.
//!
//! Must never filter a sample, and must never change what flies.

mod args;
mod axes;
mod case;
mod case_args;
mod cells;
mod charts;
mod compare;
mod doctor;
mod error;
#[cfg(test)]
mod example;
mod hdr;
mod histogram_files;
mod hops;
mod kernel_files;
mod label;
mod latencies;
mod machine;
mod measure;
mod order;
mod page;
mod peer_program;
mod proc_files;
mod quantity;
mod report;
mod result;
mod runner;
mod scratch;
mod standstill;
mod statistics;
mod table;
mod trace;
mod trace_file;
mod transport;
mod usage;

pub use args::{BenchArgs, PlacementArgs};
pub use case::{Carrier, Case, Load, Topology};
pub use case_args::{CaseArgs, FLIGHT_LOG};
pub use error::BenchError;
pub use measure::{Measure, MeasureArgs};
pub use peer_program::program::PeerProgram;
pub use report::{Report, run};
pub use scratch::remove_abandoned;
pub use transport::peer::{PeerArgs, run as run_peer};
