//! The log that a user names on the command line, for every verb that reads one.
//!
//! Never opens a log; `ringwing_recorder::log::reader` does, and says what is wrong with it.

use crate::run::DEFAULT_OUT;
use std::path::{Path, PathBuf};

/// Help for such an argument.
pub(crate) const LOG_HELP: &str =
    "A run's folder, the .mcap file in it, `latest` for the newest run in `runs`, or `-` for standard input";

/// The path that `argument` means: itself, or a run in the default folder for runs, such as `latest`.
pub(crate) fn named(argument: &Path) -> PathBuf {
    let in_default = Path::new(DEFAULT_OUT).join(argument);
    // What the user can see in the working folder comes first.
    let is_bare = argument.components().count() == 1;
    if is_bare && argument.symlink_metadata().is_err() && in_default.is_dir() {
        in_default
    } else {
        argument.to_owned()
    }
}
