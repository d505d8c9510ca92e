//! Why a file cannot be read as a log, and what to do about it.

use mcap::MAGIC;
use std::{
    io::{self, Read, Seek},
    path::{Path, PathBuf},
};

/// Why a file is not read.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// The file system refused.
    #[error("log {}: cannot be read: {source}; give the path of a run's `run.mcap`", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// The operating system's reason.
        source: io::Error,
    },
    /// It is a folder, a device, ...
    #[error("log {}: is not a file; give the path of a run's `run.mcap`", path.display())]
    NoFile {
        /// What it is not.
        path: PathBuf,
    },
    /// It does not begin as an MCAP file does.
    #[error("log {}: {problem}; give the path of a run's `run.mcap`", path.display())]
    NoLog {
        /// The file.
        path: PathBuf,
        /// What it is instead.
        problem: &'static str,
    },
    /// An MCAP file, but not a log of ours, or one that lost its beginning.
    #[error("log {}: {problem}", path.display())]
    Foreign {
        /// The file.
        path: PathBuf,
        /// What is missing.
        problem: &'static str,
    },
    /// The scenario in it is not one that this version knows.
    #[error(
        "log {}: was written by ringwing {}, and this is {}, to which its scenario says nothing: {problems}; \
         read it with the version that wrote it", path.display(), or_unknown(version), env!("CARGO_PKG_VERSION")
    )]
    Scenario {
        /// The file.
        path: PathBuf,
        /// The version that the log names.
        version: String,
        /// What is wrong with its scenario.
        problems: String,
    },
}

impl ReadError {
    pub(super) fn foreign(path: &Path, has_run: bool) -> Self {
        let problem = if has_run {
            "the attachment `scenario.toml` is lost, and without it nothing can be measured; any MCAP viewer shows what \
             is left"
        } else {
            "is an MCAP file, but no log of ringwing, or nothing is left of its beginning: it has no attachment \
             `scenario.toml`; any MCAP viewer shows what it holds"
        };
        Self::Foreign { path: path.to_owned(), problem }
    }
}

fn or_unknown(version: &str) -> &str {
    if version.is_empty() { "of an unknown version" } else { version }
}

/// Demands that `source` begins as an MCAP file does.
pub(super) fn check_magic(path: &Path, source: &mut (impl Read + Seek)) -> Result<(), ReadError> {
    let mut begin = Vec::new();
    let length = MAGIC.len();
    let read = source.rewind().and_then(|()| source.by_ref().take(length as u64).read_to_end(&mut begin));
    read.map_err(|source| ReadError::Unreadable { path: path.to_owned(), source })?;
    let problem = match begin.as_slice() {
        [] => "is empty",
        whole if whole == MAGIC => return Ok(()),
        part if MAGIC.starts_with(part) => "is cut off within its first 8 bytes: nothing is left of it",
        _ => "is not an MCAP file",
    };
    Err(ReadError::NoLog { path: path.to_owned(), problem })
}
