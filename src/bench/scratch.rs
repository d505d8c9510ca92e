//! The temporary folder of a benchmark; one whose benchmark was killed is removed by the next, or by `ringwing clean`.

use rustix::fs::{FlockOperation, flock};
use std::{
    env,
    fs::{self, File},
    io,
    os::unix::fs::MetadataExt,
    path::{Path, PathBuf},
};
use tempfile::TempDir;

const PREFIX: &str = "ringwing_bench_";

/// A folder that is locked as long as its benchmark lives, and removed with it.
#[derive(Debug)]
pub(super) struct Scratch {
    folder: TempDir,
    _lock: File,
}

impl Scratch {
    pub(super) fn new() -> io::Result<Self> {
        remove_abandoned();
        loop {
            let folder = tempfile::Builder::new().prefix(PREFIX).tempdir()?;
            if let Some(lock) = locked(folder.path())? {
                return Ok(Self { folder, _lock: lock });
            }
        }
    }

    pub(super) fn path(&self) -> &Path {
        self.folder.path()
    }
}

/// Removes the folder of every benchmark that is gone; returns which.
pub(crate) fn remove_abandoned() -> Vec<PathBuf> {
    let entries = fs::read_dir(env::temp_dir()).into_iter().flatten().flatten();
    let folders = entries.filter(|entry| entry.file_name().to_string_lossy().starts_with(PREFIX));
    let abandoned = folders.map(|entry| entry.path()).filter(|folder| {
        // Another user's is not for us to open, and not for us to remove.
        locked(folder).is_ok_and(|lock| lock.is_some_and(|_lock| fs::remove_dir_all(folder).is_ok()))
    });
    abandoned.collect()
}

/// The lock of `folder`; none while somebody else has it, or if the folder was removed meanwhile.
fn locked(folder: &Path) -> io::Result<Option<File>> {
    let lock = match File::open(folder) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        opened => opened?,
    };
    let is_ours = flock(&lock, FlockOperation::NonBlockingLockExclusive).is_ok();
    let is_there =
        fs::metadata(folder).is_ok_and(|meta| lock.metadata().is_ok_and(|ours| ours.ino() == meta.ino()));
    Ok((is_ours && is_there).then_some(lock))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_lives_as_long_as_its_benchmark_and_no_longer() {
        let scratch = Scratch::new().unwrap();
        let (living, abandoned) =
            (scratch.path().to_owned(), tempfile::Builder::new().prefix(PREFIX).tempdir());
        let abandoned = abandoned.unwrap().keep();
        fs::write(abandoned.join("trace"), "left").unwrap();
        assert!(!remove_abandoned().contains(&living) && living.exists());
        assert!(!abandoned.exists(), "by us, or by a benchmark beside this test");
        drop(scratch);
        assert!(!living.exists());
    }
}
