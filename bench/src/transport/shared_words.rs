//! Two words in shared memory, for the floors: what it costs to wake processes without sending data.
//!
//! Must never carry data. The swarm's own tick gate is a page of its own, and does more.

use memmap2::MmapRaw;
use rustix::{
    io::Errno,
    thread::futex::{self, Flags},
    time::Timespec,
};
use std::{
    fs::OpenOptions,
    hint::spin_loop,
    io,
    path::Path,
    sync::atomic::{AtomicU32, Ordering::SeqCst},
    thread,
};

/// A word with a cache line of its own, so that writing one does not slow down readers of the other.
#[repr(C, align(64))]
struct PaddedWord(AtomicU32);

#[repr(C)]
struct WordPage {
    /// The round. Where two processes take turns, odd numbers are the peer's turn.
    round: PaddedWord,
    /// Number of peers that have answered the round.
    done: PaddedWord,
}

/// The round that ends all rounds.
const END: u32 = u32::MAX;
/// Reads of the word between two yields. Fewer measure the scheduler instead of the cache; more waste time slices where both
/// processes share a core.
const READS_PER_YIELD: u32 = 10_000;
/// Longest sleep on a futex before looking again. A process whose waker was killed hangs at most this long.
const MAX_SLEEP: Timespec = Timespec { tv_sec: 0, tv_nsec: 50_000_000 };

/// The page with both words, mapped into this process.
pub(super) struct SharedWords(MmapRaw);

impl SharedWords {
    /// Maps the page at `path`, and creates it if it does not exist.
    pub(super) fn open(path: &Path) -> io::Result<Self> {
        let file = OpenOptions::new().create(true).truncate(false).read(true).write(true).open(path)?;
        file.set_len(size_of::<WordPage>() as u64)?;
        Ok(Self(MmapRaw::map_raw(&file)?))
    }

    #[expect(unsafe_code, reason = "a floor measured through a library would measure the library")]
    #[expect(clippy::cast_ptr_alignment, reason = "a mapping begins on a memory page")]
    fn page(&self) -> &WordPage {
        // SAFETY: the mapping is at least as long as a `WordPage`, page-aligned, and lives as long as `self`. All processes
        // access it only through these atomics, and any bytes are valid atomics.
        unsafe { &*self.0.as_ptr().cast::<WordPage>() }
    }

    /// Ends all rounds.
    pub(super) fn end(&self) {
        self.page().round.0.store(END, SeqCst);
        wake(&self.page().round.0);
    }

    // --- one futex that wakes all peers ---

    /// Opens `round` for all peers.
    pub(super) fn broadcast(&self, round: u32) {
        self.page().done.0.store(0, SeqCst);
        self.page().round.0.store(round, SeqCst);
        wake(&self.page().round.0);
    }

    /// Waits until all `peers` have answered, or for one sleep; returns whether they have.
    pub(super) fn wait_for_answers(&self, peers: u32) -> bool {
        let done = self.page().done.0.load(SeqCst);
        if done < peers {
            sleep(&self.page().done.0, done);
        }
        self.page().done.0.load(SeqCst) >= peers
    }

    /// Waits for another round than `seen`; returns `None` after the last one.
    pub(super) fn wait(&self, seen: u32) -> Option<u32> {
        while self.page().round.0.load(SeqCst) == seen {
            sleep(&self.page().round.0, seen);
        }
        Some(self.page().round.0.load(SeqCst)).filter(|round| *round != END)
    }

    /// Answers the round; the last of all `peers` wakes the hub.
    pub(super) fn answer(&self, peers: u32) {
        if self.page().done.0.fetch_add(1, SeqCst) + 1 >= peers {
            wake(&self.page().done.0);
        }
    }

    // --- one atomic word that two processes take turns at ---

    /// Gives the turn away by writing `round`.
    pub(super) fn pass(&self, round: u32) {
        self.page().round.0.store(round, SeqCst);
    }

    /// Spins while the word is `old`; returns its new value, or `None` after the last round.
    pub(super) fn spin_while(&self, old: u32) -> Option<u32> {
        loop {
            for _ in 0..READS_PER_YIELD {
                let round = self.page().round.0.load(SeqCst);
                if round != old {
                    return Some(round).filter(|round| *round != END);
                }
                spin_loop();
            }
            // On a shared core, the other process cannot run before this one yields.
            thread::yield_now();
        }
    }
}

fn wake(word: &AtomicU32) {
    // On a mapped word, waking cannot fail; waking nobody is not an error.
    let _ = futex::wake(word, Flags::empty(), i32::MAX as u32);
}

fn sleep(word: &AtomicU32, old: u32) {
    match futex::wait(word, Flags::empty(), old, Some(&MAX_SLEEP)) {
        Ok(()) | Err(Errno::AGAIN | Errno::TIMEDOUT | Errno::INTR) => {}
        Err(errno) => unreachable!("a futex wait on mapped memory fails with {errno}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_peer_answers_every_round_of_a_broadcast() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("words");
        let hub = SharedWords::open(&path).unwrap();
        let peer = || {
            let words = SharedWords::open(&path).unwrap();
            let (mut seen, mut rounds) = (0, Vec::new());
            while let Some(round) = words.wait(seen) {
                rounds.push(round);
                seen = round;
                words.answer(2);
            }
            rounds
        };
        thread::scope(|scope| {
            let peers = [scope.spawn(peer), scope.spawn(peer)];
            for round in 1..=100 {
                hub.broadcast(round);
                while !hub.wait_for_answers(2) {}
            }
            hub.end();
            for peer in peers {
                assert_eq!(peer.join().unwrap(), (1..=100).collect::<Vec<_>>());
            }
        });
    }

    #[test]
    fn two_processes_take_turns() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("words");
        let hub = SharedWords::open(&path).unwrap();
        let peer = || {
            let (words, mut seen) = (SharedWords::open(&path).unwrap(), 0);
            while let Some(round) = words.spin_while(seen) {
                seen = round + 1;
                words.pass(seen);
            }
            seen
        };
        thread::scope(|scope| {
            let peer = scope.spawn(peer);
            for round in 0..100 {
                hub.pass(2 * round + 1);
                assert_eq!(hub.spin_while(2 * round + 1), Some(2 * round + 2));
            }
            hub.end();
            assert_eq!(peer.join().unwrap(), 200);
        });
    }
}
