//! `ringwing hunt`: the worst that a bounded number of faults can do to a flight.
//!
//! Never decides what to fly: the crate `ringwing_study` hunts in the simulation.

mod folder;
mod progress;
mod report;

use crate::{FAILED, WrongUsage, config, output, shrink};
use folder::Folder;
use progress::Progress;
use report::Report;
use ringwing_bus::StopFlag;
use ringwing_recorder::metrics::Verdict;
use ringwing_scenario::{Fault, Scenario, Setting, Source};
use ringwing_study::{
    Outcome, fly,
    hunt::{Arena, Budget, End, Finding, Goal, Hunt, Hunted, Limits, Strategy, find, run as fly_all},
    sweep::Crew,
};
use std::{
    num::NonZero,
    path::PathBuf,
    process::ExitCode,
    time::{Duration, Instant},
};

/// What to hunt, and how.
#[derive(Debug, clap::Args)]
#[expect(clippy::struct_excessive_bools, reason = "each is a flag of its own")]
pub(crate) struct HuntArgs {
    /// Name of a preset (see `ringwing scenario list`), or a scenario file
    scenario: String,
    /// What may be done to the flight, such as "2 kills, 1 link fault of at most 1 s, loss at most 30 %, from 20 s to 60 s"
    #[arg(long, value_name = "FAULTS")]
    budget: String,
    /// The figure of the summary that shall become as bad as possible
    #[arg(long, value_name = "FIGURE", default_value = "closest_pair_m")]
    goal: String,
    /// Hunt high values of the figure, even if they are the good ones
    #[arg(long, conflicts_with = "lowest")]
    highest: bool,
    /// Hunt low values of the figure, even if they are the good ones
    #[arg(long)]
    lowest: bool,
    /// Most flights
    #[arg(long, value_name = "NUMBER", default_value = "1000")]
    flights: NonZero<u64>,
    /// End after this time, such as "10 min"
    #[arg(long, value_name = "TIME", value_parser = humantime::parse_duration)]
    time: Option<Duration>,
    /// End after this number of flights in which nothing got worse
    #[arg(long, value_name = "NUMBER", default_value = "400")]
    patience: NonZero<u64>,
    /// Seed of the search; that of the flights is a key of the scenario, --set seed=NUMBER
    #[arg(long, value_name = "NUMBER", default_value = "1")]
    search_seed: u64,
    /// How faults are chosen; random is there to compare with
    #[arg(long, value_name = "HOW", value_parser = ["evolution", "random"], default_value = "evolution")]
    strategy: String,
    /// Override a key of the scenario
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = Setting::parse)]
    settings: Vec<Setting>,
    /// Add a fault to every flight, outside the budget
    #[arg(long = "fault", value_name = "SENTENCE")]
    faults: Vec<Fault>,
    /// Number of flights at the same time; by default, the number of cores
    #[arg(long, value_name = "NUMBER")]
    jobs: Option<NonZero<usize>>,
    /// Folder of the results; by default, hunts/NAME
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
    /// Remove earlier results, and begin anew instead of going on
    #[arg(long)]
    fresh: bool,
    /// Print the result as JSON, and no progress
    #[arg(long)]
    json: bool,
}

/// Hunts, and prints and writes the worst flight.
pub(crate) fn run(args: &HuntArgs) -> anyhow::Result<ExitCode> {
    let stop = StopFlag::on_signals()?;
    let begin = Instant::now();
    let hunt = args.hunt()?;
    let folder = Folder::prepare(args, &hunt)?;
    let file = folder.flights(&hunt.goal)?;
    let progress = Progress::new(&hunt, &args.limits(), file.before(), args.json);
    let is_late = || args.time.is_some_and(|time| begin.elapsed() >= time);
    let crew = Crew { jobs: config::jobs(args.jobs), fly: simulate, stops: || stop.is_set() || is_late() };
    let hunted = fly_all(&hunt, file, args.limits(), &crew, |search| progress.show(search));
    progress.finish();
    let hunted = hunted?;
    // `--time` stops a hunt in the same way, but is no interrupt.
    let is_interrupted = hunted.end == End::Stopped && stop.is_set();
    // Do this even after an interrupt: the worst flight so far is written as well, only not made small.
    let finding = args.found(&hunt, &hunted, &stop)?;
    let report = Report::new(&hunt, &args.scenario, &hunted, finding.as_ref(), is_interrupted);
    if let Some(finding) = &finding {
        folder.write_worst(&finding.to_text(&hunt, &args.scenario, report.flights))?;
    }
    report.print(&folder, args.json)?;
    if is_interrupted {
        output::warning(&format!(
            "interrupted after {} flights; the same command goes on from here",
            report.flights
        ));
    } else if stop.is_set() {
        output::warning(
            &"interrupted while the worst flight was made small: the same command goes on with that",
        );
    }
    Ok(if stop.is_set() { ExitCode::from(FAILED) } else { ExitCode::SUCCESS })
}

impl HuntArgs {
    fn hunt(&self) -> anyhow::Result<Hunt> {
        let budget: Budget = self
            .budget
            .parse()
            .map_err(|error| WrongUsage(format!("--budget {:?}: {error}", self.budget)))?;
        // Without a flag, the figure itself says which of its ends is the bad one.
        let is_highest = (self.highest || self.lowest).then_some(self.highest);
        let goal =
            Goal::new(&self.goal, is_highest).map_err(|error| WrongUsage(format!("--goal {error}")))?;
        let source = Source::find(&self.scenario)?;
        let scenario = Scenario::read(&source, &self.settings)?.with_faults(&self.faults)?;
        // Fly once before the hunt: if the scenario itself ends the world, all its flights fail and none is worse
        // than another.
        if simulate(&scenario).map_err(WrongUsage)?.verdict == Verdict::Failed {
            let why = "a fault ends the world, so no flight has an end to judge: remove that fault";
            return Err(WrongUsage(format!("scenario {:?}: {why}", scenario.name)).into());
        }
        let arena = Arena::new(&budget, &scenario)
            .map_err(|error| WrongUsage(format!("--budget {:?}: {error}", self.budget)))?;
        let strategy = if self.strategy == "random" { Strategy::Random } else { Strategy::Evolution };
        Ok(Hunt { scenario, budget, arena, goal, strategy, seed: self.search_seed })
    }

    fn limits(&self) -> Limits {
        Limits { flights: self.flights.get(), patience: self.patience.get() }
    }

    /// The worst flight, made small; `None` if nothing was found.
    fn found(&self, hunt: &Hunt, hunted: &Hunted, stop: &StopFlag) -> anyhow::Result<Option<Finding>> {
        let Some(worst) = hunted.search.worst() else { return Ok(None) };
        let show = |progress: ringwing_study::shrink::Progress<'_>| {
            if !self.json {
                shrink::show(progress);
            }
        };
        Ok(find(hunt, worst, || stop.is_set(), show).map_err(WrongUsage)?)
    }
}

fn simulate(scenario: &Scenario) -> Result<Outcome, String> {
    fly(scenario).map_err(|error| error.to_string())
}
