//! `ringwing replay`: shows a log in Foxglove as if the flight went on now.
//!
//! Never serves anything itself; the crate `ringwing_viewer` does.

use crate::{config, output};
use ringwing_recorder::log::run_folder::LOG_HELP;
use ringwing_viewer::{LiveAddress, PlaybackOptions, serve_log};
use std::{path::PathBuf, process::ExitCode};

/// Which log to show, and how.
#[derive(Debug, clap::Args)]
pub(crate) struct ReplayArgs {
    #[arg(help = LOG_HELP)]
    log: PathBuf,
    /// Where to listen: on this machine only, unless you name an address
    #[arg(long, value_name = "ADDRESS", num_args = 0..=1, require_equals = true)]
    #[arg(default_value = "127.0.0.1", default_missing_value = "127.0.0.1")]
    live: LiveAddress,
    /// How many times as fast as the flight
    #[arg(long, value_name = "FACTOR", default_value = "1", value_parser = speed)]
    speed: f64,
}

fn speed(text: &str) -> Result<f64, String> {
    let speed = text.parse().ok().filter(|speed| (0.01..=1000.0).contains(speed));
    speed.ok_or_else(|| "expected a number from 0.01 to 1000".into())
}

/// Serves the log until the user ends it.
pub(crate) fn run(args: &ReplayArgs) -> anyhow::Result<ExitCode> {
    args.live.warning().iter().for_each(|warning| output::warning(warning));
    let options = PlaybackOptions { address: args.live, speed: args.speed };
    serve_log(&config::log(&args.log), &options, |url| output::tell(&format!("{url}\nCtrl-C ends it")))?;
    Ok(ExitCode::SUCCESS)
}
