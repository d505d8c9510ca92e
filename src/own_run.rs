//! Flies a scenario with real processes, by a run of this very program.
//!
//! Never launches a swarm within this process: the launcher owns signals and children of its process.

use ringwing_scenario::Scenario;
use serde::de::DeserializeOwned;
use std::{
    fs, io,
    path::Path,
    process::{Command, Output},
};

/// Why there is no summary of a run.
#[derive(Debug, thiserror::Error)]
pub(crate) enum OwnRunError {
    #[error("the processes cannot be run: {0}")]
    NotStarted(#[from] io::Error),
    /// With what the run said instead.
    #[error("the processes left no summary: {0}")]
    NoSummary(String),
}

/// Flies `scenario` by `ringwing run` with these further `flags`, and reads its summary. The run's folder goes into `out`, or is
/// removed with everything in it.
///
/// The exit code is ignored: a flight that violates a requirement is a result like any other.
pub(crate) fn fly<T: DeserializeOwned>(
    scenario: &Scenario,
    flags: &[&str],
    out: Option<&Path>,
) -> Result<T, OwnRunError> {
    let folder = tempfile::tempdir()?;
    let file = folder.path().join("scenario.toml");
    fs::write(&file, scenario.to_toml())?;
    // The link stays good if the file of this program is replaced meanwhile.
    let mut command = Command::new("/proc/self/exe");
    command.arg("run").arg(&file).args(flags).args(["--json", "--out"]).arg(out.unwrap_or(folder.path()));
    let Output { stdout, stderr, .. } = command.output()?;
    serde_json::from_slice(&stdout).map_err(|_| {
        let text = String::from_utf8_lossy(&stderr);
        let text = text.trim();
        OwnRunError::NoSummary(text.strip_prefix("error: ").unwrap_or(text).to_owned())
    })
}
