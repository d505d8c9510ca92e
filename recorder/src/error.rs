//! What can stop a recorder, and what the user can do about it.

use mcap::McapError;
use ringwing_bus::BusError;
use std::{
    io::{self, ErrorKind},
    path::{Path, PathBuf},
};

/// Why a recorder cannot go on.
#[derive(Debug, thiserror::Error)]
pub enum RecorderError {
    /// The run does not exist, or one of its services cannot be reached.
    #[error(transparent)]
    Bus(#[from] BusError),
    /// The file system refused an operation.
    #[error("log {}: cannot be {action}: {reason}; {}", path.display(), remedy(reason))]
    Log {
        /// The log, or the new file beside it during a takeover.
        path: PathBuf,
        /// What was tried: "written", "read", ...
        action: &'static str,
        /// The operating system's reason.
        reason: io::Error,
    },
    /// The file at the log's path is something else.
    #[error("log {}: {problem}; it is left as it is: choose another file with `--log`", path.display())]
    Foreign {
        /// The file.
        path: PathBuf,
        /// What it is.
        problem: &'static str,
    },
}

impl RecorderError {
    /// For `map_err`: `action` failed on the file `path`.
    pub(crate) fn log<E: Into<McapError>>(path: &Path, action: &'static str) -> impl FnOnce(E) -> Self {
        move |error| {
            // The remedy depends on the kind of the operating system's error, so unwrap it from mcap's error.
            let reason = match error.into() {
                McapError::Io(reason) => reason,
                other => io::Error::other(other),
            };
            Self::Log { path: path.to_owned(), action, reason }
        }
    }
}

fn remedy(error: &io::Error) -> &'static str {
    match error.kind() {
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded | ErrorKind::FileTooLarge => {
            "make room, choose another folder with `--out`, or fly with `--no-record`"
        }
        // `Sink` reports a log that was removed during the run this way, too.
        ErrorKind::NotFound => "leave the log and its folder in place until the run has ended",
        _ => "choose a folder that can be written with `--out`, or fly with `--no-record`",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_names_the_file_the_failure_and_the_remedy() {
        let full = io::Error::from(ErrorKind::StorageFull);
        let error = RecorderError::log(Path::new("runs/ring-k3x9ab/ring-k3x9ab.mcap"), "written")(full);
        assert_eq!(
            error.to_string(),
            "log runs/ring-k3x9ab/ring-k3x9ab.mcap: cannot be written: no storage space; make room, choose another folder with \
             `--out`, or fly with `--no-record`"
        );
    }
}
