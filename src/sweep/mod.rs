//! `ringwing sweep`: flies a scenario at many values of some axes, and keeps a row for each flight.
//!
//! Never flies anything itself: the crate `ringwing_study` flies in the simulation, and `processes` starts real runs.

mod compare;
mod definition;
mod files;
mod list;
mod merge;
mod processes;
mod progress;

use crate::{FAILED, WrongUsage, config, output, output::tell};
pub(crate) use definition::SweepArgs;
pub(crate) use files::build;
use progress::Progress;
use ringwing_bus::StopFlag;
use ringwing_scenario::Scenario;
use ringwing_study::{
    Outcome,
    files::{ResultsError, refuse_if_in_use},
    fly, fly_beside_baseline,
    sweep::{
        Columns, Crew, DEFINITION, Definition, FlightId, Ledger, Manifest, Row, RowFile, Shard, Tally, check,
        flight_of, flights_file, run as fly_all,
    },
};
use std::{fs, path::Path, process::ExitCode};

/// Most flights that a sweep flies without being asked to. A million take about ten hours on two cores; more are likely a
/// mistake.
const FLIGHTS_UNASKED: u64 = 1_000_000;

/// What else to do with sweeps.
#[derive(Debug, clap::Subcommand)]
pub(crate) enum SweepVerb {
    /// List the built-in sweeps
    List,
    /// Show which cells of two sweeps differ by more than chance
    Compare(compare::CompareArgs),
    /// Join the shards of a sweep, and say what is missing
    Merge(merge::MergeArgs),
}

/// Flies a sweep, or does something else with sweeps.
pub(crate) fn run(args: &SweepArgs) -> anyhow::Result<ExitCode> {
    match &args.verb {
        Some(SweepVerb::List) => Ok(list::run()),
        Some(SweepVerb::Compare(args)) => compare::run(args),
        Some(SweepVerb::Merge(args)) => merge::run(args),
        None => fly_sweep(args),
    }
}

fn fly_sweep(args: &SweepArgs) -> anyhow::Result<ExitCode> {
    let stop = StopFlag::on_signals()?;
    let sweep = args.definition()?;
    let shard = args.shard()?;
    // Check the size first: reading the cells of a sweep that is far too large would take hours.
    check_size(&sweep, args.yes)?;
    let jobs = config::jobs(args.jobs);
    check_cells(&sweep, jobs, !args.processes, &stop)?;
    let folder = args.out.clone().unwrap_or_else(|| Path::new("sweeps").join(&sweep.name));
    let manifest = prepare(&folder, &sweep, args)?;
    let path = folder.join(flights_file(shard));
    let mut ledger = Ledger::new(cells(&sweep), &sweep.seeds, shard);
    let mut before = Tally::default();
    let rows = RowFile::open(&path, Columns::of(&sweep), |row| note(&mut ledger, &mut before, row, &sweep))?;
    let progress = Progress::new(&sweep, shard, before, args.json);
    let stops = || stop.is_set();
    let show = |tally| progress.show(tally);
    // Two calls, because a crew is generic over what flies, so the two crews have different types.
    let (rows, tally) = if args.processes {
        let crew = Crew { jobs, fly: |scenario: &Scenario| processes::fly(scenario, args.baseline), stops };
        fly_all(&sweep, ledger, rows, &crew, show)?
    } else {
        let crew = Crew { jobs, fly: |scenario: &Scenario| simulate(scenario, args.baseline), stops };
        fly_all(&sweep, ledger, rows, &crew, show)?
    };
    progress.finish();
    let landed = rows.rows();
    rows.sort()?;
    let is_whole = !stop.is_set();
    if is_whole {
        files::write(&folder, &manifest, shard, args)?;
    } else {
        output::warning(&format!(
            "interrupted after {} flights ({landed} in all); the same command goes on from here: {}",
            tally.flown,
            path.display()
        ));
    }
    Ok(if is_whole { ExitCode::SUCCESS } else { ExitCode::from(FAILED) })
}

fn simulate(scenario: &Scenario, with_baseline: bool) -> Result<Outcome, String> {
    let flown = if with_baseline { fly_beside_baseline(scenario) } else { fly(scenario) };
    flown.map_err(|error| error.to_string())
}

fn cells(sweep: &Definition) -> u64 {
    // `check_size` has refused a sweep whose number of cells is too large to count.
    sweep.cells().unwrap_or(u64::MAX)
}

/// Refuses a sweep that nobody can want, and one that is large unless the user has said `yes`.
fn check_size(sweep: &Definition, yes: bool) -> Result<(), WrongUsage> {
    let place = &sweep.name;
    let Some((cells, flights)) = sweep.cells().zip(sweep.flights()) else {
        return Err(WrongUsage(format!(
            "sweep {place}: more flights than can be counted: give fewer values or seeds"
        )));
    };
    if flights > FLIGHTS_UNASKED && !yes {
        return Err(WrongUsage(format!(
            "sweep {place}: {cells} cells and up to {flights} flights; add --yes if that is what you want, or give fewer \
             values or seeds"
        )));
    }
    Ok(())
}

