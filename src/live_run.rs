//! The live run that a user names on the command line, for every verb that talks to one.
//!
//! Never decides what to ask a run for.

use crate::{FAILED, output::tell};
use ringwing_bus::{Domain, DomainId};
use ringwing_recorder::log::run_folder::named;
use std::{fs, path::Path, process::ExitCode};

/// The domain that `text` names, alone or at the end of a run's folder.
pub(crate) fn domain(text: &str) -> Result<DomainId, String> {
    // A link to a run's folder, or `.`, may have any name; the folder itself has the right one.
    let folder = fs::canonicalize(named(Path::new(text))).ok().filter(|path| path.is_dir());
    let text = folder.map_or_else(|| text.to_owned(), |path| path.to_string_lossy().into_owned());
    // The folder of a run is called NAME-ID, and the name of a domain contains no dash.
    let name = text.trim_end_matches('/').rsplit(['/', '-']).next().unwrap_or(&text);
    name.parse()
}

/// Sends the request to the run and prints its answer; the exit code is 1 if the run refuses.
pub(crate) fn ask(run: &DomainId, request: &str) -> anyhow::Result<ExitCode> {
    let answer = Domain::join(run)?.ask(request)?;
    tell(&answer.to_string());
    Ok(if answer.is_refusal() { ExitCode::from(FAILED) } else { ExitCode::SUCCESS })
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
}
