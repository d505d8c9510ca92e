//! `ringwing conform`: says whether a user's controller is fit to fly, by a battery of short flights.
//!
//! Never judges a controller by anything but its flights: it starts the same processes as `run`.

mod checks;
mod findings;
mod report;

use crate::{
    VIOLATED, WrongUsage,
    output::{print, tell},
    own_run::{self, OwnRunError},
    run::check_out,
    verify,
};
use anyhow::bail;
use checks::{CHECKS, Check, Demand};
use findings::Findings;
use report::{Grade, Report, Row};
use ringwing_bus::StopFlag;
use ringwing_flight::Latency;
use ringwing_recorder::log::reader::Reader;
use ringwing_scenario::{AgentSection, Scenario};
use serde::Deserialize;
use std::{
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
    let name = args.command.clone().unwrap_or_else(|| "the built-in law".into());
    if !args.json {
        tell(&format!("{name}, flying all UAVs of each check; flights are in {}\n", args.out.display()));
    }
    let (rows, latency) = fly(args, controller.as_deref())?;
    let report = Report::new(name, rows, latency);
    print(&if args.json { report.to_json()? } else { report.end() });
    Ok(if report.is_fit() { ExitCode::SUCCESS } else { ExitCode::from(VIOLATED) })
}

/// The result of each check, and how long decisions take.
fn fly(args: &ConformArgs, controller: Option<&str>) -> anyhow::Result<(Vec<Row>, Option<Latency>)> {
    let stop = StopFlag::on_signals()?;
    let (mut rows, mut latency, mut answers) = (Vec::new(), None, true);
    for check in CHECKS.iter().filter(|check| args.names(check)) {
        // A controller that does not even answer would fail each check, and each after a long wait.
        let row = if answers {
            let found = flown(check, controller, &args.out)?;
            if stop.is_set() || found.is_interrupted {
                bail!("interrupted: the report would lack checks");
            }
            let row = Row::flown(check, check.reasons(&found), found.folders);
            if check.name == TIMED {
                latency = found.compute.latency();
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

/// What `run --agent` says about the program that flies all UAVs; `None` for the built-in law.
fn controller(args: &ConformArgs) -> Result<Option<String>, WrongUsage> {
    let Some(command) = &args.command else { return Ok(None) };
    let agent = format!("all={command}");
    // Check the words here: an error of `run` would name a flag that the user has not written.
    AgentSection::parse(&agent)
        .map_err(|_| WrongUsage(format!("COMMAND {command:?}: expected a program and its arguments")))?;
    Ok(Some(agent))
}

/// Flies a check, twice if it compares two flights, and reads what it showed.
fn flown(check: &Check, controller: Option<&str>, out: &Path) -> anyhow::Result<Findings> {
    let scenario = check.scenario()?;
    let (first, mut found) = one_flight(&scenario, controller, out)?;
    // A second flight of a controller that breaks would tell nothing.
    if check.demand == Demand::Repeats && found.failures.is_empty() {
        let (second, again) = one_flight(&scenario, controller, out)?;
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

/// What a check takes from the summary of a run.
#[derive(Deserialize)]
struct Run {
    failures: Vec<String>,
    log: Option<PathBuf>,
}

/// One flight: its folder, and what it showed.
fn one_flight(
    scenario: &Scenario,
    controller: Option<&str>,
    out: &Path,
) -> anyhow::Result<(PathBuf, Findings)> {
    let Run { failures, log } = run_apart(scenario, controller, out)?;
    let Some(folder) = log.as_deref().and_then(Path::parent) else {
        bail!("check {}: the flight has no log", scenario.name)
    };
    let found = Findings::of(folder, scenario)?;
    // What fails without a controller's fault says nothing about it.
    if let Some(failure) = failures.first().filter(|_| found.failures.is_empty() && !found.is_interrupted) {
        bail!("check {}: the flight failed: {failure}; its folder is {}", scenario.name, folder.display());
    }
    Ok((folder.to_owned(), found))
}

/// Flies with `controller`, and reads the summary.
fn run_apart(scenario: &Scenario, controller: Option<&str>, out: &Path) -> anyhow::Result<Run> {
    // On the command line, relative paths of a controller count from the user's working folder.
    let flags: Vec<&str> = controller.iter().flat_map(|agent| ["--agent", agent]).collect();
    own_run::fly(scenario, &flags, Some(out)).map_err(|error| match error {
        // Nothing was flown, for instance because there is no such program.
        OwnRunError::NoSummary(why) => WrongUsage(why).into(),
        error @ OwnRunError::NotStarted(_) => error.into(),
    })
}

#[cfg(test)]
mod tests;
