//! `ringwing scenario`: lists, shows and checks scenarios.

use ringwing_scenario::{Scenario, Source, preset, start};
use std::process::ExitCode;

/// What to do with scenarios.
#[derive(Debug, clap::Subcommand)]
pub(crate) enum Verb {
    /// List the scenarios that come with ringwing
    List,
    /// Print a scenario with its comments, as a template for your own
    Show {
        /// A preset's name or a file
        scenario: String,
    },
    /// Say all that is wrong with a scenario, or that nothing is
    Check {
        /// A preset's name or a file
        scenario: String,
    },
}

/// Does what `verb` says.
pub(crate) fn run(verb: &Verb) -> anyhow::Result<ExitCode> {
    match verb {
        Verb::List => {
            for preset in preset::all() {
                println!("{:12} {}", preset.name, preset.description);
            }
        }
        Verb::Show { scenario } => print!("{}", Source::find(scenario)?.text),
        Verb::Check { scenario } => {
            let source = Source::find(scenario)?;
            let scenario = Scenario::read(&source, &[])?;
            start::places(&scenario)?;
            println!(
                "{}: {} UAVs, {} s: nothing wrong",
                source.name, scenario.formation.uavs, scenario.time.duration_s
            );
        }
    }
    Ok(ExitCode::SUCCESS)
}
