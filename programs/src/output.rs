//! Keeps what a program prints, up to a limit.
//!
//! Must never let a program that prints without end fill the disk or wait for a reader.

use ringwing_flight::UavId;
use std::{
    fs::{File, OpenOptions, create_dir_all},
    io::{self, Read, Write},
    path::{Path, PathBuf},
};

/// Bytes kept of what a UAV's programs print. More fills the disk during a long flight; less cuts off what somebody may look
/// for.
const KEPT_BYTES: u64 = 1 << 20;
/// The last line of a file that is full.
const CUT: &str = "\n[ringwing keeps 1 MiB of what a UAV's programs print; the rest was dropped]\n";

/// The file for what the programs of `uav` print, in `folder`.
pub fn file_of(folder: &Path, uav: UavId) -> PathBuf {
    folder.join(format!("uav-{}.txt", uav.0))
}

/// Opens the file at `path`, and its folder, for what a program prints; returns how many bytes there is room for.
///
/// # Errors
/// The folder or the file cannot be written.
pub fn open(path: &Path) -> io::Result<(File, u64)> {
    path.parent().map_or(Ok(()), create_dir_all)?;
    // A program that is started again adds to what the one before has printed.
    let file = OpenOptions::new().create(true).append(true).open(path)?;
    let room = KEPT_BYTES.saturating_sub(file.metadata()?.len());
    Ok((file, room))
}

/// Writes the first `room` bytes of what comes into `file`, and drops the rest after calling `on_cut` once.
pub fn keep(mut from: impl Read, mut file: impl Write, mut room: u64, on_cut: impl FnOnce()) {
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
