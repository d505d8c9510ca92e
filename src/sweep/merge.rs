//! `ringwing sweep merge`: joins the shards of a sweep, and says what is missing.
//!
//! Never changes a shard.

use super::{cells, files};
use crate::{FAILED, WrongUsage, output, output::tell};
use ringwing_study::sweep::{
    Columns, FlightId, Ledger, Manifest, Next, Shard, flight_of, flights_file, read_rows, sort_rows,
};
use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
    process::ExitCode,
};

/// Most missing cells that are named one by one. More push the verdict off a terminal.
const NAMED: usize = 10;

/// Which shards to join.
#[derive(Debug, clap::Args)]
pub(crate) struct MergeArgs {
    /// Folders with shards of one sweep; the result goes into the first
    #[arg(required = true, value_name = "FOLDER")]
    folders: Vec<PathBuf>,
    /// Draw maps of this figure as well; repeatable
    #[arg(long = "figure", value_name = "NAME")]
    figures: Vec<String>,
    /// Print the cells as JSON
    #[arg(long)]
    json: bool,
}

/// Joins the shards; the exit code says whether the sweep is complete.
pub(super) fn run(args: &MergeArgs) -> anyhow::Result<ExitCode> {
    let figures = files::figures(&args.figures)?;
    let manifest = common_manifest(&args.folders)?;
    let shards = shards(&args.folders)?;
    let (Some(folder), false) = (args.folders.first(), shards.is_empty()) else {
        return Err(WrongUsage(
            "there are no shards here: give the folders in which jobs have flown them".into(),
        )
        .into());
    };
    let target = folder.join(flights_file(Shard::WHOLE));
    let sources: Vec<&Path> = shards.iter().map(PathBuf::as_path).collect();
    // The target may be one of the sources, from an earlier merge: a flight that is there twice counts once.
    let rows = sort_rows(&sources, &target, &Columns::of(&manifest.sweep))?;
    let missing = missing(&manifest, &target)?;
    if !args.json {
        tell(&format!("joined {rows} flights of {} files", shards.len()));
    }
    files::write_all(folder, &manifest, &figures, args.json)?;
    if missing.is_empty() {
        return Ok(ExitCode::SUCCESS);
    }
    report(&missing);
    Ok(ExitCode::from(FAILED))
}

/// The manifest of all folders, which must be of the same sweep and the same build.
fn common_manifest(folders: &[PathBuf]) -> anyhow::Result<Manifest> {
    let mut manifest: Option<Manifest> = None;
    for folder in folders {
        let other = Manifest::expect(folder)?;
        if let Some(first) = &manifest {
            if first.sweep != other.sweep
                || (first.by_processes, first.has_baseline) != (other.by_processes, other.has_baseline)
            {
                return Err(WrongUsage(format!(
                    "{}: holds another sweep than the first folder",
                    folder.display()
                ))
                .into());
            }
            if first.build != other.build {
                output::warning(&format!(
                    "{}: flown by another build than the first folder, so flights may differ",
                    folder.display()
                ));
            }
        }
        manifest.get_or_insert(other);
    }
    manifest.ok_or_else(|| WrongUsage("give the folders of shards".into()).into())
}

/// The rows' files in the folders, those of whole sweeps included.
fn shards(folders: &[PathBuf]) -> anyhow::Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for folder in folders {
        for entry in fs::read_dir(folder)? {
            let path = entry?.path();
            let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
            if name.starts_with("flights.") && path.extension().is_some_and(|extension| extension == "csv") {
                files.push(path);
            }
        }
    }
    // A folder lists its files in any order, but the result must always be the same.
    files.sort();
    Ok(files)
}

/// The flights that nobody has flown, by cell.
fn missing(manifest: &Manifest, rows: &Path) -> anyhow::Result<BTreeMap<u64, u64>> {
    let sweep = &manifest.sweep;
    let mut ledger = Ledger::new(cells(sweep), &sweep.seeds, Shard::WHOLE);
    read_rows(rows, &Columns::of(sweep), |row| {
        if let Some(flight) = flight_of(row, sweep) {
            ledger.note_flown(flight, row.passed());
        }
    })?;
    let mut missing = BTreeMap::new();
    // What the ledger would fly next is missing. Nothing is flown, so it never says to wait for more than was asked for.
    while let Next::Fly(FlightId { cell, .. }) = ledger.hand_out() {
        *missing.entry(cell).or_default() += 1;
    }
    Ok(missing)
}

fn report(missing: &BTreeMap<u64, u64>) {
    let flights: u64 = missing.values().sum();
    let named: Vec<_> = missing.keys().take(NAMED).map(u64::to_string).collect();
    let more =
        if missing.len() > NAMED { format!(" and {} more", missing.len() - NAMED) } else { String::new() };
    output::warning(&format!(
        "{flights} flights of {} cells are missing (cells {}{more}): fly the shards that are not there, or the same \
         sweep without --shard",
        missing.len(),
        named.join(", ")
    ));
}
