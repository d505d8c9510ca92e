//! The folder of a hunt: what was hunted, a row for each flight, and the worst flight as a scenario.
//!
//! Must never mix the flights of two hunts.

use super::HuntArgs;
use crate::{WrongUsage, sweep::build};
use ringwing_study::{
    files::{ResultsError, refuse_if_in_use, replace},
    hunt::{FlightFile, Goal, Hunt, Strategy},
};
use serde_json::json;
use std::{
    fs,
    io::{ErrorKind, Write},
    path::{Path, PathBuf},
};

/// What was hunted, by what.
const DEFINITION: &str = "hunt.json";
/// A row for each flight.
const FLIGHTS: &str = "flights.csv";
/// The worst flight, made small.
const WORST: &str = "worst.toml";

/// The folder of a hunt.
pub(super) struct Folder(PathBuf);

impl Folder {
    /// Makes the folder, or makes sure that it holds an earlier part of the same hunt.
    pub(super) fn prepare(args: &HuntArgs, hunt: &Hunt) -> anyhow::Result<Self> {
        let folder = Self(args.out.clone().unwrap_or_else(|| Path::new("hunts").join(&hunt.scenario.name)));
        let definition = definition(hunt)?;
        if args.fresh {
            folder.remove_results()?;
        }
        match fs::read_to_string(folder.definition()) {
            Ok(before) if before != definition => {
                return Err(WrongUsage(format!(
                    "{}: holds another hunt, or the same one by another build of ringwing or of a program that flies UAVs: choose another folder with \
                     --out, or begin anew with --fresh",
                    folder.0.display()
                ))
                .into());
            }
            Err(error) if error.kind() != ErrorKind::NotFound => {
                return Err(folder.error("read", error).into());
            }
            _ => {}
        }
        fs::create_dir_all(&folder.0).map_err(|error| folder.error("made", error))?;
        replace(&folder.definition(), |file| file.write_all(definition.as_bytes()))?;
        Ok(folder)
    }

    fn definition(&self) -> PathBuf {
        self.0.join(DEFINITION)
    }

    fn error(&self, what: &'static str, source: std::io::Error) -> ResultsError {
        ResultsError::File { path: self.0.clone(), what, source }
    }

    /// Removes what an earlier hunt has written, and nothing else.
    fn remove_results(&self) -> Result<(), ResultsError> {
        // In a folder that is not a hunt's, files of these names are somebody else's.
        if !self.definition().exists() {
            return Ok(());
        }
        let flights = self.0.join(FLIGHTS);
        if flights.exists() {
            refuse_if_in_use(&flights)?;
        }
        // The definition goes last: as long as it is there, a removal that was cut short can be done again.
        for name in [FLIGHTS, WORST, DEFINITION] {
            match fs::remove_file(self.0.join(name)) {
                Err(error) if error.kind() != ErrorKind::NotFound => return Err(self.error("removed", error)),
                _ => {}
            }
        }
        Ok(())
    }

    /// The rows, open for appending.
    pub(super) fn flights(&self, goal: &Goal) -> Result<FlightFile, ResultsError> {
        FlightFile::open(&self.0.join(FLIGHTS), goal)
    }

    /// Writes the worst flight, whole or not at all.
    pub(super) fn write_worst(&self, text: &str) -> Result<(), ResultsError> {
        replace(&self.worst(), |file| file.write_all(text.as_bytes()))
    }

    pub(super) fn worst(&self) -> PathBuf {
        self.0.join(WORST)
    }

    pub(super) fn rows(&self) -> PathBuf {
        self.0.join(FLIGHTS)
    }
}

/// Everything that decides which flights are flown, as text: two hunts with the same text have the same flights.
fn definition(hunt: &Hunt) -> anyhow::Result<String> {
    let strategy = match hunt.strategy {
        Strategy::Evolution => "evolution",
        Strategy::Random => "random",
    };
    // The limits are missing on purpose: a hunt may go on with more flights, time or patience. The build is there
    // because another one may fly the same faults differently.
    let value = json!({
        "scenario": hunt.scenario.to_toml(), "budget": hunt.budget.to_string(), "goal": hunt.goal.to_string(),
        "strategy": strategy, "search_seed": hunt.seed, "version": env!("CARGO_PKG_VERSION"), "build": build(&hunt.scenario)?,
    });
    Ok(serde_json::to_string_pretty(&value)? + "\n")
}
