//! The arguments of `ringwing sweep`, and the sweep that they ask for.

use super::SweepVerb;
use crate::WrongUsage;
use ringwing_scenario::{AgentSection, Setting};
use ringwing_study::sweep::{Columns, Combination, Definition, Draft, Given, Sampling, Shard, SweepProblem};
use std::{num::NonZero, path::PathBuf};

/// What to fly, and how.
#[derive(Debug, clap::Args)]
#[command(args_conflicts_with_subcommands = true)]
#[expect(clippy::struct_excessive_bools, reason = "each is a flag of its own")]
pub(crate) struct SweepArgs {
    #[command(subcommand)]
    pub(super) verb: Option<SweepVerb>,
    /// Name of a built-in sweep (see `ringwing sweep list`), a sweep file, or a scenario to which axes are added
    #[arg(value_name = "SWEEP", default_value = "delay-loss")]
    sweep: String,
    /// Add an axis, such as "formation.uavs=3, 6, 12", "control.law=paper, resilient" or "delay=uniform 0 .. 2"
    #[arg(long = "axis", value_name = "NAME=VALUES")]
    axes: Vec<String>,
    /// Add a fault in which braces hold an axis, such as "at 30 s link all->all delay {0, 0.1 .. 1.0} s"
    #[arg(long = "fault", value_name = "SENTENCE")]
    faults: Vec<String>,
    /// Fly UAVs with a program of your own, such as "3=python3 mine.py" or "all=./controller"
    #[arg(long = "agent", value_name = "UAVS=COMMAND", value_parser = AgentSection::parse)]
    agents: Vec<AgentSection>,
    /// Override a key of the scenario in every cell
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = Setting::parse)]
    settings: Vec<Setting>,
    /// How the values of axes are combined
    #[arg(long, value_name = "HOW", value_parser = ["grid", "zip", "one-at-a-time"])]
    combination: Option<String>,
    /// How random axes are drawn
    #[arg(long, value_name = "HOW", value_parser = ["independent", "latin-hypercube"])]
    sampling: Option<String>,
    /// Number of samples of the random axes
    #[arg(long, value_name = "NUMBER")]
    samples: Option<u64>,
    /// Number of flights of each cell, each with a seed of its own
    #[arg(long, value_name = "NUMBER")]
    seeds: Option<u64>,
    /// The first seed of each cell
    #[arg(long, value_name = "NUMBER")]
    first_seed: Option<u64>,
    /// Fly each cell until the 95 % interval of its success is this narrow, such as 0.1
    #[arg(long, value_name = "WIDTH")]
    precision: Option<f64>,
    /// With --precision, the most flights of a cell
    #[arg(long, value_name = "NUMBER")]
    seeds_max: Option<u64>,
    /// Number of flights at the same time; by default, the number of cores
    #[arg(long, value_name = "NUMBER")]
    pub(super) jobs: Option<NonZero<usize>>,
    /// Fly only this part of the sweep, such as 3/16; jobs of Slurm and Kubernetes know theirs by themselves
    #[arg(long, value_name = "NUMBER/COUNT")]
    shard: Option<Shard>,
    /// Folder of the results; by default, sweeps/NAME
    #[arg(long, value_name = "FOLDER")]
    pub(super) out: Option<PathBuf>,
    /// Go on where an earlier run of the sweep has stopped (this is the default)
    #[arg(long, conflicts_with = "fresh")]
    resume: bool,
    /// Remove earlier results, and begin anew
    #[arg(long)]
    pub(super) fresh: bool,
    /// Fly every flight with real processes instead of in the simulation
    #[arg(long)]
    pub(super) processes: bool,
    /// Fly each flight without its faults as well, and fill the columns that say what they cost
    #[arg(long)]
    pub(super) baseline: bool,
    /// Fly even if that takes very long
    #[arg(long)]
    pub(super) yes: bool,
    /// Draw maps of this figure as well; repeatable
    #[arg(long = "figure", value_name = "NAME")]
    pub(super) figures: Vec<String>,
    /// Print the cells as JSON, and no progress during the flights
    #[arg(long)]
    pub(super) json: bool,
}

impl SweepArgs {
    /// The sweep.
    pub(super) fn definition(&self) -> anyhow::Result<Definition> {
        let mut draft = Draft::named(&self.sweep).map_err(|problems| refused(&problems))?;
        self.add_to(&mut draft).map_err(WrongUsage)?;
        let sweep = draft.finish().map_err(|problems| refused(&problems))?;
        // Nobody who reads the rows could tell two columns of one name apart.
        if let Some(axis) = Columns::of(&sweep).ambiguous() {
            return Err(WrongUsage(format!(
                "axis {axis}: a column of the results has this name: give another one"
            ))
            .into());
        }
        Ok(sweep)
    }

    /// Adds what the command line asks for. An axis or a key of the file gives way to one of the same name.
    fn add_to(&self, draft: &mut Draft) -> Result<(), String> {
        for text in &self.axes {
            let (name, values) = text.split_once('=').map(|(name, values)| (name.trim(), values.trim())).ok_or_else(|| {
                format!("--axis {text:?}: give a name and values, such as --axis \"control.law=paper, resilient\"")
            })?;
            draft.add_axis(Given::new(name, values, &format!("--axis {name:?}")));
        }
        for setting in &self.settings {
            draft.set(Given::new(&setting.key, &setting.value, "--set"));
        }
        // A fault has no name that another one could take over, so the faults of the file stay.
        draft.faults.extend(self.faults.iter().map(|text| Given::new("", text, "--fault")));
        // Whoever goes on with the sweep may be in another folder.
        draft.agents = self.agents.iter().map(AgentSection::placed).collect::<Result<_, _>>()?;
        // clap has refused every other word, so the last arms stand for one word each.
        let combination = |text: &String| match text.as_str() {
            "zip" => Combination::Zip,
            "one-at-a-time" => Combination::OneAtATime,
            _ => Combination::Grid,
        };
        let sampling = |text: &String| match text.as_str() {
            "latin-hypercube" => Sampling::LatinHypercube,
            _ => Sampling::Independent,
        };
        draft.combination = self.combination.as_ref().map(combination).or(draft.combination);
        draft.sampling = self.sampling.as_ref().map(sampling).or(draft.sampling);
        draft.samples = self.samples.or(draft.samples);
        draft.seeds = self.seeds.or(draft.seeds);
        draft.first_seed = self.first_seed.or(draft.first_seed);
        draft.precision = self.precision.or(draft.precision);
        draft.seeds_max = self.seeds_max.or(draft.seeds_max);
        Ok(())
    }

    /// The part of the sweep to fly: as given, or as a cluster says.
    pub(super) fn shard(&self) -> Result<Shard, WrongUsage> {
        // The environment is asked only without `--shard`, so that a job of a cluster can be told otherwise.
        let of_cluster = || Shard::of_environment(|name| std::env::var(name).ok());
        let shard = self.shard.map_or_else(of_cluster, |shard| Ok(Some(shard))).map_err(WrongUsage)?;
        Ok(shard.unwrap_or(Shard::WHOLE))
    }
}

fn refused(problems: &[SweepProblem]) -> anyhow::Error {
    let lines: Vec<_> = problems.iter().map(ToString::to_string).collect();
    WrongUsage(lines.join("\n")).into()
}
