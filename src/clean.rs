//! `ringwing clean`: removes what killed runs left in shared memory and killed benchmarks in temporary folders.
//!
//! Never touches anything whose launcher or benchmark is still running.

use crate::tell;
use std::process::ExitCode;

/// Removes every domain without a launcher and every scratch folder without a benchmark.
#[expect(clippy::unnecessary_wraps, reason = "every subcommand has this signature")]
pub(crate) fn run() -> anyhow::Result<ExitCode> {
    let domains = ringwing_bus::domain::remove_abandoned();
    let folders = ringwing_bench::remove_abandoned();
    let folders = folders.iter().map(|folder| folder.display().to_string());
    let removed: Vec<String> = domains.iter().map(ToString::to_string).chain(folders).collect();
    for one in &removed {
        tell(&format!("removed {one}"));
    }
    if removed.is_empty() {
        tell("nothing to remove");
    }
    Ok(ExitCode::SUCCESS)
}
