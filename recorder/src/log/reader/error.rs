//! Why a file cannot be read as a log, and what the user can do about it.

use mcap::MAGIC;
use std::{
    io::{self, Read, Seek},
    path::{Path, PathBuf},
};

/// Why a file cannot be read as a log.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// The operating system refused to open or read the file.
    #[error("log {}: cannot be read: {source}; give the path of a run's `run.mcap`", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// The operating system's reason.
        source: io::Error,
    },
    /// The path names a folder, a device or a pipe.
    #[error("log {}: is not a file; give the path of a run's `run.mcap`", path.display())]
    NotAFile {
        /// The path.
        path: PathBuf,
    },
    /// The file does not begin as MCAP files do.
    #[error("log {}: {problem}; give the path of a run's `run.mcap`", path.display())]
    NotALog {
        /// The file.
        path: PathBuf,
        /// What it is instead.
        problem: &'static str,
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
            "its attachment `scenario.toml` is lost, and the flight cannot be measured without it; any MCAP viewer \
             shows what is left"
        } else {
            "is an MCAP file but not a log of ringwing, or it lost its beginning: it has no attachment \
             `scenario.toml`; any MCAP viewer shows what it holds"
        };
        Self::NoScenario { path: path.to_owned(), problem }
    }
}

fn or_unknown(version: &str) -> &str {
    if version.is_empty() { "of an unknown version" } else { version }
}

/// Returns an error unless `source` begins with MCAP's magic.
pub(super) fn check_magic(path: &Path, source: &mut (impl Read + Seek)) -> Result<(), ReadError> {
    let mut begin = Vec::new();
    let length = MAGIC.len();
    // Read what there is instead of exactly eight bytes: an empty file and a cut one need messages of their own.
    let read = source.rewind().and_then(|()| source.by_ref().take(length as u64).read_to_end(&mut begin));
    read.map_err(|source| ReadError::Unreadable { path: path.to_owned(), source })?;
    let problem = match begin.as_slice() {
        [] => "is empty",
        complete if complete == MAGIC => return Ok(()),
        part if MAGIC.starts_with(part) => "is cut off within its first 8 bytes, so nothing of it is left",
        _ => "is not an MCAP file",
    };
    Err(ReadError::NotALog { path: path.to_owned(), problem })
}
