//! `ringwing recover`: rebuilds a damaged log and says what was lost.

use crate::tell;
use ringwing_recorder::log::recover::{Recovery, recover};
use std::{
    path::{Path, PathBuf},
    process::ExitCode,
};

/// In a second.
const NANOSECONDS: f64 = 1e9;

/// Which log to rebuild, and where.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// The log that was cut or damaged; it is left as it is
    log: PathBuf,
    /// The file to make; by default the log's name with `-recovered`, beside it
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

/// Rebuilds the log.
pub(crate) fn run(args: &Args) -> anyhow::Result<ExitCode> {
    let out = args.out.clone().unwrap_or_else(|| beside(&args.log));
    let recovery = recover(&args.log, &out)?;
    tell(&format!("{}: {}", out.display(), kept(&recovery)));
    for loss in losses(&recovery) {
        tell(&format!("  lost: {loss}"));
    }
    Ok(ExitCode::SUCCESS)
}

/// `run.mcap` becomes `run-recovered.mcap`.
fn beside(log: &Path) -> PathBuf {
    let name = log.file_stem().unwrap_or_default().to_string_lossy();
    log.with_file_name(format!("{name}-recovered.mcap"))
}

fn kept(recovery: &Recovery) -> String {
    let seconds = |(first, last): (u64, u64)| (last - first) as f64 / NANOSECONDS;
    let span = recovery.span.map_or_else(String::new, |span| format!(" over {:.2} s", seconds(span)));
    let (messages, attachments) = (recovery.messages, recovery.attachments.len());
    let (plural, metadata) = (if attachments == 1 { "" } else { "s" }, recovery.metadata.len());
    format!(
        "{messages} messages{span}, {attachments} attachment{plural}, {metadata} metadata, and a new index"
    )
}

/// What is gone, each in a few words.
fn losses(recovery: &Recovery) -> Vec<String> {
    let mut losses: Vec<String> = Vec::new();
    for damage in &recovery.damages.told {
        losses.push(format!("{} bytes at byte {}: {}", damage.bytes, damage.offset, damage.what));
    }
    let untold = recovery.damages.count - recovery.damages.told.len() as u64;
    if untold > 0 {
        losses.push(format!("and {untold} damages more, {} bytes in all", recovery.damages.bytes));
    }
    if recovery.unnamed > 0 {
        losses.push(format!("{} messages whose topic is no longer described", recovery.unnamed));
    }
    if !recovery.has_scenario() {
        losses.push("the attachment `scenario.toml`, without which the flight cannot be measured".into());
    }
    if !recovery.has_result() {
        losses.push("whatever came after this: the log has no result, so its recorder did not finish".into());
    }
    if losses.is_empty() {
        losses.push("nothing".into());
    }
    losses
}
