//! Shared memory that a run sets aside before it starts, and hands out as its segments come to life.
//!
//! The kernel gives a segment its memory page by page, when a process writes there. If no memory is left, it kills the writer
//! by SIGBUS. The memory of a reserve is there from the start: if there is too little, that is an error before anything flies, and
//! a run that starts at the same time does not count on it.
//!
//! Must never keep what the run does not need later: other runs need memory, too.

use super::{Domain, entries, name_of};
use crate::{BusError, MemorySpace, Shortage, ballast, files::allocate};
use rustix::param::page_size;
use std::{
    fs::{self, File, OpenOptions},
    io,
    os::unix::fs::MetadataExt,
    path::PathBuf,
};

/// The most that [`Domain::pin_segments`] takes for one segment of rare messages, in bytes. More takes memory that such a
/// segment hardly ever uses; less leaves messages without.
const PINNED_MAX: u64 = 64 << 10;
/// The segments of publishers end like this. All other segments are written to the last page when they are made.
const DATA_SUFFIX: &str = ".data";

/// What memory is set aside for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reserve {
    /// The services and processes with which the run begins.
    Swarm,
    /// The ticks that wait for a recorder that lags behind.
    Journal,
    /// Processes that take the place of lost ones.
    Successors,
}

impl Domain {
    fn reserve_path(&self, reserve: Reserve) -> PathBuf {
        self.root().join(match reserve {
            Reserve::Swarm => "reserve.swarm",
            Reserve::Journal => "reserve.journal",
            Reserve::Successors => "reserve.successors",
        })
    }

    /// Sets `bytes` of shared memory aside.
    pub fn set_aside(&self, reserve: Reserve, bytes: u64) -> Result<(), BusError> {
        let path = self.reserve_path(reserve);
        let file = File::create(&path).map_err(BusError::file(&path))?;
        allocate(&file, bytes).map_err(|error| lack("the run", bytes, error, path))
    }

    /// Gives back all that is left of `reserve`.
    pub fn release(&self, reserve: Reserve) {
        // Without such a reserve there is nothing to give back.
        let _ = fs::remove_file(self.reserve_path(reserve));
    }

    /// Gives back `bytes` of `reserve`, or what is left of it, to whoever is about to use that memory.
    pub(crate) fn release_part(&self, reserve: Reserve, bytes: u64) {
        let Ok(file) = OpenOptions::new().write(true).open(self.reserve_path(reserve)) else { return };
        let length = file.metadata().map_or(0, |meta| meta.len());
        // Making a file shorter needs no memory, so this cannot fail for the want of it.
        let _ = file.set_len(length.saturating_sub(bytes));
    }

    /// Makes sure that `bytes` are free for one more process; takes them out of the reserve if there is one.
    pub(crate) fn make_room(&self, bytes: u64) -> Result<(), BusError> {
        self.release_part(Reserve::Successors, bytes);
        // The reserve may be used up. Refuse the process here: later, SIGBUS would kill it when it finds no page.
        match MemorySpace::look() {
            Some(space) if space.free < bytes => {
                Err(Shortage::of_memory("the next process", bytes, space).into())
            }
            _ => Ok(()),
        }
    }

    /// Gives the segments of all publishers the memory that they write first. To be called once all processes are ready.
    ///
    /// A segment of rare messages gets only its beginning: iceoryx2 uses the same few samples again and again.
    pub fn pin_segments(&self, ballast_bytes: u32) -> Result<(), BusError> {
        let most = pinned_bytes(u64::from(ballast_bytes));
        let is_ours = |name: &str| name.starts_with(&self.id.segment_prefix()) && name.ends_with(DATA_SUFFIX);
        entries().filter(|entry| is_ours(&name_of(entry))).try_for_each(|entry| pin(entry.path(), most))
    }

