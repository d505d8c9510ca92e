//! `ringwing review`: the verdict and the figures of a flight, from its log alone.
//!
//! Never changes the log, and never needs the folder of the run.

mod animation;
mod figures;
mod flight;
mod overlay;
mod page;
mod periods;
mod table;

pub(crate) use flight::LoggedFlight;

use crate::{
    WrongUsage, config,
    output::{tell, warn_of},
    summary,
};
use figures::FlightFigure;
use ringwing_bus::write_whole;
use ringwing_recorder::{log::run_folder::LOG_HELP, metrics::Verdict};
use std::{
    fs, iter,
    path::{Path, PathBuf},
    process::ExitCode,
};

/// The page, in the folder of the figures.
const PAGE: &str = "index.html";

/// Which flight to review.
#[derive(Debug, clap::Args)]
pub(crate) struct ReviewArgs {
    #[arg(help = LOG_HELP)]
    log: PathBuf,
    /// Log of another run, to be drawn over the first one
    other: Option<PathBuf>,
    /// Folder for the page, the figures and their data [default: `review` beside the log]
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
    /// Print the summary as JSON, and draw figures only if --out is given
    #[arg(long, conflicts_with = "other")]
    json: bool,
    /// Compare the flight with the same one without its faults, and draw what they cost
    #[arg(long)]
    baseline: bool,
    /// Also draw the flight as an animated picture, `flight.svg`
    #[arg(long, conflicts_with = "other")]
    animate: bool,
}

/// Prints the summary and draws the figures; the exit code is that of the flight, or of the worse one of two.
pub(crate) fn run(args: &ReviewArgs) -> anyhow::Result<ExitCode> {
    if let Some(folder) = &args.out {
        refuse_foreign(folder)?;
    }
    // Read both logs before printing: an unreadable second one must not follow half of the output.
    let flights = iter::once(&args.log)
        .chain(&args.other)
        .map(|log| LoggedFlight::read(&config::log(log), args.baseline))
        .collect::<Result<Vec<_>, _>>()?;
    for flight in &flights {
        warn_of(&flight.path, &flight.notes);
        let text = if args.json { flight.summary.to_json() } else { summary::for_terminal(&flight.summary) };
        tell(text.trim_end());
    }
    let first = flights.first().map(|flight| flight.path.clone()).unwrap_or_default();
    let beside = || first.with_file_name("review");
    let folder = args.out.clone().or_else(|| (!args.json || args.animate).then(beside));
    if let Some(folder) = folder {
        draw(&flights, &folder)?;
        for flight in flights.iter().filter(|_| args.animate) {
            write(&folder.join("flight.svg"), &animation::svg(flight))?;
        }
        if !args.json {
            tell(&format!("  figures  {}", folder.join(PAGE).display()));
        }
    }
    let worst = flights.iter().map(|flight| flight.summary.verdict).max().unwrap_or(Verdict::Failed);
    Ok(summary::exit_code(worst))
}

fn draw(flights: &[LoggedFlight], folder: &Path) -> anyhow::Result<()> {
    fs::create_dir_all(folder).map_err(|error| unwritable(folder, &error))?;
    let names: &[&str] = if flights.len() > 1 { &["A", "B"] } else { &[""] };
    let mut figures: Vec<FlightFigure> = Vec::new();
    for (name, flight) in names.iter().zip(flights) {
        for figure in figures::all(flight) {
            // Both flights have figures of the same names, and the second table must not replace the first.
            let suffix = if *name == "B" { ".b" } else { "" };
            write(&folder.join(format!("{}{suffix}.csv", figure.name)), figure.table.csv())?;
            overlay::add(&mut figures, figure, name);
        }
    }
    // Draw only now: the lines of both flights are in the same figure.
    for figure in &figures {
        write(&folder.join(format!("{}.svg", figure.name)), &figure.chart.svg()?)?;
    }
    // The page comes last: once it is there, all that it links to is there, too.
    let named = names.iter().map(|name| (*name).to_owned()).zip(flights);
    write(&folder.join(PAGE), &page::page(&named.collect::<Vec<_>>(), &figures))
}

/// Refuses a folder that has something else, such as the user's sources: dozens of figures are hard to pick out of it again.
fn refuse_foreign(folder: &Path) -> Result<(), WrongUsage> {
    let is_empty = fs::read_dir(folder).map_or(true, |mut entries| entries.next().is_none());
    if is_empty || folder.join(PAGE).exists() {
        return Ok(());
    }
    let why = "has files that no review has made: choose another folder with --out";
    Err(WrongUsage(format!("{}: {why}", folder.display())))
}

fn write(path: &Path, text: &str) -> anyhow::Result<()> {
    write_whole(path, text).map_err(|error| unwritable(path, &error))
}

fn unwritable(path: &Path, error: &dyn std::fmt::Display) -> anyhow::Error {
    anyhow::anyhow!("{}: cannot be written: {error}; choose another folder with --out", path.display())
}
