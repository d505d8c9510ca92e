//! `ringwing scenario`: lists, shows and checks scenarios.
//!
//! Never starts a process.

use crate::output::{self, tell};
use ringwing_scenario::{Scenario, Source, preset, start};
use std::process::ExitCode;

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
            output::print(&text);
        }
        ScenarioVerb::Check { scenario } => {
            let source = Source::find(scenario)?;
            let scenario = Scenario::read(&source, &[])?;
            // Drawing start states can fail too: many UAVs may not fit into a small area.
            start::states(&scenario)?;
            let (uavs, duration_s) = (scenario.formation.uavs, scenario.time.duration_s);
            tell(&format!("{}: {uavs} UAVs, {duration_s} s: nothing is wrong", source.name));
        }
    }
    Ok(ExitCode::SUCCESS)
}
