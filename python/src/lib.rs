//! The native half of the Python package `ringwing`: reads logs into columns, and flies simulations and sweeps.
//!
//! Must never hold the interpreter's lock while it reads or flies, and never print. The Python half has the classes that
//! people use, with their documentation; `_native.pyi` says what it gets from here.

mod columns;
mod controller;
mod error;
mod flight;
mod interrupt;
mod log;
mod message_shape;
mod notes;
mod situation;
mod sweep;
mod tables;
mod wire;

use pyo3::prelude::*;

/// The native half of the package `ringwing`.
#[pymodule]
mod _native {
    #[pymodule_export]
    use crate::{
        controller::{Wish, direction, run_agent},
        error::{AgentError, FlightError, LogError, RingwingError, ScenarioError},
        flight::fly,
        log::NativeLog,
        situation::{Aircraft, Leader, Neighbour, Obstacle, Situation, Track},
        sweep::sweep,
    };
    use pyo3::prelude::*;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("VERSION", env!("CARGO_PKG_VERSION"))
    }
}
