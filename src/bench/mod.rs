//! `ringwing bench`: how long a control tick takes across processes, where the time goes, and what else it could have cost.
//!
//! [`args`] is what to measure, [`plan`] in which order, [`runner`] does it, each [`case`] in a process of its own: the swarm
//! itself, or a [`transport`] in its place. [`hops`] makes latencies of their stamps, and [`result`] is what there is to show.
//!
//! Never filters a sample.

mod args;
pub(crate) mod case;
mod hops;
mod plan;
mod result;
mod runner;
pub(crate) mod transport;

pub(crate) use args::Args;

use crate::{FAILED, WrongUsage, tell};
use anyhow::Context;
use args::{Axes, Verb};
use result::{FORMAT, Load, Machine, Measured, Results, Subject};
use runner::Runner;
use std::{fs, path::Path, process::ExitCode, time::SystemTime};

/// Name of the results in their folder.
const RESULTS: &str = "results.json";

/// Measures, and says what came of it; the exit code says whether all was measured.
pub(crate) fn run(args: &Args) -> anyhow::Result<ExitCode> {
    if let Some(Verb::Compare { a, b }) = &args.verb {
        anyhow::bail!("{} and {} cannot be compared by this build", a.display(), b.display());
    }
    if args.doctor {
        inspect().warnings.iter().for_each(|warning| tell(warning));
        return Ok(ExitCode::SUCCESS);
    }
    let axes = check(args)?;
    let began = began();
    let runner = Runner::new(&axes, &args.placement, args.seed, args.out.as_deref().filter(|_| args.mcap))?;
    let cases = runner.run(args.json);
    let results = Results {
        format: FORMAT.into(),
        ringwing: env!("CARGO_PKG_VERSION").into(),
        began,
        command: std::env::args().collect::<Vec<_>>().join(" "),
        seed: args.seed,
        machine: inspect(),
        interrupted: runner.is_interrupted(),
        cases,
    };
    show(args, &results)?;
    let whole = !results.interrupted && results.cases.iter().all(|case| case.failure.is_none());
    Ok(if whole { ExitCode::SUCCESS } else { ExitCode::from(FAILED) })
}

/// What this is measured on.
fn inspect() -> Machine {
    Machine { facts: Vec::new(), warnings: Vec::new() }
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

fn show(args: &Args, results: &Results) -> anyhow::Result<()> {
    let json = serde_json::to_string(results)?;
    if let Some(out) = &args.out {
        let path = out.join(RESULTS);
        fs::write(&path, &json).with_context(|| format!("{} cannot be written", path.display()))?;
    }
    if args.json {
        tell(&json);
        return Ok(());
    }
    results.cases.iter().for_each(|measured| tell(&line(measured)));
    if results.interrupted {
        tell("interrupted: this is what was measured until then");
    }
    tell(&format!("seed {}", results.seed));
    Ok(())
}

/// A case and its median ticks.
fn line(measured: &Measured) -> String {
    let mut words = vec![format!("{:<44}", runner::describe(&measured.case))];
    for repeat in &measured.repeats {
        let p50_us = repeat
            .hops
            .get(&result::Hop::Tick)
            .map_or(0.0, |tick| tick.0.value_at_quantile(0.5) as f64 / 1e3);
        words.push(match measured.case.load {
            Load::Closed => format!("{:9.2} us a tick", repeat.tick_ns / 1e3),
            Load::Paced(_) => format!("{p50_us:9.2} us p50"),
        });
    }
    words.extend(measured.failure.clone());
    words.join(" ").trim_end().to_owned()
}

/// Now, in UTC, as RFC 3339 writes it.
fn began() -> String {
    humantime::format_rfc3339_seconds(SystemTime::now()).to_string()
}
