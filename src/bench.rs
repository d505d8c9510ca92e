//! `ringwing bench` and its hidden commands: the parts of a benchmark that need the launcher or the world.
//!
//! Must never measure anything itself: the crate `ringwing_bench` does.

use crate::{
    FAILED, WrongUsage,
    launcher::{Plan, launch},
    output::tell,
};
use anyhow::{Context, bail};
use ringwing_bench::{BenchArgs, BenchError, Carrier, CaseArgs, FLIGHT_LOG, Measure, MeasureArgs, PeerArgs};
use ringwing_bus::{NoProbe, die_with};
use ringwing_recorder::log::run_folder::log_in;
use std::{collections::BTreeSet, fs, path::Path, process::ExitCode};

/// The arguments of the world's process: its own, and those of a benchmark.
#[derive(Debug, clap::Args)]
pub(crate) struct MeasuredWorldArgs {
    #[command(flatten)]
    world: ringwing_world::WorldArgs,
    #[command(flatten)]
    measure: MeasureArgs,
}

/// Measures, and prints the report; the exit code says whether everything was measured.
pub(crate) fn run(args: &BenchArgs) -> anyhow::Result<ExitCode> {
    let report = ringwing_bench::run(args).map_err(usage_or_failure)?;
    tell(report.text.trim_end());
    if let Some(error) = report.unwritten {
        return Err(error.into());
    }
    Ok(if report.is_complete { ExitCode::SUCCESS } else { ExitCode::from(FAILED) })
}

/// Separates wrong options from failures, which end the command with another exit code.
fn usage_or_failure(error: BenchError) -> anyhow::Error {
    if error.is_usage() { WrongUsage(error.to_string()).into() } else { error.into() }
}

/// Measures one case: flies the swarm, becomes the hub of another transport, or starts the user's program.
pub(crate) fn run_case(args: &CaseArgs) -> anyhow::Result<ExitCode> {
    die_with(args.launcher)?;
    if args.case.carrier == Carrier::Swarm {
        fly(args)?;
    } else {
        args.measure_transport()?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Answers ticks in an agent's place.
pub(crate) fn run_peer(args: &PeerArgs) -> anyhow::Result<ExitCode> {
    ringwing_bench::run_peer(args)?;
    Ok(ExitCode::SUCCESS)
}

/// Runs the world, and measures its ticks if a benchmark asks for that.
pub(crate) fn run_world(args: &MeasuredWorldArgs) -> anyhow::Result<ExitCode> {
    match Measure::new(&args.measure) {
        Some(measure) => ringwing_world::run(&args.world, measure)?,
        None => ringwing_world::run(&args.world, NoProbe)?,
    }
    Ok(ExitCode::SUCCESS)
}

fn fly(args: &CaseArgs) -> anyhow::Result<()> {
    let folder = args.measure.measure_into.as_deref().and_then(Path::parent).unwrap_or(Path::new("."));
    let plan = Plan {
        scenario: args.case.scenario(args.seed)?,
        out: folder.to_owned(),
        record: args.case.recorder,
        timing: true,
        by_hand: BTreeSet::new(),
        quiet: true,
        recorder: args.case.recorder,
        measure: Some(args.measure.clone()),
        placement: args.placement.placement(),
        lock_memory: false,
        live: None,
    };
    let outcome = launch(&plan)?;
    let log = log_in(&outcome.folder);
    if log.exists() {
        // Move the log to where the benchmark looks for it: the benchmark does not know the run's folder.
        fs::rename(&log, folder.join(FLIGHT_LOG)).context("the log cannot be moved")?;
    }
    match outcome.failures.first() {
        Some(failure) => bail!("{failure}"),
        None => Ok(()),
    }
}
