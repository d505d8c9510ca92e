//! `ringwing sweep compare`: which cells of two sweeps, or of two values of an axis, differ by more than chance.
//!
//! Never flies anything.

use super::files;
use crate::{WrongUsage, output::tell};
use ringwing_study::sweep::{Cell, Difference, Manifest, Shard, Side, compare, flights_file, read_cells};
use serde_json::json;
use std::{
    path::{Path, PathBuf},
    process::ExitCode,
};

/// Most cells that are printed. More push the result off a terminal.
const PRINTED: usize = 40;

/// What to compare.
#[derive(Debug, clap::Args)]
pub(crate) struct CompareArgs {
    /// Folder of a sweep's results
    one: PathBuf,
    /// Folder of the results to compare them with
    #[arg(required_unless_present = "by")]
    other: Option<PathBuf>,
    /// Compare the values of this axis, such as control.law, within one sweep: the first with the last
    #[arg(long, value_name = "AXIS", conflicts_with = "other")]
    by: Option<String>,
    /// Largest expected share of false differences among those that are reported
    #[arg(long, value_name = "SHARE", default_value_t = 0.05)]
    false_discoveries: f64,
    /// Print the differences as JSON
    #[arg(long)]
    json: bool,
}

/// A sweep that was read.
struct Read {
    manifest: Manifest,
    cells: Vec<Cell>,
}

/// Compares; the exit code is 0 whatever the result.
pub(super) fn run(args: &CompareArgs) -> anyhow::Result<ExitCode> {
    // Written with a negation so that NaN is refused as well.
    if !(args.false_discoveries > 0.0 && args.false_discoveries < 1.0) {
        return Err(
            WrongUsage("--false-discoveries: give a share between 0 and 1, such as 0.05".into()).into()
        );
    }
    let one = read(&args.one)?;
    match (&args.other, &args.by) {
        (Some(other), _) => compare_sweeps(args, &one, &read(other)?),
        (None, Some(axis)) => compare_values(args, &one, axis),
        // clap asks for one of them.
        (None, None) => Err(WrongUsage("give a second folder, or --by AXIS".into()).into()),
    }
}

fn read(folder: &Path) -> anyhow::Result<Read> {
    let manifest = Manifest::expect(folder)?;
    let cells = read_cells(&folder.join(flights_file(Shard::WHOLE)), &manifest.sweep, &files::figures(&[])?)?;
    Ok(Read { manifest, cells })
}

impl Read {
    fn axes(&self) -> Vec<&str> {
        self.manifest.sweep.design.axes.iter().map(|axis| axis.name.as_str()).collect()
    }
}

/// Compares the cells with the same values of the axes that both sweeps have.
fn compare_sweeps(args: &CompareArgs, one: &Read, other: &Read) -> anyhow::Result<ExitCode> {
    let (mine, theirs) = (one.axes(), other.axes());
    // The sweeps may have their axes in different orders, so look for each one by its name.
    let common: Vec<&str> = mine.iter().copied().filter(|axis| theirs.contains(axis)).collect();
    let places = |axes: &[&str]| -> Vec<usize> {
        common.iter().filter_map(|name| axes.iter().position(|axis| axis == name)).collect()
    };
    let (mine, theirs) = (places(&mine), places(&theirs));
    let differences =
        compare(Side { cells: &one.cells, axes: &mine }, Side { cells: &other.cells, axes: &theirs });
    // The name alone is often the same: what is compared may be two builds.
    let names = [&one.manifest, &other.manifest]
        .map(|manifest| format!("{} ({})", manifest.sweep.name, manifest.build));
    report(args, &common, &names, &differences)
}

