//! `ringwing scenario`: lists, shows and checks scenarios, and draws their faults.
//!
//! Never starts a process.

use crate::{
    fault_picture::{self, PictureArgs},
    output::{self, tell},
    run::warnings,
};
use ringwing_flight::counted;
use ringwing_scenario::{Preset, Reading, Source, preset, start};
use std::{io, process::ExitCode};

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
    /// Draw what a link fault does to a stream of samples
    Picture(PictureArgs),
}

/// Lists, shows, checks or draws.
pub(crate) fn run(verb: &ScenarioVerb) -> anyhow::Result<ExitCode> {
    match verb {
        ScenarioVerb::List => {
            for preset in preset::all() {
                list(preset);
            }
        }
        ScenarioVerb::Show { scenario } => {
            let text = Source::find(scenario)?.text;
            output::print(&text);
        }
        ScenarioVerb::Picture(args) => fault_picture::run(args)?,
        ScenarioVerb::Check { scenario } => {
            let source = Source::find(scenario)?;
            let reading = Reading::read(&source, &[])?;
            let warnings = warnings(&reading);
            let scenario = reading.scenario;
            // Drawing start states can fail too: many UAVs may not fit into a small area.
            start::states(&scenario)?;
            let (uavs, duration_s) = (scenario.formation.uavs, scenario.time.duration_s);
            for warning in &warnings {
                output::warning(warning);
            }
            let result = match warnings.len() {
                0 => "nothing is wrong".into(),
                count => counted(count, "warning"),
            };
            let uavs = counted(uavs, "UAV");
            tell(&format!("{}: {uavs}, {duration_s} s: {result}", source.name));
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// Width of the column of names: the longest name has 14 characters.
const NAME_COLUMNS: usize = 15;

/// Prints the name and the description of a preset.
fn list(preset: &Preset) {
    let columns = output::columns(&io::stdout()).saturating_sub(NAME_COLUMNS);
    let mut name = preset.name;
    for line in output::wrapped(preset.description, columns) {
        tell(&format!("{name:NAME_COLUMNS$}{line}"));
        // Further lines of the description stand below the first one.
        name = "";
    }
}