    /// Gives the segment of the publisher with the number `publisher` its first `bytes` of memory.
    pub(crate) fn pin_segment_of(&self, publisher: u128, bytes: u64) -> Result<(), BusError> {
        let end = format!("_{publisher}{DATA_SUFFIX}");
        let is_it = |name: &str| name.starts_with(&self.id.segment_prefix()) && name.ends_with(&end);
        entries().filter(|entry| is_it(&name_of(entry))).try_for_each(|entry| pin(entry.path(), bytes))
    }
}

/// Memory that [`Domain::pin_segments`] takes for a segment, at most, in bytes.
pub(crate) fn pinned_bytes(ballast_bytes: u64) -> u64 {
    PINNED_MAX.max(ballast::samples_bytes(ballast_bytes))
}

/// Memory that a new file with `length` bytes takes.
pub(super) fn bytes_of_file(length: usize) -> u64 {
    length.next_multiple_of(page_size()) as u64
}

/// Gives the first `bytes` of a segment their memory; a process that is about to end may have removed it already.
fn pin(path: PathBuf, bytes: u64) -> Result<(), BusError> {
    let Ok(file) = OpenOptions::new().write(true).open(&path) else { return Ok(()) };
    // Never beyond its size: that would make the segment longer.
    let bytes = bytes.min(file.metadata().map_or(0, |meta| meta.size()));
    allocate(&file, bytes).map_err(|error| lack("a service", bytes, error, path))
}

fn lack(what: &str, bytes: u64, error: io::Error, path: PathBuf) -> BusError {
    match MemorySpace::look() {
        Some(space) if error.kind() == io::ErrorKind::StorageFull => {
            Shortage::of_memory(what, bytes, space).into()
        }
        _ => BusError::file(path)(error),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::DomainOwner;

    fn taken(domain: &Domain, reserve: Reserve) -> Option<u64> {
        fs::metadata(domain.reserve_path(reserve)).ok().map(|meta| meta.blocks() * 512)
    }

    #[test]
    fn a_reserve_takes_its_memory_at_once_and_gives_it_back_in_parts() {
        let (owner, _gate) = DomainOwner::create("").unwrap();
        let domain = owner.domain();
        domain.set_aside(Reserve::Swarm, 1 << 20).unwrap();
        assert_eq!(taken(domain, Reserve::Swarm), Some(1 << 20));
        domain.release_part(Reserve::Swarm, 1 << 19);
        assert_eq!(taken(domain, Reserve::Swarm), Some(1 << 19));
        domain.release_part(Reserve::Swarm, 1 << 30);
        assert_eq!(taken(domain, Reserve::Swarm), Some(0));
        domain.release(Reserve::Swarm);
        assert_eq!(taken(domain, Reserve::Swarm), None);
    }

    #[test]
    fn more_than_there_is_cannot_be_set_aside() {
        let (owner, _gate) = DomainOwner::create("").unwrap();
        // Skip where shared memory has no limit.
        let Some(MemorySpace { total, .. }) = MemorySpace::look() else { return };
        let error = owner.domain().set_aside(Reserve::Journal, total * 2).unwrap_err().to_string();
        assert!(error.contains("of shared memory") && error.contains("--shm-size"), "{error}");
        assert!(owner.domain().make_room(total * 2).is_err());
        owner.domain().make_room(1).unwrap();
    }

    #[test]
    fn pinning_takes_memory_within_a_segment_and_never_makes_it_longer() {
        let (owner, _gate) = DomainOwner::create("").unwrap();
        let domain = owner.domain();
        let path = PathBuf::from(format!("/dev/shm/{}x_7.data", domain.id.segment_prefix()));
        File::create(&path).unwrap().set_len(1 << 20).unwrap();
        let blocks = || fs::metadata(&path).unwrap().blocks() * 512;
        assert_eq!(blocks(), 0);
        domain.pin_segments(0).unwrap();
        assert_eq!(blocks(), PINNED_MAX);
        domain.pin_segment_of(8, 1 << 19).unwrap();
        assert_eq!(blocks(), PINNED_MAX, "that is another publisher's");
        domain.pin_segment_of(7, 1 << 30).unwrap();
        assert_eq!((blocks(), fs::metadata(&path).unwrap().len()), (1 << 20, 1 << 20));
    }
}