/// Compares the cells of the first value of an axis with those of its last value.
fn compare_values(args: &CompareArgs, read: &Read, axis: &str) -> anyhow::Result<ExitCode> {
    let axes = read.axes();
    let place = axes.iter().position(|name| *name == axis);
    let place = place
        .ok_or_else(|| WrongUsage(format!("--by {axis}: the axes of this sweep are {}", axes.join(", "))))?;
    // The values are those of the sweep, and not those of its first and last cell: a sweep that goes on with one axis after
    // another has neither there, and one that was interrupted has flown only some.
    let (Some(first), Some(last)) = (axis_values(read, place).first(), axis_values(read, place).last())
    else {
        let message =
            format!("--by {axis}: its values are drawn at random: choose an axis with listed values");
        return Err(WrongUsage(message).into());
    };
    let of = |value: &str| -> anyhow::Result<Vec<Cell>> {
        let cells: Vec<_> = read.cells.iter().filter(|cell| cell.values[place] == value).cloned().collect();
        if cells.iter().all(|cell| cell.flights == 0) {
            return Err(WrongUsage(format!("--by {axis}: no flights with the value {value} yet")).into());
        }
        Ok(cells)
    };
    let others: Vec<usize> = (0..axes.len()).filter(|other| *other != place).collect();
    let names: Vec<&str> = others.iter().map(|other| axes[*other]).collect();
    let (one, other) = (of(first)?, of(last)?);
    let differences = compare(Side { cells: &one, axes: &others }, Side { cells: &other, axes: &others });
    report(args, &names, &[format!("{axis} {first}"), format!("{axis} {last}")], &differences)
}

/// The listed values of the axis at `place`.
fn axis_values(read: &Read, place: usize) -> &[String] {
    read.manifest.sweep.design.axes[place].listed()
}

fn report(
    args: &CompareArgs,
    axes: &[&str],
    names: &[String; 2],
    differences: &[Difference],
) -> anyhow::Result<ExitCode> {
    if args.json {
        tell(&serde_json::to_string_pretty(&as_json(args, axes, names, differences))?);
        return Ok(ExitCode::SUCCESS);
    }
    let found: Vec<_> = differences.iter().filter(|one| one.adjusted <= args.false_discoveries).collect();
    tell(&format!(
        "{} of {} cells differ by more than chance between {} and {}",
        found.len(),
        differences.len(),
        names[0],
        names[1]
    ));
    for difference in found.iter().take(PRINTED) {
        tell(&line(axes, difference));
    }
    if found.len() > PRINTED {
        tell(&format!("  ... and {} more, see --json", found.len() - PRINTED));
    }
    Ok(ExitCode::SUCCESS)
}

fn line(axes: &[&str], difference: &Difference) -> String {
    let place = axes.iter().zip(&difference.values).map(|(axis, value)| format!("{axis} {value}"));
    let place = place.collect::<Vec<_>>().join(", ");
    let share = |(passed, all): (u64, u64)| format!("{passed}/{all}");
    format!(
        "  {place}: {} and {} passed, {:+.0} points, p {:.2e} (adjusted {:.2e})",
        share(difference.one),
        share(difference.other),
        100.0 * difference.gain(),
        difference.probability,
        difference.adjusted
    )
}

fn as_json(
    args: &CompareArgs,
    axes: &[&str],
    names: &[String; 2],
    differences: &[Difference],
) -> serde_json::Value {
    let one = |difference: &Difference| {
        let values: serde_json::Map<_, _> = axes
            .iter()
            .map(|axis| (*axis).to_owned())
            .zip(difference.values.iter().map(|value| value.clone().into()))
            .collect();
        json!({
            "axes": values, "one_passed": difference.one.0, "one_flights": difference.one.1,
            "other_passed": difference.other.0, "other_flights": difference.other.1, "gain": difference.gain(),
            "p": difference.probability, "adjusted_p": difference.adjusted,
            "differs": difference.adjusted <= args.false_discoveries,
        })
    };
    json!({
        "one": names[0], "other": names[1], "false_discoveries": args.false_discoveries,
        "cells": differences.iter().map(one).collect::<Vec<_>>(),
    })
}
