//! Opens the log that a user names: a file, a run's folder, or standard input, compressed as a whole or not.
//!
//! Never reads from a device or a named pipe, which might never end, and never guesses between two logs.

use super::reader::error::ReadError;
use mcap::MAGIC;
use std::{
    fs::{self, File},
    io::{self, BufReader, BufWriter, Read, Seek, Write},
    os::{fd::AsFd, unix::fs::FileTypeExt},
    path::{Path, PathBuf},
};

/// The name of standard input on the command line.
pub const STANDARD_INPUT: &str = "-";
/// How every Zstandard frame begins, by RFC 8878.
const ZSTD_MAGIC: [u8; 4] = [0x28, 0xb5, 0x2f, 0xfd];
/// The name of a log in its run's folder, as earlier versions had it.
const EARLIER_NAME: &str = "run.mcap";
/// Bytes of a pipe that are kept if they do not begin as a log does. More fills the disk if the pipe never ends; fewer
/// could lose a log whose first bytes are damaged.
const LONGEST_NOISE: u64 = 64 << 20;
/// Bytes copied at once.
const COPY_BYTES: usize = 1 << 16;

/// A log that is open for reading.
#[derive(Debug)]
pub(crate) struct LogInput {
    /// What the file is called in messages.
    pub(crate) path: PathBuf,
    /// Its content, not compressed as a whole.
    pub(crate) file: File,
    /// Why not all of it could be unpacked, if so.
    pub(crate) problem: Option<String>,
}

/// The file that `log` names: the log in it, if it is the folder of a run.
pub fn locate(log: &Path) -> Result<PathBuf, ReadError> {
    if log == Path::new(STANDARD_INPUT) || !log.is_dir() {
        return Ok(log.to_owned());
    }
    let unreadable = |source| ReadError::Unreadable { path: log.to_owned(), source };
    // The run's own name is needed, which is that of the folder and not that of a link to it.
    let folder = log.canonicalize().map_err(unreadable)?;
    let mut logs = Vec::new();
    for entry in fs::read_dir(&folder).map_err(unreadable)? {
        logs.extend(entry.map_err(unreadable)?.file_name().into_string().ok().filter(|name| is_log(name)));
    }
    logs.sort();
    let own = folder.file_name().map(|name| format!("{}.mcap", name.to_string_lossy()));
    // A recovered or packed copy may lie beside the log. Without this order, it would make the folder ambiguous.
    let preferred = [own.as_deref(), Some(EARLIER_NAME)];
    let found = preferred.into_iter().flatten().find(|name| logs.iter().any(|log| log == name));
    match (found, logs.as_slice()) {
        (Some(name), _) => Ok(log.join(name)),
        (None, [only]) => Ok(log.join(only)),
        (None, several) => Err(ReadError::Folder { path: log.to_owned(), logs: several.join(", ") }),
    }
}

fn is_log(name: &str) -> bool {
    [".mcap", ".mcap.zst"].iter().any(|end| name.ends_with(end))
}

/// Opens the log that `log` names.
pub(crate) fn open(log: &Path) -> Result<LogInput, ReadError> {
    let path = locate(log)?;
    let file = if path == Path::new(STANDARD_INPUT) { open_standard_input() } else { open_file(&path) }?;
    unpacked(path, file)
}

fn open_file(path: &Path) -> Result<File, ReadError> {
    let unreadable = |source| ReadError::Unreadable { path: path.to_owned(), source };
    // Before opening it: to open a pipe waits for its writer.
    let kind = fs::metadata(path).map_err(unreadable)?.file_type();
    if !kind.is_file() {
        let kind = if kind.is_fifo() { "a pipe" } else { "a device" };
        return Err(ReadError::NotAFile { path: path.to_owned(), kind });
    }
    File::open(path).map_err(unreadable)
}

/// Standard input as a file with a beginning: the file itself, or a copy of what comes through a pipe.
fn open_standard_input() -> Result<File, ReadError> {
    let path = || PathBuf::from(STANDARD_INPUT);
    let unreadable = |source| ReadError::Unreadable { path: path(), source };
    // A duplicate, because dropping the file would close standard input.
    let input = io::stdin().as_fd().try_clone_to_owned().map(File::from).map_err(unreadable)?;
    let kind = input.metadata().map_err(unreadable)?.file_type();
    if kind.is_file() {
        Ok(input)
    } else if kind.is_fifo() || kind.is_socket() {
        copy_of_pipe(input, &path())
    } else {
        Err(ReadError::NotAFile { path: path(), kind: "a terminal or a device" })
    }
}

fn copy_of_pipe(pipe: impl Read, path: &Path) -> Result<File, ReadError> {
    let mut pipe = BufReader::new(pipe);
    let mut start = Vec::new();
    let unreadable = |source| ReadError::Unreadable { path: path.to_owned(), source };
    pipe.by_ref().take(MAGIC.len() as u64).read_to_end(&mut start).map_err(unreadable)?;
    // A pipe cannot be rewound, so `start` is put in front of the rest below.
    let is_known = start == MAGIC || start.starts_with(&ZSTD_MAGIC);
    let most = if is_known { u64::MAX } else { LONGEST_NOISE };
    let Copied { file, problem } = copy(start.as_slice().chain(pipe).take(most), path)?;
    match problem {
        Some(source) => Err(unreadable(source)),
        None => Ok(file),
    }
}

