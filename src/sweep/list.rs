//! `ringwing sweep list`: the built-in sweeps.

use crate::output::tell;
use ringwing_study::sweep::{Draft, preset};
use std::process::ExitCode;

/// Prints each built-in sweep with its size and what it shows.
pub(super) fn run() -> ExitCode {
    for preset in preset::all() {
        let sweep = Draft::parse(preset.name, preset.text).and_then(Draft::finish);
        let size = sweep.map_or_else(
            |_| String::new(),
            |sweep| format!("{} flights", sweep.flights().unwrap_or_default()),
        );
        tell(&format!("{:<14} {size:>14}  {}", preset.name, preset.description));
    }
    ExitCode::SUCCESS
}
