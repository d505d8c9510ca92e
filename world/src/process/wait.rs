//! The one loop in which the world waits for other processes: bounded in time unless the user has paused the flight, and
//! ended by a stop.
//!
//! Never knows what is waited for, nor how time passes in between.

use ringwing_bus::Patience;
use std::time::Duration;

/// How long the world sleeps before it checks what it waits for even if nobody has woken it. Longer sleeps delay the
/// answer to a signal; shorter ones burn CPU.
pub(super) const RECHECK: Duration = Duration::from_millis(2);
/// How long the world sleeps before it looks again for a sample that nobody announces. Longer sleeps delay the tick;
/// shorter ones take the core from the sender.
pub(super) const RETRY: Duration = Duration::from_micros(50);

/// How a wait ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum WaitEnd {
    /// What was waited for is there.
    Met,
    /// The run was stopped.
    Stopped,
    /// The time limit has passed.
    Overdue,
}

/// What the run does to a wait.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum WaitMode {
    /// The time limit runs.
    Timed,
    /// The time limit begins anew later: the user has paused the flight, for example to look at a process in a debugger.
    Untimed,
    /// The run was stopped.
    Stopped,
}

/// Lets `pause` pass some time on `subject` again and again until `is_met`, until `mode` says that the run was stopped, or
/// until `limit` has passed. The time in which the world itself was stopped, or in which the wait is untimed, does not count.
///
/// A condition that is met from the start costs neither a pause nor a look at the clock, as in most waits on the tick
/// path.
pub(super) fn wait_until<S, E>(
    subject: &mut S,
    limit: Duration,
    is_met: impl Fn(&S) -> bool,
    mode: impl Fn(&S) -> WaitMode,
    mut pause: impl FnMut(&mut S) -> Result<(), E>,
) -> Result<WaitEnd, E> {
    if is_met(subject) {
        return Ok(WaitEnd::Met);
    }
    let mut patience = Patience::of(limit);
    loop {
        pause(subject)?;
        if is_met(subject) {
            return Ok(WaitEnd::Met);
        }
        match mode(subject) {
            WaitMode::Timed => {}
            // The limit counts from the end of the untimed part on.
            WaitMode::Untimed => {
                patience = Patience::of(limit);
                continue;
            }
            // Look for a stop only now: what was waited for and has come still counts.
            WaitMode::Stopped => return Ok(WaitEnd::Stopped),
        }
        if patience.is_over() {
            return Ok(WaitEnd::Overdue);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::convert::Infallible;

    const LONG: Duration = Duration::from_secs(3600);

    /// Waits until a counter, which each pause raises by one, reaches `target`, or until it is `stop`.
    fn count_to(target: u32, stop: u32, limit: Duration) -> (u32, WaitEnd) {
        let mut counter = 0;
        let pause = |counter: &mut u32| {
            *counter += 1;
            Ok::<_, Infallible>(())
        };
        let mode = |count: &u32| if *count == stop { WaitMode::Stopped } else { WaitMode::Timed };
        let end = wait_until(&mut counter, limit, |count| *count == target, mode, pause);
        (counter, end.unwrap())
    }

    #[test]
    fn a_condition_that_is_met_already_costs_no_pause() {
        assert_eq!(count_to(0, 0, Duration::ZERO), (0, WaitEnd::Met));
    }

    #[test]
    fn a_wait_ends_as_soon_as_its_condition_is_met() {
        assert_eq!(count_to(3, 4, LONG), (3, WaitEnd::Met));
        assert_eq!(count_to(3, 3, LONG), (3, WaitEnd::Met), "a stop does not hide what was waited for");
    }

    #[test]
    fn a_stop_ends_a_wait() {
        assert_eq!(count_to(u32::MAX, 2, LONG), (2, WaitEnd::Stopped));
    }

    #[test]
    fn a_wait_whose_time_is_over_ends_after_one_last_look() {
        assert_eq!(count_to(u32::MAX, u32::MAX, Duration::ZERO), (1, WaitEnd::Overdue));
        assert_eq!(count_to(1, u32::MAX, Duration::ZERO), (1, WaitEnd::Met));
    }

    #[test]
    fn a_limit_runs_only_while_the_wait_is_timed() {
        let mut counter = 0;
        let pause = |counter: &mut u32| {
            *counter += 1;
            Ok::<_, Infallible>(())
        };
        let mode = |count: &u32| if *count < 5 { WaitMode::Untimed } else { WaitMode::Timed };
        let end = wait_until(&mut counter, Duration::ZERO, |_| false, mode, pause);
        assert_eq!((counter, end.unwrap()), (5, WaitEnd::Overdue));
    }

    #[test]
    fn an_error_ends_a_wait() {
        let end = wait_until(&mut (), LONG, |()| false, |()| WaitMode::Timed, |()| Err("lost"));
        assert_eq!(end, Err("lost"));
    }
}
