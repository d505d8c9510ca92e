//! `ringwing fault`: asks a live run for a fault.
//!
//! Never applies a fault itself; the run's launcher does, and answers.

use crate::{WrongUsage, live_run};
use ringwing_bus::DomainId;
use ringwing_scenario::{Action, Fault, fault::trace};
use std::process::ExitCode;

/// Which fault, and in which run.
#[derive(Debug, clap::Args)]
pub(crate) struct FaultArgs {
    /// Domain of the run, its folder, or `latest`
    #[arg(value_name = "RUN", value_parser = live_run::domain)]
    run: DomainId,
    /// The fault, such as "kill uav 3", "link 2->3 loss 30 % for 10 s" or "heal all"; or `list`
    sentence: String,
}

/// Asks the run for the fault, and prints the tick at which it acts.
pub(crate) fn run(args: &FaultArgs) -> anyhow::Result<ExitCode> {
    let request = if args.sentence == "list" { "list".into() } else { parsed(&args.sentence)?.to_string() };
    live_run::ask(&args.run, &request)
}

/// The fault that a sentence asks for. A file of delays is read here, because the run may have another working folder.
pub(crate) fn parsed(sentence: &str) -> anyhow::Result<Action> {
    let action = sentence.parse().map_err(|error| WrongUsage(format!("{sentence:?}: {error}")))?;
    let mut faults = [Fault { at_s: 0.0, action }];
    trace::read_all(&mut faults).map_err(WrongUsage)?;
    let [Fault { action, .. }] = faults;
    Ok(action)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_misspelled_fault_is_refused_before_it_is_sent() {
        let error = parsed("kil uav 3").unwrap_err();
        assert!(error.is::<WrongUsage>() && error.to_string().contains("did you mean kill?"), "{error}");
    }
}
