//! `ringwing scenario`: lists, shows and checks scenarios.
//!
//! Never starts a process.

use crate::{run::warnings, tell};
use ringwing_scenario::{Reading, Source, preset, start};
use std::{
    io::{self, Write},
    process::ExitCode,
};

/// What to do with scenarios.
#[derive(Debug, clap::Subcommand)]
pub(crate) enum ScenarioVerb {
    /// List the scenarios that come with ringwing
    List,
    /// Print a scenario with its comments, as a template for your own scenarios
    Show {
        /// Name of a preset, or a scenario file
        scenario: String,
    },
    /// Check a scenario and print everything that is wrong with it
    Check {
        /// Name of a preset, or a scenario file
        scenario: String,
    },
}

/// Lists, shows or checks.
pub(crate) fn run(verb: &ScenarioVerb) -> anyhow::Result<ExitCode> {
    match verb {
        ScenarioVerb::List => {
            for preset in preset::all() {
                tell(&format!("{:12} {}", preset.name, preset.description));
            }
        }
        ScenarioVerb::Show { scenario } => {
            let text = Source::find(scenario)?.text;
            // Unlike `tell`, this adds no line break: the output is the scenario, byte for byte.
            let _ = io::stdout().write_all(text.as_bytes());
        }
        ScenarioVerb::Check { scenario } => {
            let source = Source::find(scenario)?;
            let reading = Reading::read(&source, &[])?;
            let warnings = warnings(&reading);
            let scenario = reading.scenario;
            // Drawing start states can fail too: many UAVs may not fit into a small area.
            start::states(&scenario)?;
            let (uavs, duration_s) = (scenario.formation.uavs, scenario.time.duration_s);
            for warning in &warnings {
                eprintln!("ringwing: {warning}");
            }
            let result = match warnings.len() {
                0 => "nothing is wrong".into(),
                1 => "1 warning".into(),
                count => format!("{count} warnings"),
            };
            tell(&format!("{}: {uavs} UAVs, {duration_s} s: {result}", source.name));
        }
    }
    Ok(ExitCode::SUCCESS)
}
