//! Why a file cannot be read as a log, and what the user can do about it.

use mcap::MAGIC;
use std::{
    collections::BTreeMap,
    io::{self, Read, Seek},
    path::{Path, PathBuf},
};

/// Why a file cannot be read as a log.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// The operating system refused to open or read the file.
    #[error("log {}: cannot be read: {source}; give a run's folder, or the .mcap file in it", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// The operating system's reason.
        source: io::Error,
    },
    /// The path names a device or a pipe.
    #[error(
        "log {}: is {kind} and not a file; give a run's folder, or the .mcap file in it, or `-` to read a log that is \
         piped into standard input", path.display()
    )]
    NotAFile {
        /// The path.
        path: PathBuf,
        /// What it is.
        kind: &'static str,
    },
    /// The path names a folder that does not tell which log is meant.
    #[error(
        "log {}: is a folder that holds {}; give a run's folder, or the .mcap file in it", path.display(),
        if logs.is_empty() { "no log".into() } else { format!("several logs: {logs}") }
    )]
    Folder {
        /// The folder.
        path: PathBuf,
        /// The logs in it, separated by commas.
        logs: String,
    },
    /// There is no room for the temporary copy of a log that is compressed, piped or out of order.
    #[error(
        "log {}: cannot be copied to {}: {source}; make room there, or set TMPDIR to another folder",
        path.display(), folder.display()
    )]
    NoRoom {
        /// The log.
        path: PathBuf,
        /// The folder of the copy.
        folder: PathBuf,
        /// The operating system's reason.
        source: io::Error,
    },
    /// The file does not begin as MCAP files do.
    #[error("log {}: {problem}; give a run's folder, or the .mcap file in it", path.display())]
    NotALog {
        /// The file.
        path: PathBuf,
        /// What it is instead.
        problem: &'static str,
    },
    /// Another program has joined the logs of two flights.
    #[error("log {}: holds two flights{flights}; read the log of each by itself", path.display())]
    TwoFlights {
        /// The file.
        path: PathBuf,
        /// Name and seed of each, if they are known.
        flights: String,
    },
    /// An MCAP file without a scenario: from another program, or cut before the scenario.
    #[error("log {}: {problem}", path.display())]
    NoScenario {
        /// The file.
        path: PathBuf,
        /// What is missing.
        problem: &'static str,
    },
    /// This version of ringwing rejects the log's scenario.
    #[error(
        "log {}: was written by ringwing {}, and this is ringwing {}, which cannot read its scenario: {problems}; \
         read the log with the version that wrote it", path.display(), or_unknown(version), env!("CARGO_PKG_VERSION")
    )]
    Scenario {
        /// The file.
        path: PathBuf,
        /// The version that wrote the log; empty if it is unknown.
        version: String,
        /// What is wrong with the scenario.
        problems: String,
    },
}

impl ReadError {
    /// The log at `path` has no scenario; `has_run` tells that it is one of ringwing's.
    pub(super) fn without_scenario(path: &Path, has_run: bool) -> Self {
        let problem = if has_run {
            "its attachment `scenario.toml` is missing, and the flight cannot be measured without it; a program that \
             rewrote the log may need an option for attachments, such as `--include-attachments` of `mcap filter`"
        } else {
            "is an MCAP file but not a log of ringwing, or a program that rewrote it left its attachment `scenario.toml` \
             out: `mcap filter` keeps it with `--include-attachments --include-metadata`"
        };
        Self::NoScenario { path: path.to_owned(), problem }
    }

    /// The log at `path` holds these different metadata records `run`, or other records of two flights.
    pub(super) fn two_flights(path: &Path, runs: &[BTreeMap<String, String>]) -> Self {
        let name =
            |run: &BTreeMap<String, String>| Some(format!("{}, seed {}", run.get("name")?, run.get("seed")?));
        let names: Vec<String> = runs.iter().filter_map(name).collect();
        // With a single `run`, the flights differ in another record, and its name would tell of one flight alone.
        let flights = if names.len() > 1 { format!(": {}", names.join(" and ")) } else { String::new() };
        Self::TwoFlights { path: path.to_owned(), flights }
    }

    /// There is no room for a copy of the log at `path`.
    pub(in crate::log) fn no_room(path: &Path, source: io::Error) -> Self {
        Self::NoRoom { path: path.to_owned(), folder: std::env::temp_dir(), source }
    }
}

fn or_unknown(version: &str) -> &str {
    if version.is_empty() { "of an unknown version" } else { version }
}

/// The first bytes of `source`, up to the length of MCAP's magic.
pub(super) fn begin_of(path: &Path, source: &mut (impl Read + Seek)) -> Result<Vec<u8>, ReadError> {
    let mut begin = Vec::new();
    // Read what there is instead of exactly eight bytes: an empty file and a cut one need messages of their own.
    let read =
        source.rewind().and_then(|()| source.by_ref().take(MAGIC.len() as u64).read_to_end(&mut begin));
    read.map(|_| begin).map_err(|source| ReadError::Unreadable { path: path.to_owned(), source })
}

/// Says what a file is that holds no record and has this `begin`; MCAP's magic alone is a log that was cut.
pub(super) fn check_begin(path: &Path, begin: &[u8]) -> Result<(), ReadError> {
    let problem = match begin {
        [] => "is empty",
        complete if complete == MAGIC => return Ok(()),
        part if MAGIC.starts_with(part) => "is cut off within its first 8 bytes, so nothing of it is left",
        _ => "is not an MCAP file",
    };
    Err(ReadError::NotALog { path: path.to_owned(), problem })
}
