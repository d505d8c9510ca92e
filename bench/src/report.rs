//! The verb `ringwing bench` itself: checks the options, measures, and reports.
//!
//! Must never start anything before all options are checked. Must never print: the command prints the report.

use crate::{
    args::{BenchArgs, BenchVerb},
    axes::Axes,
    case::{Carrier, Case},
    charts, compare, doctor,
    error::BenchError,
    histogram_files, machine, page,
    result::{FORMAT, Machine, RESULTS_FILE, Results},
    runner::Runner,
    table,
};
use ringwing_bus::write_whole;
use std::{fs, path::Path, time::SystemTime};

/// Name of the page beside the results.
const PAGE: &str = "index.html";
/// Name of the folder with the pictures for papers beside the results.
const CHARTS: &str = "charts";
/// Name of the folder with the histograms beside the results.
const HISTOGRAMS: &str = "histograms";

/// The output of a benchmark.
#[derive(Debug)]
pub struct Report {
    /// The text to print, or the JSON.
    pub text: String,
    /// Whether everything that was asked for was measured.
    pub is_complete: bool,
    /// Why the results could not be written to the user's folder, if they could not.
    pub unwritten: Option<BenchError>,
}

impl Report {
    fn complete(text: String) -> Self {
        Self { text, is_complete: true, unwritten: None }
    }
}

/// Measures what `args` ask for, and writes the results to the user's folder, if there is one.
pub fn run(args: &BenchArgs) -> Result<Report, BenchError> {
    if let Some(BenchVerb::Compare(results)) = &args.verb {
        return compare::run(results).map(Report::complete);
    }
    if args.doctor {
        return Ok(Report::complete(machine::render(&doctor::inspect())));
    }
    let axes = check(args)?;
    let results = measure(args, &axes)?;
    let is_complete = !results.interrupted && results.cases.iter().all(|case| case.failure.is_none());
    let json = json(&results);
    // What took hours to measure is printed even if the disk is full by now.
    let written = args.out.as_deref().map(|out| write(out, &json, &results));
    let place = args.out.as_deref().filter(|_| matches!(written, Some(Ok(()))));
    let text = if args.json { json } else { text(&results, place) };
    Ok(Report { text, is_complete, unwritten: written.and_then(Result::err) })
}

fn json(results: &Results) -> String {
    serde_json::to_string(results).expect("results are plain data")
}

/// Refuses every mistake that can be found before anything starts.
fn check(args: &BenchArgs) -> Result<Axes, BenchError> {
    let axes = args.axes()?;
    args.placement.placement().check()?;
    for case in axes.cases().iter().filter(|case| case.carrier == Carrier::Swarm) {
        case.scenario(args.seed)?;
    }
    // Last, because it is the only check that leaves something behind.
    args.out.as_deref().map_or(Ok(()), create_folder)?;
    Ok(axes)
}

fn create_folder(out: &Path) -> Result<(), BenchError> {
    // Check before measuring for hours, so that the results do not replace others or end up without a place.
    if out.join(RESULTS_FILE).exists() {
        let text = format!("--out {}: already holds results; choose another folder", out.display());
        return Err(BenchError::Usage(text));
    }
    fs::create_dir_all(out).map_err(|why| {
        BenchError::Usage(format!("--out {}: {why}; choose a folder that can be written", out.display()))
    })
}

fn measure(args: &BenchArgs, axes: &Axes) -> Result<Results, BenchError> {
    // Look at the machine before the benchmark itself makes it busy.
    let machine = inspect(axes);
    let began = humantime::format_rfc3339_seconds(SystemTime::now()).to_string();
    let logs = args.out.as_deref().filter(|_| args.mcap);
    let runner = Runner::new(axes, &args.placement, args.seed, logs)?;
    let cases = runner.run(args.json);
    Ok(Results {
        format: FORMAT.into(),
        ringwing: env!("CARGO_PKG_VERSION").into(),
        began,
        command: std::env::args().collect::<Vec<_>>().join(" "),
        seed: args.seed,
        seed_text: args.seed.to_string(),
        machine,
        interrupted: runner.is_interrupted(),
        cases,
    })
}

fn inspect(axes: &Axes) -> Machine {
    let mut machine = doctor::inspect();
    let most_processes = axes.cases().iter().map(Case::processes).max();
    machine.warnings.extend(most_processes.and_then(doctor::crowded));
    machine
}

/// The table, and where the files are that were `written`.
fn text(results: &Results, written: Option<&Path>) -> String {
    let files = written
        .map(|out| {
            format!("\n\nresults  {}: {RESULTS_FILE}, {PAGE}, {CHARTS}/, {HISTOGRAMS}/", out.display())
        })
        .unwrap_or_default();
    table::render(results).trim_end().to_owned() + &files
}

fn write(out: &Path, json: &str, results: &Results) -> Result<(), BenchError> {
    let failed = || BenchError::file(out, "written");
    // The results come first: whatever fails later can be drawn from them again.
    write_whole(&out.join(RESULTS_FILE), json).map_err(failed())?;
    let pictures = charts::all(results)?;
    let folder = out.join(CHARTS);
    fs::create_dir_all(&folder).map_err(failed())?;
    for picture in &pictures {
        let svg = picture.svg()?;
        write_whole(&folder.join(picture.name()).with_extension("svg"), svg.as_bytes()).map_err(failed())?;
    }
    write_whole(&out.join(PAGE), page::render(results, &pictures, CHARTS)).map_err(failed())?;
    histogram_files::write(&out.join(HISTOGRAMS), results).map_err(failed())
}