/// `file`, or what it holds if it is compressed as a whole.
fn unpacked(path: PathBuf, mut file: File) -> Result<LogInput, ReadError> {
    let mut start = Vec::new();
    let unreadable = |source| ReadError::Unreadable { path: path.clone(), source };
    file.rewind()
        .and_then(|()| (&file).take(ZSTD_MAGIC.len() as u64).read_to_end(&mut start))
        .and_then(|_| file.rewind())
        .map_err(unreadable)?;
    if start != ZSTD_MAGIC {
        return Ok(LogInput { path, file, problem: None });
    }
    let decoder = zstd::Decoder::new(file).map_err(unreadable)?;
    let Copied { file, problem } = copy(decoder, &path)?;
    // What was unpacked before the error is worth reading.
    let problem = problem.map(|error| format!("the compressed file cannot be unpacked to its end: {error}"));
    Ok(LogInput { path, file, problem })
}

/// A copy of a source, up to the error that ended it.
struct Copied {
    file: File,
    problem: Option<io::Error>,
}

/// Copies `source` into a file without a name, which disappears when it is closed.
fn copy(mut source: impl Read, path: &Path) -> Result<Copied, ReadError> {
    let full = |source| ReadError::no_room(path, source);
    let mut copy = BufWriter::new(tempfile::tempfile().map_err(full)?);
    let mut buffer = vec![0; COPY_BYTES];
    let problem = loop {
        match source.read(&mut buffer) {
            Ok(0) => break None,
            Ok(bytes) => copy.write_all(&buffer[..bytes]).map_err(full)?,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            // Left to the caller, because what came before the error may be worth reading.
            Err(error) => break Some(error),
        }
    };
    let file = copy.into_inner().map_err(|error| full(error.into_error()))?;
    Ok(Copied { file, problem })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{record, small_log};
    use std::os::unix::fs::symlink;

    fn content(mut input: LogInput) -> Vec<u8> {
        let mut content = Vec::new();
        input.file.rewind().unwrap();
        input.file.read_to_end(&mut content).unwrap();
        content
    }

    #[test]
    fn a_folder_stands_for_the_log_of_its_run() {
        let out = tempfile::tempdir().unwrap();
        let (run, link) = (out.path().join("ring-k3x9ab"), out.path().join("latest"));
        fs::create_dir(&run).unwrap();
        symlink("ring-k3x9ab", &link).unwrap();
        let refused = |folder: &Path| locate(folder).unwrap_err().to_string();
        assert!(refused(&run).contains("holds no log"), "{}", refused(&run));
        for (added, expected) in [
            ("copy.mcap.zst", "copy.mcap.zst"),
            ("run.mcap", "run.mcap"),
            ("ring-k3x9ab-recovered.mcap", "run.mcap"),
            ("ring-k3x9ab.mcap", "ring-k3x9ab.mcap"),
        ] {
            fs::write(run.join(added), "").unwrap();
            assert_eq!(locate(&run).unwrap(), run.join(expected));
            assert_eq!(locate(&link).unwrap(), link.join(expected));
        }
        for named in ["run.mcap", "ring-k3x9ab.mcap"] {
            fs::remove_file(run.join(named)).unwrap();
        }
        let error = refused(&run);
        assert!(error.contains("copy.mcap.zst, ring-k3x9ab-recovered.mcap"), "{error}");
    }

    #[test]
    fn a_compressed_log_is_unpacked_as_far_as_it_goes() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log.mcap.zst");
        let log = small_log(record);
        let packed = zstd::encode_all(log.as_slice(), 1).unwrap();
        fs::write(&path, &packed).unwrap();
        let whole = open(&path).unwrap();
        assert!(whole.problem.is_none());
        assert_eq!(content(whole), log);
        fs::write(&path, &packed[..packed.len() - 9]).unwrap();
        let cut = open(&path).unwrap();
        assert!(cut.problem.as_ref().unwrap().contains("incomplete frame"), "{cut:?}");
        assert!(log.starts_with(&content(cut)));
    }

    #[test]
    fn a_pipe_is_read_to_its_end_unless_it_brings_noise() {
        let log = small_log(record);
        let path = Path::new(STANDARD_INPUT);
        assert_eq!(copy_of_pipe(log.as_slice(), path).unwrap().metadata().unwrap().len(), log.len() as u64);
        let noise = copy_of_pipe(io::repeat(7), path).unwrap();
        assert_eq!(noise.metadata().unwrap().len(), LONGEST_NOISE);
    }

    #[test]
    fn what_is_not_a_file_is_refused_without_waiting() {
        let folder = tempfile::tempdir().unwrap();
        let pipe = folder.path().join("pipe");
        let made = std::process::Command::new("mkfifo").arg(&pipe).status().unwrap();
        assert!(made.success());
        for (path, reason) in [
            (pipe.as_path(), "is a pipe"),
            (Path::new("/dev/zero"), "is a device"),
            (Path::new("/nowhere/run.mcap"), "No such file or directory"),
        ] {
            let error = open(path).unwrap_err().to_string();
            assert!(error.contains(reason) && error.contains(&path.display().to_string()), "{error}");
        }
    }
}
