//! Retrying what another process is about to make possible.
//!
//! Must never repeat an attempt whose error is not temporary.

use crate::Patience;
use std::{thread, time::Duration};

/// How long a service may take to appear, or the place of a dead process to become free. Less fails on a busy machine;
/// more makes a process that cannot succeed give up later.
const RETRY_LIMIT: Duration = Duration::from_secs(5);
/// Between two attempts. Longer delays every start; shorter takes the processor from the process that is waited for.
const RETRY_PAUSE: Duration = Duration::from_millis(2);

/// Repeats `attempt` until it succeeds, until it fails with an error that is not temporary, or for 5 s.
pub(crate) fn retry<T, E>(
    attempt: impl Fn() -> Result<T, E>,
    passes_by_itself: impl Fn(&E) -> bool,
) -> Result<T, E> {
    let mut patience = Patience::of(RETRY_LIMIT);
    loop {
        match attempt() {
            Err(error) if passes_by_itself(&error) && !patience.is_over() => {
                thread::sleep(RETRY_PAUSE);
            }
            // After the time limit, too, return the last error: it says what the process has waited for.
            result => return result,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::Cell;

    #[test]
    fn an_error_that_passes_is_retried_and_another_is_not() {
        let attempts = Cell::new(0);
        let attempt = || {
            attempts.set(attempts.get() + 1);
            if attempts.get() < 3 { Err("not yet") } else { Err("never") }
        };
        assert_eq!(retry(attempt, |error| *error == "not yet"), Err::<(), _>("never"));
        assert_eq!(attempts.get(), 3);
        assert_eq!(retry(|| Ok::<_, &str>(5), |_| true), Ok(5));
    }
}
