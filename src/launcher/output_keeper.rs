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
    io,
    path::{Path, PathBuf},
    process::Command,
    sync::mpsc::Sender,
    thread::{self, JoinHandle},
    time::{Duration, Instant},
};

/// How long to wait at the end for the last words. Longer delays the end of a run whose program left a process behind that
/// still has its output; shorter may lose the reason of a late crash on a busy machine.
const LAST_WORDS: Duration = Duration::from_secs(1);
/// Pause between two looks whether all has been read. Longer delays the end of each run; shorter costs wake-ups.
const LOOK_AGAIN: Duration = Duration::from_millis(1);

/// The way from what a program prints into its file.
#[derive(Debug)]
pub(super) struct OutputPipe {
    uav: UavId,
    path: PathBuf,
    inbox: Sender<Notice>,
}

/// Keeps the output of all programs of one run.
#[derive(Debug)]
pub(super) struct OutputKeeper {
    folder: PathBuf,
    inbox: Sender<Notice>,
    readers: Vec<JoinHandle<()>>,
}

impl OutputPipe {
    /// Makes `command` print into the file; returns the thread that writes it.
    ///
    /// To be called on the thread that starts the program: its files belong to that thread.
    pub(super) fn open(self, command: &mut Command) -> Result<JoinHandle<()>, LaunchError> {
        let Self { uav, path, inbox } = self;
        let (file, room) = open(&path).map_err(|source| LaunchError::Folder { path, source })?;
        let failed = |source| LaunchError::Spawn { what: format!("the pipe for what {uav} prints"), source };
        let (reader, writer) = io::pipe().map_err(failed)?;
        // Both streams go into one pipe, so that errors stand between the lines that they belong to.
        command.stdout(writer.try_clone().map_err(failed)?).stderr(writer);
        spawn_thread("the thread that keeps what a program prints", move || {
            // This fails only if the launcher has left, and then nobody waits for the notice.
            keep(reader, file, room, || drop(inbox.send(Notice::OutputCut { uav })));
        })
    }
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

    /// The way from the output of `uav` into its file, still to be opened.
    pub(super) fn pipe(&self, uav: UavId) -> OutputPipe {
        OutputPipe { uav, path: self.file(uav), inbox: self.inbox.clone() }
    }

    /// Takes charge of the thread that an [`OutputPipe`] has started.
    pub(super) fn add(&mut self, reader: JoinHandle<()>) {
        self.readers.push(reader);
    }

    /// Waits until everything is written, but only for a limited time.
    pub(super) fn finish(&self) {
        let since = Instant::now();
        while self.readers.iter().any(|reader| !reader.is_finished()) && since.elapsed() < LAST_WORDS {
            thread::sleep(LOOK_AGAIN);
        }
    }
}
