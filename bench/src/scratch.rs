//! The temporary folder of a benchmark.
//!
//! The folder is locked while its benchmark lives. If the benchmark is killed, the next one removes the folder, and so does
//! `ringwing clean`.
//!
//! Must never remove a folder that is locked, or that another user owns.

use rustix::fs::{FlockOperation, flock};
use std::{
    env,
    fs::{self, File},
    io,
    os::unix::fs::MetadataExt,
    path::{Path, PathBuf},
};
use tempfile::TempDir;

/// Names the folders of benchmarks. Cleaning up removes every unlocked folder whose name begins like this.
const PREFIX: &str = "ringwing_bench_";

/// A locked folder that is removed when dropped.
#[derive(Debug)]
pub(crate) struct Scratch {
    folder: TempDir,
    _lock: File,
}

impl Scratch {
    pub(crate) fn new() -> io::Result<Self> {
        remove_abandoned();
        // Another benchmark may remove the folder between its creation and its locking: try again.
        loop {
            let folder = tempfile::Builder::new().prefix(PREFIX).tempdir()?;
            if let Some(lock) = locked(folder.path())? {
                return Ok(Self { folder, _lock: lock });
            }
        }
    }

    pub(crate) fn path(&self) -> &Path {
        self.folder.path()
    }
}

/// Removes the folders of all benchmarks that are gone, and returns their paths.
pub fn remove_abandoned() -> Vec<PathBuf> {
    let entries = fs::read_dir(env::temp_dir()).into_iter().flatten().flatten();
    let folders = entries.filter(|entry| entry.file_name().to_string_lossy().starts_with(PREFIX));
    let abandoned = folders.map(|entry| entry.path()).filter(|folder| {
        // The folder of another user cannot be opened, and is left alone.
        locked(folder).is_ok_and(|lock| lock.is_some_and(|_lock| fs::remove_dir_all(folder).is_ok()))
    });
    abandoned.collect()
}

/// Locks `folder`; returns `None` if another process holds the lock or has removed the folder meanwhile.
fn locked(folder: &Path) -> io::Result<Option<File>> {
    let lock = match File::open(folder) {
        // Somebody else has removed it since it was listed.
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        opened => opened?,
    };
    let is_ours = flock(&lock, FlockOperation::NonBlockingLockExclusive).is_ok();
    // The lock may belong to a folder that is no longer at this path.
    let is_in_place =
        fs::metadata(folder).is_ok_and(|meta| lock.metadata().is_ok_and(|ours| ours.ino() == meta.ino()));
    Ok((is_ours && is_in_place).then_some(lock))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_lives_exactly_as_long_as_its_benchmark() {
        let scratch = Scratch::new().unwrap();
        let (living, abandoned) =
            (scratch.path().to_owned(), tempfile::Builder::new().prefix(PREFIX).tempdir());
        let abandoned = abandoned.unwrap().keep();
        fs::write(abandoned.join("trace"), "left").unwrap();
        assert!(!remove_abandoned().contains(&living) && living.exists());
        assert!(!abandoned.exists(), "removed by this test, or by a benchmark that runs beside it");
        drop(scratch);
        assert!(!living.exists());
    }
}
