//! `ringwing shrink`: makes a flight that violates a requirement small.
//!
//! Never flies anything itself; `ringwing_study::shrink` does.

use crate::{
    FAILED, config,
    output::{self, tell},
    verify,
};
use ringwing_bus::{StopFlag, write_whole};
use ringwing_flight::counted;
use ringwing_recorder::log::reader::Reader;
use ringwing_scenario::{Fault, Scenario, Setting, Source};
use ringwing_study::{
    shell::quoted,
    shrink::{Progress, shrink},
};
use std::{
    path::{Path, PathBuf},
    process::ExitCode,
};

/// What to shrink.
#[derive(Debug, clap::Args)]
pub(crate) struct ShrinkArgs {
    /// Name of a preset, a scenario file, or a log: a run's folder, the .mcap file in it, or `latest`
    scenario: String,
    /// Override a key of the scenario, such as `seed=7`
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = Setting::parse)]
    settings: Vec<Setting>,
    /// Add a fault, such as "at 30 s kill uav 3"
    #[arg(long = "fault", value_name = "SENTENCE")]
    faults: Vec<Fault>,
    /// The requirement that the small flight must violate; by default one about coming too close, or else the first
    #[arg(long, value_name = "KEY")]
    requirement: Option<String>,
    /// Write the small scenario to this file
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

/// Shrinks and prints the small scenario.
pub(crate) fn run(args: &ShrinkArgs) -> anyhow::Result<ExitCode> {
    let stop = StopFlag::on_signals()?;
    let original = original(args)?;
    let shrunk = shrink(&original, args.requirement.as_deref(), || stop.is_set(), show)?;
    let text = shrunk.to_text(&args.scenario, &original);
    output::print(&text);
    if let Some(path) = &args.out {
        write_whole(path, text.as_bytes())
            .map_err(|error| anyhow::anyhow!("file {}: cannot be written: {error}", path.display()))?;
        tell(&format!("\n# fly it:  ringwing run {}", quoted(&path.display().to_string())));
    }
    if shrunk.smallest.is_stopped {
        output::warning(&"interrupted: this is the smallest scenario so far, and there may be a smaller one");
        return Ok(ExitCode::from(FAILED));
    }
    Ok(ExitCode::SUCCESS)
}

/// The scenario that the arguments ask for, from a log if they name one.
fn original(args: &ShrinkArgs) -> anyhow::Result<Scenario> {
    let path = config::log(Path::new(&args.scenario));
    let is_log = path.is_dir() || path.extension().is_some_and(|extension| extension == "mcap");
    if !is_log {
        return Ok(Scenario::read(&Source::find(&args.scenario)?, &args.settings)?.with_faults(&args.faults)?);
    }
    let mut reader = Reader::open(&path)?;
    let scenario = verify::repeatable(&mut reader)?.scenario;
    let source = Source { name: args.scenario.clone(), text: scenario.to_toml() };
    Ok(Scenario::read(&source, &args.settings)?.with_faults(&args.faults)?)
}

/// Shows the smallest scenario so far.
pub(crate) fn show(Progress { smallest, flights }: Progress<'_>) {
    output::note(&format!(
        "{}: {}, {}, {} s",
        counted(flights, "flight"),
        counted(smallest.faults.len(), "fault"),
        counted(smallest.formation.uavs, "UAV"),
        smallest.time.duration_s
    ));
}
