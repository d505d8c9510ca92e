//! Rebuilds a log that was cut or damaged: copies everything readable into a new, complete file with indexes.
//!
//! Never changes its input, never overwrites a file, and never leaves a half-written one.

use super::{
    RESULT, SCENARIO,
    copy::RecordCopier,
    input::{self, LogInput},
    reader::{LogDamages, ReadError, Reader},
    salvage::Salvage,
};
use mcap::{
    McapError, McapResult, WriteOptions, Writer,
    records::{Header, MessageHeader, Record},
};
use std::{
    fs::{File, Permissions},
    io::{self, BufReader, BufWriter, Write},
    os::unix::fs::PermissionsExt,
    path::{Path, PathBuf},
};
use tempfile::{Builder, NamedTempFile};

/// Bytes of a chunk before compression. Larger chunks compress better, but one damaged byte costs a whole chunk.
const CHUNK_BYTES: u64 = 1 << 20;

/// What was kept of a damaged log, and what was lost.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct RecoveredLog {
    /// Number of messages kept.
    pub messages: u64,
    /// Number of messages lost because the record that names their topic is lost.
    pub unnamed: u64,
    /// Names of the attachments kept.
    pub attachments: Vec<String>,
    /// Names of the metadata records kept.
    pub metadata: Vec<String>,
    /// Parts of the file that could not be read.
    pub damages: LogDamages,
    /// Whether the log was read up to its end; a log that was cut has no end.
    pub has_ended: bool,
    /// Earliest and latest log time of the messages kept, in nanoseconds since 1970.
    pub span: Option<(u64, u64)>,
}

impl RecoveredLog {
    /// Whether the scenario was kept, without which the flight can be neither measured nor repeated.
    pub fn has_scenario(&self) -> bool {
        self.attachments.iter().any(|name| name == SCENARIO)
    }

    /// Whether the log says how the flight ended.
    pub fn has_result(&self) -> bool {
        self.metadata.iter().any(|name| name == RESULT)
    }

    /// Whether the new log holds everything that a whole log of a flight does.
    pub fn is_whole(&self) -> bool {
        self.damages.count == 0 && self.unnamed == 0 && self.has_scenario() && self.has_result()
    }
}

/// Why a log cannot be recovered.
#[derive(Debug, thiserror::Error)]
pub enum RecoverError {
    /// The input is not a readable log.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The output exists already.
    #[error("{}: exists, and is left as it is; choose another file with --out", path.display())]
    Exists {
        /// The existing file.
        path: PathBuf,
    },
    /// The output cannot be written.
    #[error("{}: cannot be written: {reason}; choose another file with --out", path.display())]
    Unwritable {
        /// The output file.
        path: PathBuf,
        /// What went wrong, in the words of the operating system if it refused.
        reason: io::Error,
    },
}

/// Copies what is readable of the log that `input` names into a new log at `output`.
pub fn recover(input: &Path, output: &Path) -> Result<RecoveredLog, RecoverError> {
    let unwritable = |reason| RecoverError::Unwritable { path: output.to_owned(), reason };
    // Before anything is read or written, because both can take long.
    if output.symlink_metadata().is_ok() {
        return Err(RecoverError::Exists { path: output.to_owned() });
    }
    let LogInput { path, file, problem } = input::open(input)?;
    // Opening a reader gives the clear errors about files that are not logs.
    drop(Reader::of(&path, BufReader::new(&file))?);
    let draft = draft(output).map_err(unwritable)?;
    let mut salvage = Salvage::new(BufReader::new(file));
    let recovered = copy(&mut salvage, draft.as_file()).map_err(|error| unwritable(io_error(error)))?;
    draft.persist_noclobber(output).map_err(|refused| match refused.error.kind() {
        io::ErrorKind::AlreadyExists => RecoverError::Exists { path: output.to_owned() },
        _ => unwritable(refused.error),
    })?;
    let mut damages = salvage.damages().clone();
    if let Some(problem) = problem {
        damages.add(0, 0, problem);
    }
    Ok(RecoveredLog { damages, has_ended: salvage.has_ended(), ..recovered })
}

/// A file beside `output` that disappears unless it gets that name: a partial output must not pass for a recovered log.
fn draft(output: &Path) -> io::Result<NamedTempFile> {
    let folder = output.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    // As for any new file, the user's mask decides who may read it. The default of temporary files is stricter.
    Builder::new().permissions(Permissions::from_mode(0o666)).tempfile_in(folder)
}

fn io_error(error: McapError) -> io::Error {
    match error {
        McapError::Io(reason) => reason,
        other => io::Error::other(other),
    }
}

