//! Keeps what the programs of the user's print, in a file for each UAV in the run's folder.
//!
//! Must never let a program that prints without end fill the disk or wait for a reader.

use super::{
    LaunchError,
    inbox::{Notice, spawn_thread},
};
use ringwing_flight::UavId;
use ringwing_programs::output::{file_of, keep, open};
use ringwing_recorder::log::run_folder;
use std::{
    io::{self, PipeWriter},
    path::{Path, PathBuf},
    sync::mpsc::Sender,
    thread::{self, JoinHandle},
    time::{Duration, Instant},
};

/// How long to wait at the end for the last words. Longer delays the end of a run whose program left a process behind that
/// still has its output; shorter may lose the reason of a late crash on a busy machine.
const LAST_WORDS: Duration = Duration::from_secs(1);
/// Pause between two looks whether all has been read. Longer delays the end of each run; shorter costs wake-ups.
const LOOK_AGAIN: Duration = Duration::from_millis(1);

/// Keeps the output of all programs of one run.
#[derive(Debug)]
pub(super) struct OutputKeeper {
    folder: PathBuf,
    inbox: Sender<Notice>,
    readers: Vec<JoinHandle<()>>,
}

impl OutputKeeper {
    /// Keeps output below the run's folder `run`; tells `inbox` of programs that print too much.
    pub(super) fn new(run: &Path, inbox: Sender<Notice>) -> Self {
        Self { folder: run_folder::output_in(run), inbox, readers: Vec::new() }
    }

    /// The file with the output of `uav`.
    pub(super) fn file(&self, uav: UavId) -> PathBuf {
        file_of(&self.folder, uav)
    }

    /// The end into which a program of `uav` is to print.
    pub(super) fn open(&mut self, uav: UavId) -> Result<PipeWriter, LaunchError> {
        let path = self.file(uav);
        let unwritable = |source| LaunchError::Folder { path: path.clone(), source };
        let (file, room) = open(&path).map_err(unwritable)?;
        let failed = |source| LaunchError::Spawn { what: format!("the pipe for what {uav} prints"), source };
        let (reader, writer) = io::pipe().map_err(failed)?;
        let inbox = self.inbox.clone();
        self.readers.push(spawn_thread("the thread that keeps what a program prints", move || {
            // This fails only if the launcher has left, and then nobody waits for the notice.
            keep(reader, file, room, || drop(inbox.send(Notice::OutputCut { uav })));
        })?);
        Ok(writer)
    }

    /// Waits until everything is written, but only for a limited time.
    pub(super) fn finish(&self) {
        let since = Instant::now();
        while self.readers.iter().any(|reader| !reader.is_finished()) && since.elapsed() < LAST_WORDS {
            thread::sleep(LOOK_AGAIN);
        }
    }
}
