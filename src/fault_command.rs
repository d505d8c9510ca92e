//! `ringwing fault`: asks a live run for a fault.
//!
//! Never applies a fault itself; the run's launcher does, and answers.

use crate::{FAILED, WrongUsage, output::tell};
use anyhow::{anyhow, bail};
use ringwing_bus::{Domain, DomainId};
use ringwing_scenario::{Action, Fault, fault::trace};
use std::{
    fs,
    io::{self, Read, Write},
    os::unix::net::UnixStream,
    process::ExitCode,
};

/// Which fault, and in which run.
#[derive(Debug, clap::Args)]
pub(crate) struct FaultArgs {
    /// Domain of the run, or its folder
    #[arg(value_name = "RUN", value_parser = domain)]
    run: DomainId,
    /// The fault, such as "kill uav 3", "link 2->3 loss 30 % for 10 s" or "heal all"; or `list`
    sentence: String,
}

/// The domain that `text` names, alone or at the end of a run's folder.
fn domain(text: &str) -> Result<DomainId, String> {
    // A link to a run's folder, or `.`, may have any name; the folder itself has the right one.
    let folder = fs::canonicalize(text).ok().filter(|path| path.is_dir());
    let text = folder.map_or_else(|| text.to_owned(), |path| path.to_string_lossy().into_owned());
    // The folder of a run is called NAME-ID, and the name of a domain contains no dash.
    let name = text.trim_end_matches('/').rsplit(['/', '-']).next().unwrap_or(&text);
    name.parse()
}

/// Sends the request to the run and prints its answer; the exit code is 1 if the run refuses.
pub(crate) fn run(args: &FaultArgs) -> anyhow::Result<ExitCode> {
    let request = if args.sentence == "list" { "list".into() } else { parsed(&args.sentence)?.to_string() };
    let domain = Domain::join(&args.run)?;
    let answer = ask(&domain, &request).map_err(|error| no_answer(&domain, &error))?;
    // A launcher that ends closes the connection without an answer.
    if answer.is_empty() {
        bail!("domain {}: the run ended before the fault was applied", args.run);
    }
    tell(answer.trim_end());
    // This prefix is all that programs may read of an answer; the rest is for people.
    Ok(if answer.starts_with("refused: ") { ExitCode::from(FAILED) } else { ExitCode::SUCCESS })
}

/// The fault that a sentence asks for. A file of delays is read here, because the run may have another working folder.
pub(crate) fn parsed(sentence: &str) -> anyhow::Result<Action> {
    let action = sentence.parse().map_err(|error| WrongUsage(format!("{sentence:?}: {error}")))?;
    let mut faults = [Fault { at_s: 0.0, action }];
    trace::read_all(&mut faults).map_err(WrongUsage)?;
    let [Fault { action, .. }] = faults;
    Ok(action)
}

/// The error that the request could not be sent, or that its answer did not come.
fn no_answer(domain: &Domain, error: &io::Error) -> anyhow::Error {
    // Others may see the socket without being allowed to write to it.
    if error.kind() == io::ErrorKind::PermissionDenied {
        return domain.permission_denied().into();
    }
    let why = if domain.has_launcher() { "its launcher does not answer" } else { "its launcher is gone" };
    anyhow!("domain {}: {why}: {error}", domain.id())
}

/// Sends a request to the launcher of `domain` and waits for its whole answer.
fn ask(domain: &Domain, request: &str) -> io::Result<String> {
    let mut stream = UnixStream::connect(domain.request_path())?;
    writeln!(stream, "{request}")?;
    let mut answer = String::new();
    // This needs no timeout: the launcher closes the connection when it has answered, and the kernel does when it
    // ends.
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
    fn a_link_to_the_folder_of_a_run_stands_for_the_folder() {
        let place = tempfile::tempdir().unwrap();
        let folder = place.path().join("paper-4.2-k3x9ab");
        fs::create_dir(&folder).unwrap();
        let link = place.path().join("latest");
        std::os::unix::fs::symlink(&folder, &link).unwrap();
        assert_eq!(domain(link.to_str().unwrap()).unwrap().to_string(), "k3x9ab");
    }

    #[test]
    fn a_misspelled_fault_is_refused_before_it_is_sent() {
        let error = parsed("kil uav 3").unwrap_err();
        assert!(error.is::<WrongUsage>() && error.to_string().contains("did you mean kill?"), "{error}");
    }
}
