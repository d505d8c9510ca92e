//! `ringwing recover`: rebuilds a damaged log and says what was lost.
//!
//! Never changes the damaged log, and never overwrites a file.

use crate::{FAILED, WrongUsage, config, output::tell};
use ringwing_recorder::log::{
    reader::{STANDARD_INPUT, locate},
    recover::{RecoveredLog, recover},
};
use std::{
    path::{Path, PathBuf},
    process::ExitCode,
};

/// Nanoseconds in a second.
const NANOSECONDS: f64 = 1e9;

/// Which log to rebuild, and where.
#[derive(Debug, clap::Args)]
pub(crate) struct RecoverArgs {
    /// Log that was cut or damaged: a run's folder, the .mcap file in it, `latest`, or `-`; it is not changed
    log: PathBuf,
    /// File to create [default: the log's name with `-recovered`, in the same folder]
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

/// Rebuilds the log and prints what was kept and what was lost; the exit code is 1 if anything was lost.
pub(crate) fn run(args: &RecoverArgs) -> anyhow::Result<ExitCode> {
    let log = locate(&config::log(&args.log))?;
    let out = args.out.clone().map_or_else(|| default_output(&log), Ok)?;
    let recovered = recover(&log, &out)?;
    tell(&format!("{}: {}", out.display(), kept(&recovered)));
    for loss in losses(&recovered) {
        tell(&format!("  lost: {loss}"));
    }
    Ok(if recovered.is_whole() { ExitCode::SUCCESS } else { ExitCode::from(FAILED) })
}

/// `ring-recovered.mcap` for `ring.mcap` and `ring.mcap.zst`.
fn default_output(log: &Path) -> Result<PathBuf, WrongUsage> {
    if log == Path::new(STANDARD_INPUT) {
        return Err(WrongUsage("recover -: name the file to create with --out".into()));
    }
    let name = log.file_name().unwrap_or_default().to_string_lossy();
    let name = name.strip_suffix(".zst").unwrap_or(&name);
    let name = name.strip_suffix(".mcap").unwrap_or(name);
    Ok(log.with_file_name(format!("{name}-recovered.mcap")))
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
        losses.push(
            "the result and whatever came before it: the log's recorder did not finish, or its end is lost"
                .into(),
        );
    }
    if losses.is_empty() {
        losses.push("nothing".into());
    }
    losses
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_recovered_log_lies_beside_the_damaged_one() {
        for name in ["paper-4.2-hr85rx.mcap", "paper-4.2-hr85rx.mcap.zst", "paper-4.2-hr85rx"] {
            let expected = Path::new("runs/paper-4.2-hr85rx-recovered.mcap");
            assert_eq!(default_output(&Path::new("runs").join(name)).unwrap(), expected);
        }
        assert!(default_output(Path::new("-")).unwrap_err().to_string().contains("--out"));
    }
}
