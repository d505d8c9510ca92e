//! `ringwing pause`, `step` and `resume`: let a live flight in lockstep stand still, go on by ticks, and fly on.
//!
//! Never holds the flight itself; the run's launcher does, and answers.

use crate::{launcher::PauseRequest, live_run};
use ringwing_bus::DomainId;
use std::{num::NonZeroU32, process::ExitCode};

/// Which run to pause or to resume.
#[derive(Debug, clap::Args)]
pub(crate) struct PauseArgs {
    /// Domain of the run, its folder, or `latest`
    #[arg(value_name = "RUN", value_parser = live_run::domain)]
    run: DomainId,
}

/// Which run to step, and how far.
#[derive(Debug, clap::Args)]
pub(crate) struct StepArgs {
    /// Domain of the run, its folder, or `latest`
    #[arg(value_name = "RUN", value_parser = live_run::domain)]
    run: DomainId,
    /// How many ticks to fly
    #[arg(value_name = "TICKS", default_value = "1")]
    ticks: NonZeroU32,
}

/// Lets the run stand still before its next tick, and prints that tick.
pub(crate) fn pause(args: &PauseArgs) -> anyhow::Result<ExitCode> {
    live_run::ask(&args.run, &PauseRequest::Pause.to_string())
}

/// Lets a paused run fly some ticks, and prints the tick that it has reached.
pub(crate) fn step(args: &StepArgs) -> anyhow::Result<ExitCode> {
    live_run::ask(&args.run, &PauseRequest::Step(args.ticks).to_string())
}

/// Lets a paused run fly on.
pub(crate) fn resume(args: &PauseArgs) -> anyhow::Result<ExitCode> {
    live_run::ask(&args.run, &PauseRequest::Resume.to_string())
}
