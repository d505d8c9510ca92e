//! Files that are whole or not there: whoever reads one never sees half of it, and a full disk leaves the old one.
//!
//! Must never write a log: a log grows, and can be read at any time.

use rustix::{
    fs::{FallocateFlags, fallocate},
    io::Errno,
};
use std::{
    ffi::OsString,
    fs::{self, File},
    io,
    path::{Path, PathBuf},
};

/// Writes `bytes` to the file `path`: first beside it, then to its place in one step. If that fails, the file stays as it
/// was, and nothing else is left behind.
pub fn write_whole(path: &Path, bytes: impl AsRef<[u8]>) -> io::Result<()> {
    write_whole_by(path, |draft| fs::write(draft, bytes))
}

/// Copies the file `from` to `to`, which is complete or not there.
pub fn copy_whole(from: &Path, to: &Path) -> io::Result<()> {
    write_whole_by(to, |draft| fs::copy(from, draft).map(drop))
}

/// Gives `file` the disk space or memory for its first `bytes` now, so that a lack of it is an error here and not, much later,
/// a signal in whoever maps the file.
pub(crate) fn allocate(file: &File, bytes: u64) -> io::Result<()> {
    match fallocate(file, FallocateFlags::empty(), 0, bytes) {
        // This file system cannot do it.
        Err(Errno::OPNOTSUPP) if bytes > file.metadata()?.len() => file.set_len(bytes),
        Err(Errno::OPNOTSUPP) => Ok(()),
        // It has no beginning to give space to.
        Err(Errno::INVAL) if bytes == 0 => Ok(()),
        done => Ok(done?),
    }
}

/// Makes the file `path` in one step of what `write` writes to the draft whose name it gets.
pub fn write_whole_by(path: &Path, write: impl FnOnce(&Path) -> io::Result<()>) -> io::Result<()> {
    let draft = draft_of(path);
    write(&draft).and_then(|()| fs::rename(&draft, path)).inspect_err(|_| {
        // The first error says what is wrong. A draft that cannot be removed either changes nothing about it.
        let _ = fs::remove_file(&draft);
    })
}

/// The name under which `path` is written: in the same folder, because a file can only be renamed within a file system.
fn draft_of(path: &Path) -> PathBuf {
    let mut name = path.file_name().map_or_else(OsString::new, ToOwned::to_owned);
    name.push(".draft");
    path.with_file_name(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect()
    }

    #[test]
    fn a_file_is_replaced_in_one_step_and_no_draft_stays() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("summary.json");
        for text in ["old", "new"] {
            write_whole(&path, text).unwrap();
            assert_eq!(fs::read_to_string(&path).unwrap(), text);
        }
        copy_whole(&path, &folder.path().join("copy")).unwrap();
        assert_eq!(fs::read_to_string(folder.path().join("copy")).unwrap(), "new");
        assert_eq!(names(folder.path()).len(), 2, "{:?}", names(folder.path()));
    }

    #[test]
    fn a_failure_leaves_neither_half_a_file_nor_a_draft() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("place");
        // Nothing can be renamed to the place of a folder: the draft is written, and then has to go.
        fs::create_dir(&path).unwrap();
        assert!(write_whole(&path, "text").is_err());
        assert!(copy_whole(Path::new("/no/such/file"), &path).is_err());
        assert_eq!(names(folder.path()), ["place"]);
        assert!(write_whole(Path::new("/proc/no/such"), "text").is_err());
    }
}
