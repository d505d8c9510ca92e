//! Lets the processes of the swarm have their turn while the recorder works through a batch.
//!
//! Never waits: if nobody else wants the core, the recorder goes on at once.

use std::{
    thread::yield_now,
    time::{Duration, Instant},
};

/// How long to work before others get their turn on this core. A longer turn holds up the agents on the core, and the
/// world, which waits for them; a shorter one costs more switches.
const TURN: Duration = Duration::from_micros(15);

/// A turn on a core.
pub(super) struct Turn {
    began: Instant,
}

impl Turn {
    /// A turn that begins now.
    pub(super) fn begin() -> Self {
        Self { began: Instant::now() }
    }

    /// Lets others have their turn if this one is over.
    pub(super) fn pass_if_over(&mut self) {
        if self.began.elapsed() > TURN {
            yield_now();
            *self = Self::begin();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_turn_that_is_over_is_passed_on() {
        let mut turn = Turn { began: Instant::now() + Duration::from_secs(3600) };
        let began = turn.began;
        turn.pass_if_over();
        assert_eq!(turn.began, began, "it has only begun");
        turn.began -= Duration::from_secs(7200);
        let before = Instant::now();
        turn.pass_if_over();
        assert!(turn.began >= before, "a new turn begins");
    }
}
