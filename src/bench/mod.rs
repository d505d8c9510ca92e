//! `ringwing bench`: how long a control tick takes across processes, where the time goes, and what else it could have cost.
//!
//! [`args`] is what to measure, [`plan`] in which order, [`runner`] does it, each [`case`] in a process of its own: the swarm
//! itself, or a [`transport`] in its place. [`hops`] makes latencies of their stamps, and [`result`] is what there is to show:
//! as a [`table`], a [`page`], [`histogram_files`], or beside another ([`compare`]). [`doctor`] looks at the machine.
//!
//! Never filters a sample.

mod args;
pub(crate) mod case;
mod charts;
mod compare;
mod doctor;
#[cfg(test)]
mod example;
mod figure;
mod histogram_files;
mod hops;
mod label;
mod page;
mod plan;
mod result;
mod runner;
mod samples;
pub(crate) mod scratch;
mod statistics;
mod table;
pub(crate) mod transport;

pub(crate) use args::Args;

use crate::{FAILED, WrongUsage, tell};
use anyhow::Context;
use args::{Axes, Verb};
use result::{FORMAT, Machine, Results, Subject};
use runner::Runner;
use std::{fs, path::Path, process::ExitCode, time::SystemTime};

/// Name of the results in their folder.
const RESULTS: &str = "results.json";
/// Name of the page beside them.
const PAGE: &str = "index.html";
/// Name of the folder with the histograms beside them.
const HISTOGRAMS: &str = "histograms";

/// Measures, and says what came of it; the exit code says whether all was measured.
pub(crate) fn run(args: &Args) -> anyhow::Result<ExitCode> {
    if let Some(Verb::Compare(results)) = &args.verb {
        return compare::run(results);
    }
    if args.doctor {
        tell(doctor::render(&doctor::inspect()).trim_end());
        return Ok(ExitCode::SUCCESS);
    }
    let axes = check(args)?;
    let (machine, began) = (machine(&axes), began());
    let runner = Runner::new(&axes, &args.placement, args.seed, args.out.as_deref().filter(|_| args.mcap))?;
    let cases = runner.run(args.json);
    let results = Results {
        format: FORMAT.into(),
        ringwing: env!("CARGO_PKG_VERSION").into(),
        began,
        command: std::env::args().collect::<Vec<_>>().join(" "),
        seed: args.seed,
        machine,
        interrupted: runner.is_interrupted(),
        cases,
    };
    show(args, &results)?;
    let whole = !results.interrupted && results.cases.iter().all(|case| case.failure.is_none());
    Ok(if whole { ExitCode::SUCCESS } else { ExitCode::from(FAILED) })
}

/// What this is measured on, as it is before anything is measured.
fn machine(axes: &Axes) -> Machine {
    let mut machine = doctor::inspect();
    let most = axes.cases().iter().map(|case| case.uavs + 1).max();
    machine.warnings.extend(most.and_then(doctor::crowded));
    machine
}

/// All that can be known to be wrong before anything is started.
fn check(args: &Args) -> anyhow::Result<Axes> {
    let axes = args.axes()?;
    args.placement.check()?;
    for case in axes.cases().iter().filter(|case| case.subject == Subject::Swarm) {
        case::scenario(case, args.seed)?;
    }
    args.out.as_deref().map_or(Ok(()), make_folder)?;
    Ok(axes)
}

fn make_folder(out: &Path) -> anyhow::Result<()> {
    let results = out.join(RESULTS);
    if results.exists() {
        let text = format!("--out {}: has results already; choose another folder", out.display());
        return Err(WrongUsage(text).into());
    }
    fs::create_dir_all(out).map_err(|why| {
        WrongUsage(format!("--out {}: {why}; choose a folder that can be written", out.display())).into()
    })
}

/// Prints the results, and leaves them in the user's folder.
fn show(args: &Args, results: &Results) -> anyhow::Result<()> {
    let json = serde_json::to_string(results)?;
    if let Some(out) = &args.out {
        write(out, &json, results).with_context(|| format!("{} cannot be written", out.display()))?;
    }
    tell(if args.json { json } else { table::render(results) }.trim_end());
    if let Some(out) = args.out.as_ref().filter(|_| !args.json) {
        tell(&format!("\nresults  {}: {RESULTS}, {PAGE}, {HISTOGRAMS}/", out.display()));
    }
    Ok(())
}

fn write(out: &Path, json: &str, results: &Results) -> std::io::Result<()> {
    fs::write(out.join(RESULTS), json)?;
    fs::write(out.join(PAGE), page::render(results))?;
    let histograms = out.join(HISTOGRAMS);
    fs::create_dir_all(&histograms)?;
    histogram_files::write(&histograms, results)
}

/// Now, in UTC, as RFC 3339 writes it.
fn began() -> String {
    humantime::format_rfc3339_seconds(SystemTime::now()).to_string()
}
