//! `ringwing margin`: how much of something a swarm can take, by flights in the simulation, and by theory.
//!
//! Never decides where to fly: the crate `ringwing_study` searches.

mod progress;
mod report;

use crate::{FAILED, WrongUsage, config, output};
use progress::Progress;
use report::{Report, TheoryLine};
use ringwing_bus::StopFlag;
use ringwing_recorder::metrics::Verdict;
use ringwing_scenario::{PathKind, Scenario, Setting, ShapeName};
use ringwing_study::{
    fly,
    margin::{Asked, Delays, Pilots, Plan, Question, search},
    sweep::{Draft, Given, SweepProblem},
    theory::{Late, Linearised},
};
use std::{num::NonZero, process::ExitCode};

/// What to search, and how.
#[derive(Debug, clap::Args)]
pub(crate) struct MarginArgs {
    /// Name of a preset (see `ringwing scenario list`), or a scenario file
    scenario: String,
    /// Where the number goes: a fault such as "link all->all delay {x} s", or a key such as `control.formation_gain={x}`
    #[arg(long, value_name = "WHAT")]
    of: String,
    /// From a value at which flights succeed to one at which they do not, such as 0..2
    #[arg(long, value_name = "FROM..TO")]
    between: String,
    /// Share of flights that shall pass
    #[arg(long, value_name = "SHARE", default_value = "0.95", value_parser = share)]
    success: f64,
    /// Probability with which the interval holds the margin
    #[arg(long, value_name = "SHARE", default_value = "0.95", value_parser = share)]
    confidence: f64,
    /// How narrow the interval shall become; by default, a hundredth of the range
    #[arg(long, value_name = "WIDTH")]
    resolution: Option<f64>,
    /// Most flights at one value; more tell values apart that are closer to the margin
    #[arg(long, value_name = "NUMBER", default_value = "500")]
    flights_max: NonZero<u64>,
    /// The first seed at each value
    #[arg(long, value_name = "NUMBER", default_value = "1", value_parser = clap::value_parser!(u64).range(..=SEED_MAX))]
    first_seed: u64,
    /// Override a key of the scenario
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = Setting::parse)]
    settings: Vec<Setting>,
    /// Add a fault to every flight
    #[arg(long = "fault", value_name = "SENTENCE")]
    faults: Vec<String>,
    /// Number of flights at the same time; by default, the number of cores
    #[arg(long, value_name = "NUMBER")]
    jobs: Option<NonZero<usize>>,
    /// Also compute the delay margins of the linearised law
    #[arg(long)]
    theory: bool,
    /// Print the result as JSON, and no progress
    #[arg(long)]
    json: bool,
}

/// The largest first seed: half of what a scenario allows, so that no later one is too large.
const SEED_MAX: u64 = i64::MAX.cast_unsigned() / 2;

/// Searches a margin and prints it.
pub(crate) fn run(args: &MarginArgs) -> anyhow::Result<ExitCode> {
    let stop = StopFlag::on_signals()?;
    let question = args.question()?;
    let plan = args.plan();
    let progress = Progress::new(args.json);
    let pilots = Pilots { jobs: config::jobs(args.jobs), fly: &passes, stops: &|| stop.is_set() };
    let found = search(&question, &plan, &pilots, |search, value, trial| progress.show(search, value, trial));
    progress.finish();
    let found = found.map_err(WrongUsage)?;
    let theory = if args.theory { theory(&question)? } else { Vec::new() };
    let report = Report::new(&args.scenario, &question, &plan, &found, theory);
    if args.json {
        output::print(&format!("{}\n", serde_json::to_string_pretty(&report)?));
    } else {
        output::print(&report.text());
    }
    Ok(match report.failure() {
        None => ExitCode::SUCCESS,
        Some(failure) => {
            output::error(&failure);
            ExitCode::from(FAILED)
        }
    })
}

impl MarginArgs {
    fn question(&self) -> Result<Question, WrongUsage> {
        let set = self.settings.iter().map(|setting| Given::new(&setting.key, &setting.value, "--set"));
        let draft = Draft {
            scenario: Some(self.scenario.clone()),
            set: set.collect(),
            faults: self.faults.iter().map(|text| Given::new("", text, "--fault")).collect(),
            place: self.scenario.clone(),
            ..Draft::default()
        };
        let asked = Asked { of: &self.of, between: &self.between, resolution: self.resolution };
        Question::new(draft, &asked).map_err(|problems| {
            WrongUsage(problems.iter().map(SweepProblem::to_string).collect::<Vec<_>>().join("\n"))
        })
    }

    fn plan(&self) -> Plan {
        Plan {
            success: self.success,
            confidence: self.confidence,
            flights_max: self.flights_max.get(),
            first_seed: self.first_seed,
        }
    }
}

/// A share strictly between 0 and 1: no number of flights shows one of 0 or 1.
fn share(text: &str) -> Result<f64, String> {
    let share = text.parse().ok().filter(|share: &f64| *share > 0.0 && *share < 1.0);
    share.ok_or_else(|| "give a number between 0 and 1, such as 0.95".to_owned())
}

fn passes(scenario: &Scenario) -> Result<bool, String> {
    let outcome = fly(scenario).map_err(|error| error.to_string())?;
    Ok(outcome.verdict == Verdict::Passed)
}

/// The margins of the swarm that flies at the beginning of the range; the one that was flown is marked.
fn theory(question: &Question) -> Result<Vec<TheoryLine>, WrongUsage> {
    let scenario =
        question.scenario(question.range.from).map_err(|problem| WrongUsage(problem.to_string()))?;
    if scenario.formation.shape != ShapeName::Ring || !scenario.manoeuvres.is_empty() {
        let message =
            "--theory: the theory is that of a ring: give formation.shape = \"ring\" and no manoeuvres";
        return Err(WrongUsage(message.into()));
    }
    if scenario.leader.path.kind != PathKind::Straight {
        let message = "--theory: the linearised law assumes a leader that flies straight (Assumption 1): give \
                       leader.path.kind = \"straight\", or no --theory";
        return Err(WrongUsage(message.into()));
    }
    let swarm = Linearised::of(&scenario);
    let delays = question.delays();
    let line = |late: Late| {
        let margin_s = swarm.margin_s(late);
        let of_this = |delays: Delays| (delays.late == late).then_some(delays);
        let number = delays.and_then(of_this).zip(margin_s).map(|(delays, margin_s)| delays.number(margin_s));
        TheoryLine { late: late.name(), margin_s, bound_s: swarm.bound_s(late), number }
    };
    Ok(Late::ALL.map(line).into())
}
