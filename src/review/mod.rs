//! `ringwing review`: the verdict and the figures of a flight, from its log alone.
//!
//! Never changes the log, and never needs the folder of the run.

mod figures;
mod flight;
mod page;
mod table;

pub(crate) use flight::LoggedFlight;

use crate::{
    log_argument::{self, LOG_HELP},
    tell, warn_of,
};
use page::DrawnFigure;
use ringwing_bus::write_whole;
use std::{
    fs,
    path::{Path, PathBuf},
    process::ExitCode,
};

/// Which flight to review.
#[derive(Debug, clap::Args)]
pub(crate) struct ReviewArgs {
    #[arg(help = LOG_HELP)]
    log: PathBuf,
    /// Folder for the page, the figures and their data [default: `review` beside the log]
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
    /// Print the summary as JSON, and draw figures only if --out is given
    #[arg(long)]
    json: bool,
}

/// Prints the summary and draws the figures; the exit code is that of the flight.
pub(crate) fn run(args: &ReviewArgs) -> anyhow::Result<ExitCode> {
    let flight = LoggedFlight::read(&log_argument::named(&args.log))?;
    warn_of(&flight.path, &flight.notes);
    let text = if args.json { flight.summary.to_json() } else { flight.summary.to_string() };
    tell(text.trim_end());
    let beside = || flight.path.with_file_name("review");
    let folder = args.out.clone().or_else(|| (!args.json).then(beside));
    if let Some(folder) = folder {
        draw(&flight, &folder)?;
        if !args.json {
            tell(&format!("  figures  {}", folder.join("index.html").display()));
        }
    }
    Ok(flight.summary.verdict.exit_code())
}

fn draw(flight: &LoggedFlight, folder: &Path) -> anyhow::Result<()> {
    fs::create_dir_all(folder).map_err(|error| unwritable(folder, &error))?;
    let mut drawn = Vec::new();
    for figure in figures::all(flight) {
        let svg = figure.chart.svg()?;
        write(&folder.join(format!("{}.svg", figure.name)), &svg)?;
        write(&folder.join(format!("{}.csv", figure.name)), figure.table.csv())?;
        drawn.push(DrawnFigure { name: figure.name, title: figure.title, caption: figure.caption, svg });
    }
    write(&folder.join("index.html"), &page::page(flight, &drawn))
}

fn write(path: &Path, text: &str) -> anyhow::Result<()> {
    write_whole(path, text).map_err(|error| unwritable(path, &error))
}

fn unwritable(path: &Path, error: &dyn std::fmt::Display) -> anyhow::Error {
    anyhow::anyhow!("{}: cannot be written: {error}; choose another folder with --out", path.display())
}
