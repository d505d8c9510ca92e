//! The programs of the user's that fly UAVs in place of the built-in law, as `[[agents]]` names them.
//!
//! Must never decide which UAV flies with which program: the scenario does.

use super::LaunchError;
use ringwing_flight::UavId;
use ringwing_scenario::{AgentSection, Scenario};
use rustix::fs::{Access, access};
use std::{
    env, io,
    path::{Path, PathBuf},
    process::Command,
};

/// Makes Python write each line at once. A killed process would lose what it has not written.
const UNBUFFERED: (&str, &str) = ("PYTHONUNBUFFERED", "1");

/// Checks that each program of `scenario` can be started, so that a typing error does not become a flight without agents.
pub(super) fn check(scenario: &Scenario) -> Result<(), LaunchError> {
    UavId::all(scenario.formation.uavs)
        .filter_map(|uav| Some((uav, scenario.agent_of(uav)?)))
        .try_for_each(|(uav, section)| check_one(uav, section))
}

fn check_one(uav: UavId, section: &AgentSection) -> Result<(), LaunchError> {
    let program = section.command.first().map_or("", String::as_str);
    let problem = |source| LaunchError::Program {
        uav,
        program: program.to_owned(),
        folder: section.folder.clone(),
        source,
    };
    let folder = Path::new(&section.folder);
    if !folder.is_dir() {
        return Err(problem(io::Error::from(io::ErrorKind::NotADirectory)));
    }
    // As in a shell, a name with a slash is a path and any other is looked for in PATH. The program starts in its
    // folder, so its path is relative to that.
    let found = if program.contains('/') {
        executable(&folder.join(program))
    } else {
        let path = env::var_os("PATH").unwrap_or_default();
        let places: Vec<PathBuf> = env::split_paths(&path).map(|place| place.join(program)).collect();
        let not_found = Err(io::Error::from(io::ErrorKind::NotFound));
        places.iter().map(|place| executable(place)).find(Result::is_ok).unwrap_or(not_found)
    };
    found.map_err(problem)
}

/// Whether the file at `path` can be executed.
fn executable(path: &Path) -> io::Result<()> {
    // `access` says that a folder can be executed, too.
    if path.is_dir() {
        return Err(io::Error::from(io::ErrorKind::IsADirectory));
    }
    Ok(access(path, Access::EXEC_OK)?)
}

/// Makes `command`, which starts this executable, become the program of `section` with `arguments` added.
pub(super) fn set_command(command: &mut Command, section: &AgentSection, arguments: &[String]) {
    // The program may not know how to end with its launcher, so `ringwing exec` arranges that and becomes the program.
    let launcher = std::process::id().to_string();
    command
        .args(["exec", "--launcher", &launcher, "--folder", &section.folder, "--"])
        .args(&section.command)
        .args(arguments)
        .env(UNBUFFERED.0, UNBUFFERED.1);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn checked(command: &str, folder: &str) -> Result<(), String> {
        let section =
            AgentSection { folder: folder.into(), ..AgentSection::parse(&format!("3={command}")).unwrap() };
        check_one(UavId(3), &section).map_err(|error| error.to_string())
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
