//! `ringwing exec`: becomes a program of the user's, which then ends with its launcher.
//!
//! Never waits for the program: it takes the place of this process.

use anyhow::{Context, anyhow};
use ringwing_bus::die_with;
use std::{
    env,
    os::unix::process::CommandExt,
    path::PathBuf,
    process::{Command, ExitCode},
};

/// A command that ends with its launcher.
#[derive(Debug, Clone, clap::Args)]
pub(crate) struct ExecArgs {
    /// Process id of the launcher; the command is killed when it ends.
    #[arg(long)]
    launcher: u32,
    /// The folder in which the command starts; by default that of the launcher.
    #[arg(long)]
    folder: Option<PathBuf>,
    /// The program and its arguments.
    #[arg(last = true, required = true)]
    command: Vec<String>,
}

/// Becomes the command of `args`; returns only if that fails.
pub(crate) fn run(args: &ExecArgs) -> anyhow::Result<ExitCode> {
    // The program itself may not know how to end with its launcher. What this process arranges outlives `exec`.
    die_with(args.launcher)?;
    let (program, arguments) = args.command.split_first().context("no command")?;
    // Change this process's folder, and not that of the command alone: a relative program counts from it, too.
    if let Some(folder) = &args.folder {
        env::set_current_dir(folder)
            .map_err(|error| anyhow!("{}: cannot be entered: {error}", folder.display()))?;
    }
    Err(anyhow!("{program}: cannot be started: {}", Command::new(program).args(arguments).exec()))
}
