//! `ringwing fault`: does something to a run that is in the air.

use crate::{FAILED, WrongUsage, tell};
use anyhow::Context;
use ringwing_bus::{Domain, DomainId};
use ringwing_scenario::{Action, Fault, fault::trace};
use std::{
    io::{Read, Write},
    os::unix::net::UnixStream,
    process::ExitCode,
};

/// What to do, to which run.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// The run's domain, or its folder
    #[arg(value_name = "RUN", value_parser = domain, add = clap_complete::ArgValueCandidates::new(runs))]
    run: DomainId,
    /// What to do, such as "kill uav 3", "link 2->3 loss 30 % for 10 s" or "heal all"; or `list`
    sentence: String,
}

/// A domain's name by itself, or at the end of its run's folder.
fn domain(text: &str) -> Result<DomainId, String> {
    let name = text.trim_end_matches('/').rsplit(['/', '-']).next().unwrap_or(text);
    name.parse()
}

/// The runs that go on.
fn runs() -> Vec<clap_complete::CompletionCandidate> {
    let ids = ringwing_bus::domain::all();
    ids.iter().map(|id| clap_complete::CompletionCandidate::new(id.to_string())).collect()
}

/// Asks the run, and tells what it answers.
pub(crate) fn run(args: &Args) -> anyhow::Result<ExitCode> {
    let request =
        if args.sentence == "list" { "list".into() } else { understood(&args.sentence)?.to_string() };
    let domain = Domain::join(&args.run)?;
    let answer = ask(&domain, &request)
        .with_context(|| format!("domain {}: its launcher does not answer", args.run))?;
    if answer.is_empty() {
        anyhow::bail!("domain {}: the run ended before it was done", args.run);
    }
    tell(answer.trim_end());
    Ok(if answer.starts_with("refused: ") { ExitCode::from(FAILED) } else { ExitCode::SUCCESS })
}

/// What is meant, with a file of delays read here: the run may be at home elsewhere.
fn understood(sentence: &str) -> anyhow::Result<Action> {
    let action = sentence.parse().map_err(|error| WrongUsage(format!("{sentence:?}: {error}")))?;
    let mut faults = [Fault { at_s: 0.0, action }];
    trace::read_all(&mut faults).map_err(WrongUsage)?;
    let [Fault { action, .. }] = faults;
    Ok(action)
}

fn ask(domain: &Domain, request: &str) -> std::io::Result<String> {
    let mut stream = UnixStream::connect(domain.request_path())?;
    writeln!(stream, "{request}")?;
    let mut answer = String::new();
    stream.read_to_string(&mut answer)?;
    Ok(answer)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_is_found_by_its_domain_or_its_folder() {
        for text in ["k3x9ab", "runs/paper-4.2-k3x9ab", "/somewhere/paper-4.2-k3x9ab/", "./k3x9ab"] {
            assert_eq!(domain(text).unwrap().to_string(), "k3x9ab", "{text}");
        }
        assert!(domain("runs/paper-4.2").is_err());
    }

    #[test]
    fn what_is_not_understood_is_not_sent() {
        let error = understood("kil uav 3").unwrap_err();
        assert!(error.is::<WrongUsage>() && error.to_string().contains("did you mean kill?"), "{error}");
    }
}
