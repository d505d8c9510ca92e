//! Finds ticks that are missing from the log, or incomplete in it, and reports each gap once.
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
    /// First tick of the gap that has not ended yet.
    open: Option<i64>,
    closed: Vec<Gap>,
    /// Number of lost ticks, those of the open gap included.
    lost: u64,
}

impl Gaps {
    /// The first tick that is not in the log yet.
    pub(crate) fn expected(&self) -> i64 {
        self.expected
    }

    /// Takes the frame of `tick` and returns the gap that ends before it; an incomplete (`torn`) frame extends the gap.
    pub(crate) fn pass(&mut self, tick: i64, torn: bool) -> Option<Gap> {
        let expected = std::mem::replace(&mut self.expected, tick + 1);
        self.lost += (tick - expected).max(0).cast_unsigned() + u64::from(torn);
        // Missing and torn ticks in a row are one gap. It ends only with a whole frame, because the next tick may be
        // torn as well.
        if tick > expected || torn {
            self.open.get_or_insert(expected);
        }
        if torn { None } else { self.close(tick - 1) }
    }

    /// Closes and returns the gap that is still open when the flight ends.
    pub(crate) fn end(&mut self) -> Option<Gap> {
        self.close(self.expected - 1)
    }

    /// All gaps that have ended, in order.
    pub(crate) fn closed(&self) -> &[Gap] {
        &self.closed
    }

    /// Number of ticks lost so far.
    pub(crate) fn lost(&self) -> u64 {
        self.lost
    }

    fn close(&mut self, last_tick: i64) -> Option<Gap> {
        let gap = Gap { first_tick: self.open.take()?, last_tick };
        self.closed.push(gap);
        Some(gap)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gap(first_tick: i64, last_tick: i64) -> Gap {
        Gap { first_tick, last_tick }
    }

    #[test]
    fn a_gap_is_reported_once_when_it_has_ended() {
        let mut gaps = Gaps::default();
        assert_eq!((gaps.pass(0, false), gaps.pass(1, false)), (None, None));
        assert_eq!((gaps.pass(5, false), gaps.pass(6, false)), (Some(gap(2, 4)), None));
        assert_eq!(
            (gaps.pass(7, true), gaps.pass(9, true), gaps.pass(10, false)),
            (None, None, Some(gap(7, 9)))
        );
        assert_eq!((gaps.end(), gaps.lost(), gaps.closed().len()), (None, 6, 2));
    }

    #[test]
    fn a_gap_at_the_end_of_the_flight_is_reported_too() {
        let mut gaps = Gaps::default();
        assert_eq!((gaps.pass(0, false), gaps.pass(1, true)), (None, None));
        assert_eq!((gaps.end(), gaps.lost()), (Some(gap(1, 1)), 1));
    }
}
