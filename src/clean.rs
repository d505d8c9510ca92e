//! `ringwing clean`: removes what killed runs left in shared memory and killed benchmarks in temporary folders.
//!
//! Never touches anything whose launcher or benchmark is still running.

use crate::{
    FAILED,
    output::{self, tell},
};
use std::process::ExitCode;

/// Removes every domain without a launcher and every scratch folder without a benchmark; the exit code is 1 if some of
/// them belong to another user.
#[expect(clippy::unnecessary_wraps, reason = "every subcommand has this signature")]
pub(crate) fn run() -> anyhow::Result<ExitCode> {
    let domains = ringwing_bus::domain::remove_abandoned();
    let folders = ringwing_bench::remove_abandoned();
    let folders = folders.iter().map(|folder| folder.display().to_string());
    let removed: Vec<String> = domains.iter().map(ToString::to_string).chain(folders).collect();
    for one in &removed {
        tell(&format!("removed {one}"));
    }
    let foreign = ringwing_bus::domain::abandoned_by_others();
    for domain in &foreign {
        output::error(&domain.permission_denied());
    }
    if removed.is_empty() && foreign.is_empty() {
        tell("nothing to remove");
    }
    Ok(if foreign.is_empty() { ExitCode::SUCCESS } else { ExitCode::from(FAILED) })
}
