//! Sweeps: a scenario flown at many values of some axes, with many seeds.
//!
//! A [`Draft`] is put together from a file and the command line; it becomes a [`Definition`], whose [`Design`] says which
//! values each cell has. The [`Ledger`] hands out flights, the runner flies them, and each becomes a [`Row`] of the results.
//!
//! Must never let anything but scenario, cell and seed decide a flight.

mod cells;
mod check;
mod compare;
mod definition;
mod design;
mod draft;
mod file;
mod ledger;
mod maps;
mod page;
mod parquet;
pub mod preset;
mod results;
mod row;
mod runner;
mod shard;
mod template;
mod values;

pub use cells::{Cell, CellFold, Spread};
pub use check::check;
pub use compare::{Difference, Side, compare};
pub use definition::{Definition, Manifest, Seeds, SweepProblem};
pub use design::{Axis, Combination, Design, Sampling};
pub use draft::{Draft, Given, Text};
pub use ledger::{FlightId, Ledger, Next};
pub use maps::{Map, draw_maps};
pub use page::{command, page};
pub use parquet::write_parquet;
pub use results::{DEFINITION, RowFile, flight_of, flights_file, read_cells, read_rows, sort_rows};
pub use row::{Columns, Row};
pub use runner::{Crew, Tally, run};
pub use shard::Shard;
pub use template::Template;
pub use values::{Distribution, Values, number_text};
