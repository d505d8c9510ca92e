//! The summary of a run, made for the terminal and for the exit code.
//!
//! Never computes a value; each is in the [`Summary`] already.

mod deviation;
mod disturbances;
mod faults;
mod line;
mod text;

pub(crate) use text::{SummaryText, for_terminal};

use crate::{FAILED, VIOLATED, launcher::Outcome};
use ringwing_recorder::{Summary, log::run_folder::log_in, metrics::Verdict, summary::RunFindings};
use ringwing_scenario::Scenario;
use std::process::ExitCode;

/// The exit code that tells `verdict`.
pub(crate) fn exit_code(verdict: Verdict) -> ExitCode {
    match verdict {
        Verdict::Passed => ExitCode::SUCCESS,
        Verdict::Violated => ExitCode::from(VIOLATED),
        Verdict::Failed => ExitCode::from(FAILED),
    }
}

/// The summary of a run of `scenario` that ended with `outcome`; `command` repeats the run.
pub(crate) fn of_run(scenario: &Scenario, outcome: &Outcome, recorded: bool, command: String) -> Summary {
    // With `--no-record` there is a recorder too, for the measures, but no log.
    let logged = outcome.recorder.as_ref().filter(|_| recorded);
    let found = RunFindings {
        world: outcome.world.as_ref(),
        flight: outcome.recorder.as_ref().map(|report| report.summary.clone()),
        failures: outcome.failures.clone(),
        ticks: outcome.ticks,
        start_time: outcome.start_time,
        flight_time: outcome.flight_time,
        log: recorded.then(|| log_in(&outcome.folder).display().to_string()),
        messages: logged.map(|report| report.messages),
        command,
    };
    Summary::of_run(scenario, found)
}

#[cfg(test)]
mod tests;
