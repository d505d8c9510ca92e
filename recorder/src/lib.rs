//! The recorder: writes a run to one MCAP file and measures the flight.
//!
//! `process` listens to everybody; `frame` puts what it hears together, tick by tick; `schema` says how a tick
//! looks in the log, `log` writes it, always openable, on the file of `sink`; `takeover` rescues the log of a
//! recorder that died, with `salvage` to read it and `replay` to learn from it; `reader` reads any log for the tools
//! and `recover` rebuilds one that is damaged; `gap` counts what was lost; `view` makes what viewers are shown, of
//! `scene`s, the `swarm`, `faults` and the earth of `geo`, in colours of the `palette`, and `layout` the panels
//! to see it in; `metrics` measures the flight and `verdict` judges it; `recording` holds these together.
//!
//! Never changes the flight: it sends nothing that an airframe, an agent or the leader hears.

mod clock;
mod error;
pub mod events;
pub mod faults;
pub mod frame;
pub mod log;
pub mod metrics;
mod process;
mod recording;
mod replay;
pub mod schema;
pub mod show;
mod takeover;
#[cfg(test)]
mod testing;
pub mod verdict;

pub use error::RecorderError;
pub use log::gap::Gap;
pub use metrics::{FlightSummary, Metrics};
pub use process::{Args, run};
pub use recording::RecorderReport;
pub use verdict::judge;
