//! What a sweep leaves behind: Parquet, a table of its cells, maps as SVG and on a page; and what it prints.
//!
//! Never computes a figure: the rows have them all.

use super::{SweepArgs, tell_place};
use crate::{WrongUsage, output::tell};
use anyhow::Context;
use ringwing_scenario::Scenario;
use ringwing_study::{
    Figure,
    files::{CsvLines, ResultsError, replace},
    sweep::{
        Cell, Columns, Definition, Manifest, Shard, Spread, draw_maps, flights_file, page, read_cells,
        write_parquet,
    },
};
use serde_json::json;
use std::{env, fs, io::Write, path::Path};
use xxhash_rust::xxh3::Xxh3;

/// Figures that every sweep draws.
const FIGURES: [&str; 4] = ["slot_error_max_m", "settling_s", "recovery_max_s", "closest_pair_m"];
/// Most cells that are printed; the page and `cells.csv` have all. More push the places of the results off a terminal.
const PRINTED: usize = 40;

/// Identifies this program to the bit.
///
/// The programs of the user's that fly UAVs of `scenario` are a part of it: rows of two laws must not be mixed either.
pub(crate) fn build(scenario: &Scenario) -> anyhow::Result<String> {
    // A hash and not the version: two builds of one version may fly differently, and their rows must not be mixed.
    let path = env::current_exe().context("the path of this program is unknown")?;
    let files = [path].into_iter().chain(ringwing_programs::files(scenario)?);
    let mut hash = Xxh3::new();
    for file in files {
        hash.update(&fs::read(&file).with_context(|| format!("{} cannot be read", file.display()))?);
    }
    Ok(format!("{:016x}", hash.digest()))
}

/// The figures to draw: the usual ones and those that the arguments name.
pub(super) fn figures(named: &[String]) -> Result<Vec<&'static Figure>, WrongUsage> {
    let mut figures: Vec<&Figure> = FIGURES.iter().filter_map(|name| Figure::named(name)).collect();
    for name in named {
        let figure = Figure::named(name).ok_or_else(|| unknown_figure(name))?;
        // A figure that is named twice would have two columns of the same name.
        if figures.iter().all(|other| other.name != figure.name) {
            figures.push(figure);
        }
    }
    Ok(figures)
}

fn unknown_figure(name: &str) -> WrongUsage {
    let names: Vec<_> = ringwing_study::figure::FIGURES.iter().map(|figure| figure.name).collect();
    WrongUsage(format!("--figure {name}: there is no such figure; the figures are {}", names.join(", ")))
}

/// Prints the cells of the sweep in `folder`, and writes everything that is made from its rows.
pub(super) fn write(
    folder: &Path,
    manifest: &Manifest,
    shard: Shard,
    args: &SweepArgs,
) -> anyhow::Result<()> {
    // A shard has only a part of the flights, so tables and maps have to wait for the merge.
    if shard == Shard::WHOLE {
        return write_all(folder, manifest, &figures(&args.figures)?, args.json);
    }
    if !args.json {
        tell(&format!(
            "shard {shard} is complete; `ringwing sweep merge {}` joins all shards",
            folder.display()
        ));
        tell_place("flights", &folder.join(flights_file(shard)));
    }
    Ok(())
}

/// As [`write()`], of a whole sweep.
pub(super) fn write_all(
    folder: &Path,
    manifest: &Manifest,
    figures: &[&Figure],
    is_json: bool,
) -> anyhow::Result<()> {
    let rows = folder.join(flights_file(Shard::WHOLE));
    let sweep = &manifest.sweep;
    let cells = read_cells(&rows, sweep, figures)?;
    // Print first: the results are of use even if the disk is full now.
    if is_json {
        tell(&serde_json::to_string_pretty(&json(manifest, &cells, figures))?);
    } else {
        print(sweep, &cells);
    }
    write_parquet(&rows, &folder.join("flights.parquet"), sweep)?;
    write_cells(&folder.join("cells.csv"), sweep, &cells, figures)?;
    let maps = draw_maps(sweep, &cells, figures);
    for map in &maps {
        let path = folder.join(format!("map-{}.svg", map.name));
        replace(&path, |file| file.write_all(map.svg.as_bytes()))?;
    }
    let index = folder.join("index.html");
    replace(&index, |file| file.write_all(page(manifest, &maps, &cells, figures).as_bytes()))?;
    if !is_json {
        tell_place("maps", &index);
        tell_place("flights", &rows);
    }
    Ok(())
}