/// Reads every cell's scenario before the first flight.
fn check_cells(sweep: &Definition, jobs: usize, is_simulated: bool, stop: &StopFlag) -> anyhow::Result<()> {
    let problems = check(sweep, jobs, is_simulated, || stop.is_set());
    if problems.is_empty() {
        return Ok(());
    }
    Err(WrongUsage(problems.join("\n")).into())
}

/// Makes the folder with its manifest, or makes sure that it holds an earlier part of the same sweep.
fn prepare(folder: &Path, sweep: &Definition, args: &SweepArgs) -> anyhow::Result<Manifest> {
    let manifest = Manifest {
        sweep: sweep.clone(),
        version: env!("CARGO_PKG_VERSION").into(),
        build: files::build(&sweep.cell(0)?)?,
        by_processes: args.processes,
        has_baseline: args.baseline,
    };
    if args.fresh {
        remove_results(folder)?;
    }
    if let Some(before) = Manifest::read(folder)? {
        check_same(folder, &manifest, &before)?;
    }
    let error = |source| ResultsError::File { path: folder.to_owned(), what: "made", source };
    fs::create_dir_all(folder).map_err(error)?;
    // Write it again even if it is there: a sweep may go on with more seeds than before.
    manifest.write(folder)?;
    Ok(manifest)
}

fn check_same(folder: &Path, manifest: &Manifest, before: &Manifest) -> Result<(), WrongUsage> {
    let what = if !manifest.sweep.continues(&before.sweep) {
        "another sweep, or of more seeds than are asked for now"
    } else if manifest.build != before.build {
        "the same sweep flown by another build of ringwing, or of a program that flies UAVs"
    } else if manifest.by_processes != before.by_processes {
        "the same sweep, one of them with --processes"
    } else if manifest.has_baseline != before.has_baseline {
        "the same sweep, one of them with --baseline"
    } else {
        return Ok(());
    };
    Err(WrongUsage(format!(
        "{}: holds the results of {what}: choose another folder with --out, or begin anew with --fresh",
        folder.display()
    )))
}

/// Removes what earlier sweeps have written into `folder`, and nothing else.
fn remove_results(folder: &Path) -> anyhow::Result<()> {
    // In a folder that is not a sweep's, files of these names are somebody else's.
    if !folder.join(DEFINITION).exists() {
        return Ok(());
    }
    let error = |source| ResultsError::File { path: folder.to_owned(), what: "read", source };
    let entries = fs::read_dir(folder).map_err(error)?;
    let mut paths: Vec<_> = entries.filter_map(|entry| Some(entry.ok()?.path())).collect();
    paths.retain(|path| is_result(path));
    for path in paths.iter().filter(|path| path.extension().is_some_and(|ending| ending == "csv")) {
        refuse_if_in_use(path)?;
    }
    // The manifest goes last: as long as it is there, a removal that was cut short can be done again.
    paths.sort_by_key(|path| path.ends_with(DEFINITION));
    for path in paths {
        fs::remove_file(&path).map_err(|source| ResultsError::File { path, what: "removed", source })?;
    }
    Ok(())
}

fn is_result(path: &Path) -> bool {
    let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
    let is_numbered = |before: &str, after: &str| {
        name.strip_prefix(before).is_some_and(|rest| rest.strip_suffix(after).is_some())
    };
    [DEFINITION, "cells.csv", "index.html", "flights.csv", "flights.parquet"].contains(&name)
        || is_numbered("flights.", ".csv")
        || is_numbered("map-", ".svg")
}

/// Notes a flight that an earlier part of the sweep has flown.
fn note(ledger: &mut Ledger, before: &mut Tally, row: &Row, sweep: &Definition) {
    let flight: Option<FlightId> = flight_of(row, sweep);
    if flight.is_some_and(|flight| ledger.note_flown(flight, row.passed())) {
        before.flown += 1;
        before.not_passed += u64::from(!row.passed());
    }
}

/// Prints where results are.
fn tell_place(what: &str, path: &Path) {
    tell(&format!("  {what:<10} {}", path.display()));
}

/// The number of flights that `shard` has at most.
fn flights_of(sweep: &Definition, shard: Shard) -> u64 {
    // With a precision, a shard has whole cells, because the flights of a cell decide how many more it needs.
    let all =
        if sweep.seeds.precision.is_some() { cells(sweep) } else { sweep.flights().unwrap_or(u64::MAX) };
    let mine = all / shard.count + u64::from(all % shard.count >= shard.number);
    if sweep.seeds.precision.is_some() { mine.saturating_mul(sweep.seeds.max) } else { mine }
}
