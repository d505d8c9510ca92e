//! Looks for the programs of a scenario, so that a typing error does not become a flight without agents.
//!
//! Must never start a program.

use ringwing_flight::UavId;
use ringwing_scenario::{AgentSection, Scenario};
use rustix::fs::{Access, access};
use std::{
    env, io,
    path::{Path, PathBuf},
};

/// The program of a UAV cannot be started.
#[derive(Debug, thiserror::Error)]
#[error(
    "{uav}: program {program:?} cannot be started in {folder}: {source}: build it, or correct the command"
)]
pub struct FindError {
    uav: UavId,
    program: String,
    folder: String,
    source: io::Error,
}

/// Checks that each program of `scenario` can be started.
///
/// # Errors
/// The first UAV whose program cannot be found or executed.
pub fn check(scenario: &Scenario) -> Result<(), FindError> {
    UavId::all(scenario.formation.uavs)
        .filter_map(|uav| Some((uav, scenario.agent_of(uav)?)))
        .try_for_each(|(uav, section)| program_of(uav, section).map(drop))
}

/// The files that decide what the programs of `scenario` do: the programs, and those of their arguments that are files.
///
/// # Errors
/// As [`check`].
pub fn files(scenario: &Scenario) -> Result<Vec<PathBuf>, FindError> {
    let mut files = Vec::new();
    for uav in UavId::all(scenario.formation.uavs) {
        let Some(section) = scenario.agent_of(uav) else { continue };
        let folder = Path::new(&section.folder);
        let arguments = section.command.iter().skip(1).map(|argument| folder.join(argument));
        files.push(program_of(uav, section)?);
        files.extend(arguments.filter(|path| path.is_file()));
    }
    files.sort();
    files.dedup();
    Ok(files)
}

/// The file that `section` starts for `uav`.
pub(crate) fn program_of(uav: UavId, section: &AgentSection) -> Result<PathBuf, FindError> {
    let program = section.command.first().map_or("", String::as_str);
    found(program, Path::new(&section.folder)).map_err(|source| FindError {
        uav,
        program: program.to_owned(),
        folder: section.folder.clone(),
        source,
    })
}

fn found(program: &str, folder: &Path) -> io::Result<PathBuf> {
    if !folder.is_dir() {
        return Err(io::ErrorKind::NotADirectory.into());
    }
    // As in a shell, a name with a slash is a path and any other name is searched for in PATH. The program starts in its
    // folder, so its path is relative to that.
    if program.contains('/') {
        return executable(folder.join(program));
    }
    let path = env::var_os("PATH").unwrap_or_default();
    let places: Vec<PathBuf> =
        env::split_paths(&path).map(|place| folder.join(place).join(program)).collect();
    places.into_iter().map(executable).find(Result::is_ok).unwrap_or(Err(io::ErrorKind::NotFound.into()))
}

/// The file at `path`, if it can be executed.
fn executable(path: PathBuf) -> io::Result<PathBuf> {
    // `access` says that a folder can be executed, too.
    if path.is_dir() {
        return Err(io::ErrorKind::IsADirectory.into());
    }
    access(&path, Access::EXEC_OK)?;
    Ok(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn checked(command: &str, folder: &str) -> Result<(), String> {
        let section =
            AgentSection { folder: folder.into(), ..AgentSection::parse(&format!("3={command}")).unwrap() };
        program_of(UavId(3), &section).map(drop).map_err(|error| error.to_string())
    }

    #[test]
    fn a_program_is_looked_for_on_the_path_or_from_its_folder() {
        assert_eq!(checked("sh -c true", "/"), Ok(()));
        assert_eq!(checked("./bin/sh", "/"), Ok(()));
        let error = checked("./mine", "/").unwrap_err();
        assert!(error.starts_with("uav 3: program \"./mine\" cannot be started in /: "), "{error}");
        assert!(error.ends_with(": build it, or correct the command"), "{error}");
        for (command, folder) in [
            ("no-such-program-anywhere", "/"),
            ("./bin", "/"),
            ("sh", "/no/such/folder"),
            ("./etc/passwd", "/"),
        ] {
            assert!(checked(command, folder).is_err(), "{command} in {folder}");
        }
    }
}