fn print(sweep: &Definition, cells: &[Cell]) {
    let (flights, passed) =
        cells.iter().fold((0, 0), |(all, passed), cell| (all + cell.flights, passed + cell.passed));
    let plural = |count: u64| if count == 1 { "" } else { "s" };
    let count = cells.len() as u64;
    tell(&format!(
        "{}: {flights} flight{} of {count} cell{}, {passed} passed\n",
        sweep.name,
        plural(flights),
        plural(count)
    ));
    for line in table(sweep, cells) {
        tell(&line);
    }
    // Equal flights say nothing about chance, and people easily believe that they do.
    if let Some(cell) = cells.iter().find(|cell| is_repeated(cell)) {
        tell(&format!(
            "\n  note: the flights of cell {} are equal to the bit: nothing in this scenario depends on the seed",
            cell.cell
        ));
    }
    tell("");
}

/// Whether all flights of the cell are the same.
fn is_repeated(cell: &Cell) -> bool {
    // The kept rows are enough: where chance plays a part, even two flights differ.
    let hash = |index: usize| cell.kept.get(index).and_then(|row| row.payload_hash.as_ref());
    cell.kept.len() > 1 && hash(0).is_some() && (1..cell.kept.len()).all(|index| hash(index) == hash(0))
}

/// The table of the cells: the values of the axes, and the success.
fn table(sweep: &Definition, cells: &[Cell]) -> Vec<String> {
    let names = Columns::of(sweep).axes;
    let width = |axis: usize| {
        let widths = cells.iter().map(|cell| cell.values[axis].chars().count());
        widths.max().unwrap_or_default().max(names[axis].chars().count())
    };
    let widths: Vec<usize> = (0..names.len()).map(width).collect();
    let row = |values: &[String]| {
        let padded = values.iter().zip(&widths).map(|(value, width)| format!("{value:>width$}"));
        padded.collect::<Vec<_>>().join("  ")
    };
    let mut lines = vec![format!("  {}  passed        95 % interval", row(&names))];
    for cell in cells.iter().take(PRINTED) {
        let share = cell.success();
        let passed = format!("{}/{}", cell.passed, cell.flights);
        let (low, high) = (100.0 * share.low, 100.0 * share.high);
        let share = 100.0 * share.value;
        lines.push(format!("  {}  {passed:>9} {share:>3.0} %  {low:>3.0} to {high:.0} %", row(&cell.values)));
    }
    if cells.len() > PRINTED {
        lines.push(format!("  ... and {} more, see cells.csv", cells.len() - PRINTED));
    }
    lines
}

fn json(manifest: &Manifest, cells: &[Cell], figures: &[&Figure]) -> serde_json::Value {
    let names = Columns::of(&manifest.sweep).axes;
    let cell = |cell: &Cell| {
        let share = cell.success();
        let axes: serde_json::Map<_, _> =
            names.iter().cloned().zip(cell.values.iter().map(|value| value.clone().into())).collect();
        let spread = |(figure, spread): (&&Figure, &Spread)| {
            (figure.name.to_owned(), json!({ "median": spread.median, "bad": spread.bad }))
        };
        let figures: serde_json::Map<_, _> = figures.iter().zip(&cell.figures).map(spread).collect();
        json!({
            "cell": cell.cell, "axes": axes, "flights": cell.flights, "passed": cell.passed,
            "success": share.value, "success_low": share.low, "success_high": share.high, "figures": figures,
        })
    };
    json!({
        "sweep": manifest.sweep.name, "version": manifest.version, "build": manifest.build,
        "cells": cells.iter().map(cell).collect::<Vec<_>>(),
    })
}

/// Writes one row for each cell: success with its interval, and the spread of each figure.
fn write_cells(
    path: &Path,
    sweep: &Definition,
    cells: &[Cell],
    figures: &[&Figure],
) -> Result<(), ResultsError> {
    // An absent figure is an empty field, because a reader would take any number for a measured one.
    let text = |value: Option<f64>| value.map_or_else(String::new, |value| value.to_string());
    let mut header = vec!["cell".to_owned()];
    header.extend(Columns::of(sweep).axes.iter().cloned());
    header.extend(["flights", "passed", "success", "success_low", "success_high"].map(ToOwned::to_owned));
    for figure in figures {
        header.extend([format!("{}_median", figure.name), format!("{}_bad", figure.name)]);
    }
    replace(path, |file| {
        let mut csv = CsvLines::new(file);
        csv.write(&header)?;
        for cell in cells {
            let share = cell.success();
            let mut fields = vec![cell.cell.to_string()];
            fields.extend(cell.values.iter().cloned());
            fields.extend([cell.flights.to_string(), cell.passed.to_string()]);
            fields.extend([share.value, share.low, share.high].map(|share| share.to_string()));
            fields.extend(cell.figures.iter().flat_map(|spread| [text(spread.median), text(spread.bad)]));
            csv.write(&fields)?;
        }
        Ok(())
    })
}
