//! `ringwing verify`: flies a log's scenario again and compares every message that chance has no part in.
//!
//! Never touches the log; the second flight has a temporary folder of its own.

mod difference;

use crate::{
    VIOLATED,
    launcher::{Plan, launch},
    tell,
};
use anyhow::bail;
use difference::Difference;
use ringwing_bus::Placement;
use ringwing_recorder::reader::{Message, Reader};
use ringwing_scenario::Scenario;
use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
    process::ExitCode,
};

/// Wall-clock times differ from run to run.
const TIMING: &str = "/timing";
/// What happens to processes by chance: a flight in which it did is not repeatable.
const BY_CHANCE: [&str; 7] = [
    "process.lost",
    "process.frozen",
    "process.thawed",
    "process.overdue",
    "process.late",
    "run.interrupted",
    // Of the scenario's own faults nobody asks while the run goes on.
    "fault.requested",
];

/// Which log to verify.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// The log of a lockstep run: its `run.mcap`
    log: PathBuf,
}

/// Flies again and compares.
pub(crate) fn run(args: &Args) -> anyhow::Result<ExitCode> {
    let scenario = repeatable(&args.log)?;
    let folder = tempfile::tempdir()?;
    let plan = Plan {
        scenario,
        out: folder.path().to_owned(),
        record: true,
        timing: false,
        by_hand: BTreeSet::new(),
        quiet: true,
        recorder: true,
        measure: None,
        placement: Placement::default(),
    };
    let outcome = launch(&plan)?;
    if let Some(failure) = outcome.failures.first() {
        bail!("the flight cannot be repeated here: {failure}");
    }
    let result = compare(&args.log, &outcome.folder.join("run.mcap"))?;
    Ok(report(&args.log, result))
}

fn report(log: &Path, result: Result<u64, Difference>) -> ExitCode {
    match result {
        Ok(count) => {
            tell(&format!("{}: repeated to the bit, {count} messages compared", log.display()));
            ExitCode::SUCCESS
        }
        Err(difference) => {
            tell(&format!("{}: differs from the flight of this build: {difference}", log.display()));
            ExitCode::from(VIOLATED)
        }
    }
}

/// The scenario of a log that the same build must be able to repeat.
fn repeatable(log: &Path) -> anyhow::Result<Scenario> {
    let mut reader = Reader::open(log)?;
    let scenario = reader.scenario()?;
    let not = format!("log {}: is not repeatable", log.display());
    if scenario.time.real_time {
        bail!("{not}: it is of a real-time run, whose flight depends on the wall clock; fly it in lockstep");
    }
    for tick in reader.ticks(scenario.formation.uavs) {
        if let Some(line) = tick.lines.iter().find(|line| BY_CHANCE.contains(&line.name.as_str())) {
            bail!("{not}: at tick {} this happened by chance: {}", tick.frame.tick, line.message);
        }
    }
    if let Some(damage) = reader.damages().told.first() {
        bail!("{not}: it is damaged at byte {}: {}", damage.offset, damage.what);
    }
    if reader.result().is_none_or(|result| result.get("verdict").is_none_or(|verdict| verdict == "failed")) {
        bail!("{not}: its flight did not come to its end");
    }
    Ok(scenario)
}

/// How many messages are equal in both logs, or the first that is not.
fn compare(log: &Path, again: &Path) -> anyhow::Result<Result<u64, Difference>> {
    let messages = |path: &Path| Reader::open(path).map(|reader| reader.filter(is_compared));
    let (mut recorded, mut flown) = (messages(log)?, messages(again)?);
    let mut count = 0;
    loop {
        match (recorded.next(), flown.next()) {
            (None, None) => return Ok(Ok(count)),
            (Some(one), Some(other)) if is_same(&one, &other) => count += 1,
            (one, other) => return Ok(Err(Difference::between(one.as_ref(), other.as_ref()))),
        }
    }
}

fn is_compared(message: &Message) -> bool {
    message.channel.topic != TIMING
}

fn is_same(one: &Message, other: &Message) -> bool {
    one.channel.topic == other.channel.topic && one.sequence == other.sequence && one.data == other.data
}
