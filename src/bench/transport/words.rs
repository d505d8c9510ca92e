//! Two words in shared memory, for the floors: what waking costs where no data are sent.
//!
//! Never carries data. The tick gate of the swarm is another page, with more to it.

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

/// A word on a cache line of its own.
#[repr(C, align(64))]
struct Line(AtomicU32);

#[repr(C)]
struct Page {
    /// Which round it is; for two who take turns, odd ones are the peer's.
    round: Line,
    /// Who has answered it.
    done: Line,
}

/// Ends all rounds.
const END: u32 = u32::MAX;
/// Looks between two yields: enough where both have a processor, and no hang where they share one.
const LOOKS: u32 = 10_000;
/// Sleeps are cut into pieces, so that nobody sleeps for ever whose waker was killed.
const LONGEST_SLEEP: Timespec = Timespec { tv_sec: 0, tv_nsec: 50_000_000 };

/// The page as one process sees it.
pub(super) struct Words(MmapRaw);

impl Words {
    /// Makes the page, or opens it.
    pub(super) fn open(path: &Path) -> io::Result<Self> {
        let file = OpenOptions::new().create(true).truncate(false).read(true).write(true).open(path)?;
        file.set_len(size_of::<Page>() as u64)?;
        Ok(Self(MmapRaw::map_raw(&file)?))
    }

    #[expect(unsafe_code, reason = "a floor measured through a library would measure the library")]
    #[expect(clippy::cast_ptr_alignment, reason = "a mapping begins on a memory page")]
    fn page(&self) -> &Page {
        // SAFETY: the mapping is a `Page` long, page-aligned, lives as long as `self`, and is only ever accessed as these
        // atomics, by us and by the other processes; any bytes make valid atomics.
        unsafe { &*self.0.as_ptr().cast::<Page>() }
    }

    pub(super) fn end(&self) {
        self.page().round.0.store(END, SeqCst);
        wake(&self.page().round.0);
    }

    // --- a futex for all ---

    /// Opens `round` for everybody.
    pub(super) fn broadcast(&self, round: u32) {
        self.page().done.0.store(0, SeqCst);
        self.page().round.0.store(round, SeqCst);
        wake(&self.page().round.0);
    }

    /// Waits until `peers` have answered, or one sleep was in vain.
    pub(super) fn wait_for_answers(&self, peers: u32) -> bool {
        let done = self.page().done.0.load(SeqCst);
        if done < peers {
            sleep(&self.page().done.0, done);
        }
        self.page().done.0.load(SeqCst) >= peers
    }

    /// Waits for a round other than `seen`; `None` when there are no more.
    pub(super) fn wait(&self, seen: u32) -> Option<u32> {
        while self.page().round.0.load(SeqCst) == seen {
            sleep(&self.page().round.0, seen);
        }
        Some(self.page().round.0.load(SeqCst)).filter(|round| *round != END)
    }

    /// Answers; the last of `peers` wakes the one who waits.
    pub(super) fn answer(&self, peers: u32) {
        if self.page().done.0.fetch_add(1, SeqCst) + 1 >= peers {
            wake(&self.page().done.0);
        }
    }

    // --- two who take turns ---

    /// Gives the word away: `round` becomes what is in it.
    pub(super) fn pass(&self, round: u32) {
        self.page().round.0.store(round, SeqCst);
    }

    /// Spins until something else than `old` is in the word; `None` when there are no more rounds.
    pub(super) fn spin_while(&self, old: u32) -> Option<u32> {
        loop {
            for _ in 0..LOOKS {
                let round = self.page().round.0.load(SeqCst);
                if round != old {
                    return Some(round).filter(|round| *round != END);
                }
                spin_loop();
            }
            thread::yield_now();
        }
    }
}

fn wake(word: &AtomicU32) {
    // Nobody sleeping is no error; there is no other way for this to fail on a mapped word.
    let _ = futex::wake(word, Flags::empty(), i32::MAX as u32);
}

fn sleep(word: &AtomicU32, old: u32) {
    match futex::wait(word, Flags::empty(), old, Some(&LONGEST_SLEEP)) {
        Ok(()) | Err(Errno::AGAIN | Errno::TIMEDOUT | Errno::INTR) => {}
        Err(errno) => unreachable!("a futex wait on mapped memory fails with {errno}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn everybody_answers_every_round_of_a_broadcast() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("words");
        let hub = Words::open(&path).unwrap();
        let peer = || {
            let words = Words::open(&path).unwrap();
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
    fn two_take_turns() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("words");
        let hub = Words::open(&path).unwrap();
        let peer = || {
            let (words, mut seen) = (Words::open(&path).unwrap(), 0);
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