fn copy(salvage: &mut Salvage<BufReader<File>>, file: &File) -> McapResult<RecoveredLog> {
    let mut records = salvage.peekable();
    // A log begins with its header, so the library and profile of the original must be known before anything is
    // written.
    let header = match records.next_if(|record| matches!(record, Record::Header(_))) {
        Some(Record::Header(header)) => header,
        _ => Header { profile: String::new(), library: String::new() },
    };
    let mut recovery = LogRecovery::new(file, header)?;
    for record in records {
        recovery.take(record)?;
    }
    recovery.writer.finish()?;
    recovery.writer.into_inner().flush()?;
    Ok(recovery.recovered)
}

/// A log that is being rebuilt.
struct LogRecovery<'a> {
    writer: Writer<BufWriter<&'a File>>,
    copier: RecordCopier,
    recovered: RecoveredLog,
}

impl<'a> LogRecovery<'a> {
    fn new(file: &'a File, header: Header) -> McapResult<Self> {
        let options = WriteOptions::new().library(header.library).profile(header.profile);
        // Without threads: the default number depends on the machine, and with it the bytes of the file.
        let options = options.chunk_size(Some(CHUNK_BYTES)).compression_threads(0);
        Ok(Self {
            writer: options.create(BufWriter::new(file))?,
            copier: RecordCopier::default(),
            recovered: RecoveredLog::default(),
        })
    }

    fn take(&mut self, record: Record) -> McapResult<()> {
        match &record {
            Record::Message { header, data } => return self.take_message(*header, data),
            Record::Metadata(metadata) => self.recovered.metadata.push(metadata.name.clone()),
            Record::Attachment { header, .. } => self.recovered.attachments.push(header.name.clone()),
            _ => {}
        }
        self.copier.copy(record, &mut self.writer)
    }

    fn take_message(&mut self, header: MessageHeader, data: &[u8]) -> McapResult<()> {
        let Some((header, _topic)) = self.copier.translate(header) else {
            self.recovered.unnamed += 1;
            return Ok(());
        };
        self.recovered.messages += 1;
        let time = header.log_time;
        // Logs of other programs need not be in order of time.
        let (first, last) = self.recovered.span.unwrap_or((time, time));
        self.recovered.span = Some((first.min(time), last.max(time)));
        self.writer.write_to_known_channel(&header, data)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{messages, place, record, record_and_die, small_log};
    use std::fs;

    #[test]
    fn a_recovered_log_holds_what_was_left_and_has_an_index() {
        let (folder, path) = place();
        let file = small_log(record_and_die);
        let whole = messages(&file);
        for cut in (200..file.len()).step_by(211).chain([file.len()]) {
            fs::write(&path, &file[..cut]).unwrap();
            let out = folder.path().join(format!("{cut}.mcap"));
            let recovered = recover(&path, &out).unwrap();
            assert_eq!(fs::read(&path).unwrap(), &file[..cut], "the input is left alone");
            let rebuilt = fs::read(&out).unwrap();
            let kept = messages(&rebuilt);
            assert_eq!(kept[..], whole[..kept.len()], "cut at byte {cut}");
            assert_eq!(kept.len() as u64, recovered.messages);
            let summary = mcap::Summary::read(&rebuilt).unwrap().unwrap();
            assert_eq!(summary.stats.unwrap().message_count, recovered.messages);
            // 37 bytes of footer and magic follow the end of the data.
            assert_eq!(recovered.has_ended, cut >= file.len() - 37);
        }
    }

    #[test]
    fn recovery_takes_lost_schemas_from_the_summary() {
        let (folder, path) = place();
        let mut file = small_log(record);
        let first = mcap::Summary::read(&file).unwrap().unwrap().chunk_indexes[0].clone();
        file[first.chunk_start_offset as usize + 80] ^= 1;
        fs::write(&path, &file).unwrap();
        let recovered = recover(&path, &folder.path().join("out.mcap")).unwrap();
        assert!(recovered.unnamed == 0 && recovered.messages > 50, "{recovered:?}");
        assert!(recovered.has_scenario() && recovered.has_result());
        assert_eq!(recovered.damages.count, 1);
    }

    #[test]
    fn recovery_never_overwrites_a_file() {
        let (folder, path) = place();
        fs::write(&path, small_log(record)).unwrap();
        let out = folder.path().join("precious");
        fs::write(&out, "precious").unwrap();
        for out in [&out, &path] {
            assert!(matches!(recover(&path, out), Err(RecoverError::Exists { .. })));
        }
        assert_eq!(fs::read(&out).unwrap(), b"precious");
        fs::write(&path, b"not a log").unwrap();
        let none = folder.path().join("none.mcap");
        assert!(matches!(recover(&path, &none), Err(RecoverError::Read(_))));
        assert!(!none.exists());
    }
}
