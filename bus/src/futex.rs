//! Sleeping on a word of shared memory, and waking the sleepers: the one place that makes futex calls.
//!
//! Must never give a meaning to a word: the callers do.

use rustix::{
    io::Errno,
    thread::futex::{self, Flags},
    time::Timespec,
};
use std::{sync::atomic::AtomicU32, time::Duration};

/// The longest sleep. A process whose waker was killed, or which got a signal just before it fell asleep, notices after
/// this time. Longer delays its reaction; shorter wakes idle processes for nothing.
const LONGEST_SLEEP: Duration = Duration::from_millis(50);

/// Wakes every process that sleeps on `word`.
pub fn wake_all(word: &AtomicU32) {
    // This cannot fail on a mapped word, and it is no error if nobody sleeps.
    let _ = futex::wake(word, Flags::empty(), i32::MAX as u32);
}

/// Sleeps while `word` is `old`, for at most `limit` and never longer than 50 ms.
///
/// It may return early, for example after a signal: the caller has to check its condition in any case.
pub fn wait(word: &AtomicU32, old: u32, limit: Duration) {
    let limit = limit.min(LONGEST_SLEEP);
    // The limit is below a second here, so its nanoseconds hold all of it.
    let timeout = Timespec { tv_sec: 0, tv_nsec: i64::from(limit.subsec_nanos()) };
    // Not a private futex: the process that wakes this one has its own mapping of the word.
    match futex::wait(word, Flags::empty(), old, Some(&timeout)) {
        Ok(()) | Err(Errno::AGAIN | Errno::TIMEDOUT | Errno::INTR) => {}
        Err(errno) => unreachable!("a futex wait on mapped memory failed with {errno}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::{sync::atomic::Ordering::SeqCst, time::Instant};

    #[test]
    fn a_changed_word_ends_the_wait_at_once_and_an_unchanged_one_after_the_limit() {
        let word = AtomicU32::new(1);
        wait(&word, 0, Duration::MAX);
        let since = Instant::now();
        wait(&word, 1, Duration::from_millis(5));
        assert!(since.elapsed() >= Duration::from_millis(5));
    }

    #[test]
    fn a_sleeper_is_woken() {
        let word = AtomicU32::new(0);
        std::thread::scope(|scope| {
            let sleeper = scope.spawn(|| {
                while word.load(SeqCst) == 0 {
                    wait(&word, 0, Duration::MAX);
                }
            });
            std::thread::sleep(Duration::from_millis(2));
            word.store(1, SeqCst);
            wake_all(&word);
            sleeper.join().unwrap();
        });
    }
}
