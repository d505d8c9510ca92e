//! `ringwing recover`: rebuilds a damaged log and says what was lost.
//!
//! Never changes the damaged log, and never overwrites a file.

use crate::tell;
use ringwing_recorder::log::recover::{RecoveredLog, recover};
use std::{
    path::{Path, PathBuf},
    process::ExitCode,
};

/// Nanoseconds in a second.
const NANOSECONDS: f64 = 1e9;

/// Which log to rebuild, and where.
#[derive(Debug, clap::Args)]
pub(crate) struct RecoverArgs {
    /// Log that was cut or damaged; it is not changed
    log: PathBuf,
    /// File to create [default: the log's name with `-recovered`, in the same folder]
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

/// Rebuilds the log and prints what was kept and what was lost.
pub(crate) fn run(args: &RecoverArgs) -> anyhow::Result<ExitCode> {
    let out = args.out.clone().unwrap_or_else(|| default_output(&args.log));
    let recovered = recover(&args.log, &out)?;
    tell(&format!("{}: {}", out.display(), kept(&recovered)));
    for loss in losses(&recovered) {
        tell(&format!("  lost: {loss}"));
    }
    Ok(ExitCode::SUCCESS)
}

/// `run-recovered.mcap` for `run.mcap`.
fn default_output(log: &Path) -> PathBuf {
    let name = log.file_stem().unwrap_or_default().to_string_lossy();
    log.with_file_name(format!("{name}-recovered.mcap"))
}

/// What was kept, in one sentence.
fn kept(recovered: &RecoveredLog) -> String {
    let seconds = |(first, last): (u64, u64)| (last - first) as f64 / NANOSECONDS;
    let span = recovered.span.map_or_else(String::new, |span| format!(" over {:.2} s", seconds(span)));
    let (messages, attachments) = (recovered.messages, recovered.attachments.len());
    let (plural, metadata) = (if attachments == 1 { "" } else { "s" }, recovered.metadata.len());
    format!(
        "{messages} messages{span}, {attachments} attachment{plural}, {metadata} metadata, and a new index"
    )
}

/// Everything that was lost, one line for each.
fn losses(recovered: &RecoveredLog) -> Vec<String> {
    let mut losses: Vec<String> = Vec::new();
    for damage in &recovered.damages.listed {
        losses.push(format!("{} bytes at byte {}: {}", damage.bytes, damage.offset, damage.problem));
    }
    // All damages are counted, but only the first ones are listed.
    let unlisted = recovered.damages.count - recovered.damages.listed.len() as u64;
    if unlisted > 0 {
        losses.push(format!("and {unlisted} more damaged parts, {} bytes in all", recovered.damages.bytes));
    }
    if recovered.unnamed > 0 {
        losses.push(format!(
            "{} messages whose topic is unknown, because the record that names it is lost",
            recovered.unnamed
        ));
    }
    if !recovered.has_scenario() {
        losses.push("the attachment `scenario.toml`, without which the flight cannot be measured".into());
    }
    if !recovered.has_result() {
        losses.push("everything after this: the log has no result, so its recorder did not finish".into());
    }
    if losses.is_empty() {
        losses.push("nothing".into());
    }
    losses
}
