//! Keeps what the programs of the user's print, in a file for each UAV in the run's folder.
//!
//! Must never let a program that prints without end fill the disk or wait for a reader.

use super::{
    LaunchError,
    inbox::{Notice, spawn_thread},
};
use ringwing_flight::UavId;
use std::{
    fs::{self, OpenOptions},
    io::{self, PipeWriter, Read, Write},
    path::{Path, PathBuf},
    sync::mpsc::Sender,
    thread::{self, JoinHandle},
    time::{Duration, Instant},
};

/// Bytes kept of what a UAV's programs print. More fills the disk during a long flight; less cuts off what somebody may look
/// for.
const KEPT_BYTES: u64 = 1 << 20;
/// The last line of a file that is full.
const CUT: &str = "\n[ringwing keeps 1 MiB of what a UAV's programs print; the rest was dropped]\n";
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
        Self { folder: run.join("output"), inbox, readers: Vec::new() }
    }

    /// The file with the output of `uav`.
    pub(super) fn file(&self, uav: UavId) -> PathBuf {
        self.folder.join(format!("uav-{}.txt", uav.0))
    }

    /// The end into which a program of `uav` is to print.
    pub(super) fn open(&mut self, uav: UavId) -> Result<PipeWriter, LaunchError> {
        let path = self.file(uav);
        let unwritable = |source| LaunchError::Folder { path: path.clone(), source };
        fs::create_dir_all(&self.folder).map_err(unwritable)?;
        // A program that is started again adds to what the one before has printed.
        let file = OpenOptions::new().create(true).append(true).open(&path).map_err(unwritable)?;
        let room = KEPT_BYTES.saturating_sub(file.metadata().map_err(unwritable)?.len());
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

/// Writes the first `room` bytes of what comes into `file`, and drops the rest after calling `on_cut` once.
fn keep(mut from: impl Read, mut file: impl Write, mut room: u64, on_cut: impl FnOnce()) {
    let (mut buffer, mut on_cut) = ([0; 8192], Some(on_cut));
    loop {
        let count = match from.read(&mut buffer) {
            Ok(0) => return,
            Ok(count) => count,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
            Err(_) => return,
        };
        let kept = count.min(usize::try_from(room).unwrap_or(usize::MAX));
        // On a full disk, go on reading: a program whose output nobody reads would stand still.
        let _ = file.write_all(&buffer[..kept]);
        room -= kept as u64;
        if kept < count
            && let Some(on_cut) = on_cut.take()
        {
            let _ = file.write_all(CUT.as_bytes());
            on_cut();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is kept of `text` with this `room`, and how many times it was cut.
    fn kept(text: &str, room: u64) -> (String, u32) {
        let (mut file, mut cuts) = (Vec::new(), 0);
        keep(text.as_bytes(), &mut file, room, || cuts += 1);
        (String::from_utf8(file).unwrap(), cuts)
    }

    #[test]
    fn all_of_it_is_kept_up_to_the_limit_and_a_line_says_so_beyond() {
        assert_eq!(kept("ready\n", 6), ("ready\n".into(), 0));
        assert_eq!(kept("ready\n", 5), (format!("ready{CUT}"), 1));
        let (text, cuts) = kept(&"x".repeat(100_000), 20_000);
        assert_eq!((text.len(), cuts), (20_000 + CUT.len(), 1));
        assert_eq!(kept("more", 0), (CUT.into(), 1), "nothing more from a program that is started again");
    }
}
