//! The files that long searches leave behind: tables that grow by a line a flight, and files that are written whole.
//!
//! A line is one write, so a killed process leaves whole lines and at most one torn last line, which is cut off when the
//! table is opened again. Never knows what a line says.

use std::{
    fs::{self, File, OpenOptions},
    io::{self, BufRead, BufReader, BufWriter, Seek, Write},
    os::unix::fs::PermissionsExt,
    path::{Path, PathBuf},
};
use tempfile::NamedTempFile;

/// Why results cannot be read or written.
#[derive(Debug, thiserror::Error)]
pub enum ResultsError {
    /// The system's reason.
    #[error("{}: cannot be {what}: {source}", path.display())]
    File {
        /// The file or folder.
        path: PathBuf,
        /// What was tried: `read`, `written`.
        what: &'static str,
        /// The reason.
        source: io::Error,
    },
    /// The folder holds something else.
    #[error("{}: {problem}", path.display())]
    Other {
        /// The file or folder.
        path: PathBuf,
        /// What is wrong, and what to do about it.
        problem: String,
    },
}

impl ResultsError {
    pub(crate) fn file(path: &Path, what: &'static str) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_owned();
        move |source| Self::File { path, what, source }
    }

    pub(crate) fn other(path: &Path, problem: impl Into<String>) -> Self {
        Self::Other { path: path.to_owned(), problem: problem.into() }
    }
}

/// Writes `path` through a file beside it, so that nobody ever finds half of it.
///
/// # Errors
/// The file cannot be written; what was there before stays.
pub fn replace(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
) -> Result<(), ResultsError> {
    // Shards on several machines may write the same file at the same time, so the name of the other file is drawn.
    let folder = path.parent().unwrap_or(Path::new("."));
    let written = NamedTempFile::new_in(folder).and_then(|beside| {
        let mut file = BufWriter::new(beside.reopen()?);
        write(&mut file)?;
        file.into_inner().map_err(io::IntoInnerError::into_error)?;
        // A drawn file is for its owner only, and results are for everybody who may see the folder.
        beside.as_file().set_permissions(fs::Permissions::from_mode(0o644))?;
        beside.persist(path).map(drop).map_err(|error| error.error)
    });
    written.map_err(ResultsError::file(path, "written"))
}

/// Refuses to touch the table at `path` while another process appends to it.
///
/// # Errors
/// Another process has it, or it cannot be opened.
pub fn refuse_if_in_use(path: &Path) -> Result<(), ResultsError> {
    lock(&File::open(path).map_err(ResultsError::file(path, "opened"))?, path)
}

/// Locks an open table against other processes. The lock goes with the file, and so with the process, however it ends.
fn lock(file: &File, path: &Path) -> Result<(), ResultsError> {
    let why = "another process writes these flights: wait for it, or choose another folder with --out";
    file.try_lock().map_err(|_| ResultsError::other(path, why))
}

/// A table of CSV that is open for appending, and locked against other processes.
pub(crate) struct LineFile {
    path: PathBuf,
    file: File,
}

impl LineFile {
    /// Opens the table at `path`, or begins it with `header`, and hands each line that is there to `each`, with the byte
    /// at which it begins. A torn last line is cut off.
    pub(crate) fn open(
        path: &Path,
        header: &[u8],
        each: impl FnMut(&[u8], u64) -> Result<(), ResultsError>,
    ) -> Result<Self, ResultsError> {
        let file = OpenOptions::new().read(true).append(true).create(true).open(path);
        let file = file.map_err(ResultsError::file(path, "opened"))?;
        lock(&file, path)?;
        let mut lines = Self { path: path.to_owned(), file };
        let end = scan_lines(&lines.file, path, header, each)?;
        lines.file.set_len(end).map_err(ResultsError::file(path, "shortened"))?;
        if end == 0 {
            lines.append(header)?;
        }
        Ok(lines)
    }

    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Appends a line in one write: a process that is killed leaves it out or leaves it whole.
    pub(crate) fn append(&mut self, line: &[u8]) -> Result<(), ResultsError> {
        self.file.write_all(line).map_err(ResultsError::file(&self.path, "written"))
    }
}

/// Hands every whole line after the header to `each`, with the byte at which it begins; returns where the last one ends.
/// No field holds a line break, so each line is a row.
pub(crate) fn scan_lines(
    file: &File,
    path: &Path,
    header: &[u8],
    mut each: impl FnMut(&[u8], u64) -> Result<(), ResultsError>,
) -> Result<u64, ResultsError> {
    let mut reader = BufReader::new(file);
    reader.rewind().map_err(ResultsError::file(path, "read"))?;
    let (mut end, mut line) = (0_u64, Vec::new());
    loop {
        line.clear();
        let bytes = reader.read_until(b'\n', &mut line).map_err(ResultsError::file(path, "read"))?;
        // Only a killed process leaves a line without an end, and only as the last one.
        if !line.ends_with(b"\n") {
            return Ok(end);
        }
        if end > 0 {
            each(&line, end)?;
        } else if line != header {
            return Err(ResultsError::other(
                path,
                "this table has other columns, from another search or version: choose another folder with --out",
            ));
        }
        end += bytes as u64;
    }
}

/// The fields of a line of CSV; `None` if it is not one.
pub(crate) fn fields_of(line: &[u8]) -> Option<csv::StringRecord> {
    let mut reader = csv::ReaderBuilder::new().has_headers(false).from_reader(line);
    reader.records().next()?.ok()
}

/// The line at byte `offset` is not what it should be.
pub(crate) fn damaged(path: &Path, offset: u64) -> ResultsError {
    ResultsError::other(
        path,
        format!("the row at byte {offset} is damaged: delete that line to fly it again"),
    )
}

/// Lines of CSV, for tables other than that of flights.
pub struct CsvLines<W>(W);

impl<W: Write> CsvLines<W> {
    /// Writes lines to `target`.
    pub fn new(target: W) -> Self {
        Self(target)
    }

    /// Writes a line.
    ///
    /// # Errors
    /// Those of the target.
    pub fn write(&mut self, fields: &[String]) -> io::Result<()> {
        self.0.write_all(&line_of(fields.iter()))
    }
}

/// The line of CSV with these fields.
pub(crate) fn line_of(fields: impl Iterator<Item = impl AsRef<[u8]>>) -> Vec<u8> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(fields).expect("a vector takes everything");
    writer.into_inner().expect("a vector takes everything")
}
