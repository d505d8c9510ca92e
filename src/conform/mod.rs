//! `ringwing conform`: says whether a user's controller is fit to fly, by a battery of short flights.
//!
//! Never judges a controller by anything but its flights: it starts the same processes as `run`.

mod checks;
mod findings;
mod report;

use crate::{
    VIOLATED, WrongUsage,
    launcher::{LaunchError, Outcome, Plan, launch},
    output::{print, tell},
    run::check_out,
    verify,
};
use anyhow::bail;
use checks::{CHECKS, Check, Demand};
use findings::Findings;
use report::{Grade, Latency, Report, Row};
use ringwing_bus::Placement;
use ringwing_recorder::log::reader::Reader;
use ringwing_scenario::{AgentSection, Scenario, start};
use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
    process::ExitCode,
};

/// The check whose flight tells how long decisions take: a plain one, long enough for a distribution.
const TIMED: &str = "ring";
/// The check without which no other is flown.
const GATE: &str = "answers";

/// Which controller to check.
#[derive(Debug, clap::Args)]
pub(crate) struct ConformArgs {
    /// The controller and its arguments, as you type them in a shell, such as "python3 mine.py"
    #[arg(required_unless_present = "built_in", conflicts_with = "built_in")]
    command: Option<String>,
    /// Check the built-in law instead, for comparison
    #[arg(long)]
    built_in: bool,
    /// Fly these checks only, such as "ring,killed"
    #[arg(long, value_name = "CHECKS", value_delimiter = ',', value_parser = CHECKS.map(|check| check.name))]
    only: Vec<String>,
    /// Folder in which each flight gets a folder of its own
    #[arg(long, value_name = "FOLDER", default_value = "conform")]
    out: PathBuf,
    /// Print the report as JSON, after the last flight
    #[arg(long)]
    json: bool,
}

impl ConformArgs {
    /// Whether `check` is to be flown.
    fn names(&self, check: &Check) -> bool {
        self.only.is_empty() || self.only.iter().any(|name| name == check.name)
    }
}

/// Flies the checks and prints the report; the exit code is 3 if the controller is not fit.
pub(crate) fn run(args: &ConformArgs) -> anyhow::Result<ExitCode> {
    check_out(&args.out)?;
    let controller = controller(args)?;
    let name = controller.as_ref().map_or_else(|| "the built-in law".into(), AgentSection::command_line);
    if !args.json {
        tell(&format!("{name}, flying all UAVs of each check; flights are in {}\n", args.out.display()));
    }
    let (rows, latency) = fly(args, controller.as_ref())?;
    let report = Report::new(name, rows, latency);
    print(&if args.json { report.to_json()? } else { report.end() });
    Ok(if report.is_fit() { ExitCode::SUCCESS } else { ExitCode::from(VIOLATED) })
}

/// The result of each check, and how long decisions take.
fn fly(args: &ConformArgs, controller: Option<&AgentSection>) -> anyhow::Result<(Vec<Row>, Option<Latency>)> {
    let (mut rows, mut latency, mut answers) = (Vec::new(), None, true);
    for check in CHECKS.iter().filter(|check| args.names(check)) {
        // A controller that does not even answer would fail each check, and each after a long wait.
        let row = if answers {
            let found = flown(check, controller, &args.out)?;
            let row = Row::flown(check, check.reasons(&found), found.folders);
            if check.name == TIMED {
                latency = Latency::of(found.compute_us);
            }
            answers = check.name != GATE || row.grade == Grade::Fit;
            row
        } else {
            Row::skipped(check)
        };
        if !args.json {
            print(&row.text());
        }
        rows.push(row);
    }
    Ok((rows, latency))
}

/// The program that flies all UAVs; `None` for the built-in law.
fn controller(args: &ConformArgs) -> Result<Option<AgentSection>, WrongUsage> {
    let Some(command) = &args.command else { return Ok(None) };
    // The same words as for `run --agent`, so that both read a command alike.
    AgentSection::parse(&format!("all={command}"))
        .map(Some)
        .map_err(|_| WrongUsage(format!("COMMAND {command:?}: expected a program and its arguments")))
}

/// Flies a check, twice if it compares two flights, and reads what it showed.
fn flown(check: &Check, controller: Option<&AgentSection>, out: &Path) -> anyhow::Result<Findings> {
    let scenario = check.scenario(controller)?;
    start::states(&scenario)?;
    let (first, mut found) = one_flight(&scenario, out)?;
    // A second flight of a controller that breaks would tell nothing.
    if check.demand == Demand::Repeats && found.failures.is_empty() {
        let (second, again) = one_flight(&scenario, out)?;
        found.failures.extend(again.failures);
        found.folders.extend(again.folders);
        let compared = verify::compare(Reader::open(&first)?, Reader::open(&second)?, false);
        found.difference = compared.err().map(|difference| told(&difference));
    }
    Ok(found)
}

/// How the second flight differs from the first.
fn told(difference: &verify::Difference) -> String {
    let uavs: Vec<String> = difference.uavs().iter().map(ToString::to_string).collect();
    format!(
        "the second flight differs from the log of the first: {difference}; decided otherwise: {}",
        uavs.join(", ")
    )
}

/// One flight: its folder, and what it showed.
fn one_flight(scenario: &Scenario, out: &Path) -> anyhow::Result<(PathBuf, Findings)> {
    let Outcome { folder, failures, .. } = launch(&plan(scenario.clone(), out)).map_err(refusal)?;
    let found = Findings::of(&folder, scenario)?;
    if found.is_interrupted {
        bail!("interrupted: the report would lack checks");
    }
    // What fails without a controller's fault says nothing about it.
    if let Some(failure) = failures.first().filter(|_| found.failures.is_empty()) {
        bail!("check {}: the flight failed: {failure}; its folder is {}", scenario.name, folder.display());
    }
    Ok((folder, found))
}

/// A program that cannot be started is a mistake in the command line, and no controller that is not fit.
fn refusal(error: LaunchError) -> anyhow::Error {
    match error {
        LaunchError::Program { .. } => WrongUsage(error.to_string()).into(),
        other => other.into(),
    }
}

fn plan(scenario: Scenario, out: &Path) -> Plan {
    Plan {
        scenario,
        out: out.to_owned(),
        record: true,
        timing: true,
        by_hand: BTreeSet::new(),
        quiet: true,
        recorder: true,
        measure: None,
        placement: Placement::default(),
        lock_memory: false,
        live: None,
    }
}

#[cfg(test)]
mod tests;
