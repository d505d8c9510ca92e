//! Finds ticks that are missing from the log, and reports each gap once.
//!
//! Never knows why ticks are missing.

use serde::{Deserialize, Serialize};

/// A run of consecutive ticks that were lost.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Gap {
    /// The first lost tick.
    pub first_tick: i64,
    /// The last lost tick.
    pub last_tick: i64,
}

/// Follows the tick numbers of frames and collects the gaps between them.
#[derive(Debug, Default)]
pub(crate) struct Gaps {
    /// The tick that follows the last frame.
    expected: i64,
    closed: Vec<Gap>,
    /// Number of lost ticks.
    lost: u64,
}

impl Gaps {
    /// The first tick that is not in the log yet.
    pub(crate) fn expected(&self) -> i64 {
        self.expected
    }

    /// Takes the frame of `tick`; returns the gap before it, if there is one.
    pub(crate) fn pass(&mut self, tick: i64) -> Option<Gap> {
        // At first 0: the flight begins there, so a recorder that joins late finds the ticks that it missed.
        let first_tick = std::mem::replace(&mut self.expected, tick + 1);
        if tick <= first_tick {
            return None;
        }
        let gap = Gap { first_tick, last_tick: tick - 1 };
        self.lost += (tick - first_tick).cast_unsigned();
        self.closed.push(gap);
        Some(gap)
    }

    /// All gaps, in order.
    pub(crate) fn closed(&self) -> &[Gap] {
        &self.closed
    }

    /// Number of ticks lost so far.
    pub(crate) fn lost(&self) -> u64 {
        self.lost
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gap(first_tick: i64, last_tick: i64) -> Gap {
        Gap { first_tick, last_tick }
    }

    #[test]
    fn a_gap_is_reported_once_by_the_frame_after_it() {
        let mut gaps = Gaps::default();
        assert_eq!((gaps.pass(0), gaps.pass(1)), (None, None));
        assert_eq!((gaps.pass(5), gaps.pass(6)), (Some(gap(2, 4)), None));
        assert_eq!((gaps.lost(), gaps.closed()), (3, &[gap(2, 4)][..]));
    }
}
