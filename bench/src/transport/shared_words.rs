//! Two words in shared memory, for the floors: what it costs to wake processes without sending data.
//!
//! Must never carry data. The swarm's own tick gate is a page of its own, and does more.

use ringwing_bus::{
    futex,
    page::{Page, Word},
};
use std::{
    hint::spin_loop,
    io,
    path::Path,
    sync::atomic::{AtomicU32, Ordering::SeqCst},
    thread,
    time::Duration,
};

/// The round. Where two processes take turns, odd numbers are the peer's turn.
const ROUND: Word = Word::on(0);
/// Number of peers that have answered the round.
const DONE: Word = Word::on(1);
const LINES: usize = 2;
/// The round number that ends the run.
const END: u32 = u32::MAX;
/// Reads of the word between two yields. Fewer measure the scheduler instead of the cache; more waste time slices where both
/// processes share a core.
const READS_PER_YIELD: u32 = 10_000;

/// The page with both words, mapped into this process.
pub(super) struct SharedWords(Page);

impl SharedWords {
    /// Maps the page at `path`, and creates it if it does not exist.
    pub(super) fn open(path: &Path) -> io::Result<Self> {
        Ok(Self(Page::create(path, LINES)?))
    }

    fn round(&self) -> &AtomicU32 {
        &self.0[ROUND]
    }

    fn done(&self) -> &AtomicU32 {
        &self.0[DONE]
    }

    /// Ends the run for all peers.
    pub(super) fn end(&self) {
        self.round().store(END, SeqCst);
        futex::wake_all(self.round());
    }

    // --- one futex that wakes all peers ---

    /// Opens `round` for all peers.
    pub(super) fn broadcast(&self, round: u32) {
        // Before the round: a peer answers as soon as it sees the round, and a later reset would erase its answer.
        self.done().store(0, SeqCst);
        self.round().store(round, SeqCst);
        futex::wake_all(self.round());
    }

    /// Waits until all `peers` have answered, or for one sleep; returns whether they have.
    pub(super) fn wait_for_answers(&self, peers: u32) -> bool {
        let done = self.done().load(SeqCst);
        if done < peers {
            futex::wait(self.done(), done, Duration::MAX);
        }
        self.done().load(SeqCst) >= peers
    }

    /// Waits for another round than `seen`; returns `None` after the last one.
    pub(super) fn wait(&self, seen: u32) -> Option<u32> {
        // A sleep ends early after a signal, and after 50 ms in any case, so only the word tells.
        while self.round().load(SeqCst) == seen {
            futex::wait(self.round(), seen, Duration::MAX);
        }
        Some(self.round().load(SeqCst)).filter(|round| *round != END)
    }

    /// Answers the round; the last of all `peers` wakes the hub.
    pub(super) fn answer(&self, peers: u32) {
        // The others wake nobody: the hub would only look and sleep again, once for each peer.
        if self.done().fetch_add(1, SeqCst) + 1 >= peers {
            futex::wake_all(self.done());
        }
    }

    // --- one atomic word that two processes take turns at ---

    /// Gives the turn away by writing `round`.
    pub(super) fn pass(&self, round: u32) {
        self.round().store(round, SeqCst);
    }

    /// Spins while the word is `old`; returns its new value, or `None` after the last round.
    pub(super) fn spin_while(&self, old: u32) -> Option<u32> {
        loop {
            for _ in 0..READS_PER_YIELD {
                let round = self.round().load(SeqCst);
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
