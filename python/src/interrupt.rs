//! Ctrl-C while native code runs: Python notes signals, but raises `KeyboardInterrupt` only where somebody asks.
//!
//! Never swallows an exception: whatever a signal handler raised comes out of the call.

use pyo3::{PyErr, PyResult, Python};
use std::time::{Duration, Instant};

/// Time between two questions. A longer one delays the end after Ctrl-C; a shorter one costs time, because each question
/// takes the interpreter's lock.
const ASK_PERIOD: Duration = Duration::from_millis(50);

/// Asks now and then whether a signal has come.
pub(crate) struct SignalWatch {
    asked: Instant,
}

impl SignalWatch {
    pub(crate) fn new() -> Self {
        Self { asked: Instant::now() }
    }

    /// What a signal handler has raised, such as `KeyboardInterrupt`. Only the main thread learns of signals.
    pub(crate) fn raised(&mut self) -> Option<PyErr> {
        if self.asked.elapsed() < ASK_PERIOD {
            return None;
        }
        self.asked = Instant::now();
        Python::attach(|py| -> PyResult<()> { py.check_signals() }).err()
    }
}
