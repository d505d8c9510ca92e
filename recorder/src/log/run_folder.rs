//! The folder of a run: what it is called, which log is in it, and how a user names it.
//!
//! Never opens a log; [`reader`](super::reader) does, and says what is wrong with it.

use ringwing_scenario::Scenario;
use std::{
    fs, io,
    os::unix::fs::symlink,
    path::{Path, PathBuf},
};

/// The folder for the folders of runs, below the working folder.
pub const DEFAULT_OUT: &str = "runs";
/// How a user may name a log, for help texts.
pub const LOG_HELP: &str =
    "A run's folder, the .mcap file in it, `latest` for the newest run in `runs`, or `-` for standard input";
/// The link beside the folders of runs that leads to the newest one.
const LATEST: &str = "latest";
/// The scenario as it was flown, with every key.
const SCENARIO: &str = "scenario.toml";

/// Makes `<out>/<name>-<id>/` with the resolved scenario. `id` tells the runs of a scenario apart.
///
/// # Errors
/// The path that cannot be written, and why.
pub fn create(out: &Path, scenario: &Scenario, id: &str) -> Result<PathBuf, (PathBuf, io::Error)> {
    let folder = out.join(format!("{}-{id}", scenario.name));
    fs::create_dir_all(&folder).map_err(|error| (folder.clone(), error))?;
    let file = folder.join(SCENARIO);
    ringwing_bus::write_whole(&file, scenario.to_toml()).map_err(|error| (file, error))?;
    Ok(folder)
}

/// Lets `latest`, beside the `folder` of a run, lead to it.
pub fn link_latest(folder: &Path) {
    let Some(run) = folder.file_name() else { return };
    let (link, draft) = (folder.with_file_name(LATEST), folder.join(LATEST));
    // A file or folder of that name is the user's.
    if link.symlink_metadata().is_ok_and(|found| !found.is_symlink()) {
        return;
    }
    // Moved into place in one step, because runs may start at the same time. On a file system without links, only a
    // convenience is lost.
    if symlink(run, &draft).and_then(|()| fs::rename(&draft, link)).is_err() {
        let _ = fs::remove_file(draft);
    }
}

/// The log in the `folder` of a run. It is named after the run, because viewers show a file's name and not its folder.
pub fn log_in(folder: &Path) -> PathBuf {
    let run = folder.file_name().unwrap_or_default().to_string_lossy();
    folder.join(format!("{run}.mcap"))
}

/// The folder for what the user's own programs print, in the `folder` of a run.
pub fn output_in(folder: &Path) -> PathBuf {
    folder.join("output")
}

/// The path that a user means by `argument`: itself, or a run in the default folder for runs, such as `latest`.
pub fn named(argument: &Path) -> PathBuf {
    named_in(Path::new(DEFAULT_OUT), argument)
}

/// As [`named`], with the folders of runs in `runs`.
pub fn named_in(runs: &Path, argument: &Path) -> PathBuf {
    let in_default = runs.join(argument);
    // What the user can see in the working folder comes first.
    let is_bare = argument.components().count() == 1;
    // An error about `latest` has to say where it was looked for: people forget in which folder they flew.
    let is_run = in_default.is_dir() || argument == Path::new(LATEST);
    if is_bare && argument.symlink_metadata().is_err() && is_run { in_default } else { argument.to_owned() }
}
