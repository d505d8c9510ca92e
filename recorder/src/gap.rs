//! Ticks that the log does not have, or not whole: counted, and told once for each gap.

use serde::{Deserialize, Serialize};

/// Ticks in a row that were lost.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Gap {
    /// The first of them.
    pub first_tick: i64,
    /// The last of them.
    pub last_tick: i64,
}

/// Watches the numbers of the frames.
#[derive(Debug, Default)]
pub(crate) struct Gaps {
    /// The tick that comes next if none is lost.
    expected: i64,
    /// Where the gap began that is going on.
    open: Option<i64>,
    told: Vec<Gap>,
    lost: u64,
}

impl Gaps {
    /// The next tick that is not in the log yet.
    pub(crate) fn expected(&self) -> i64 {
        self.expected
    }

    /// The gap that ends with the whole frame of `tick`; a `torn` one prolongs it.
    pub(crate) fn pass(&mut self, tick: i64, torn: bool) -> Option<Gap> {
        let expected = std::mem::replace(&mut self.expected, tick + 1);
        self.lost += (tick - expected).max(0).cast_unsigned() + u64::from(torn);
        if tick > expected || torn {
            self.open.get_or_insert(expected);
        }
        if torn { None } else { self.close(tick - 1) }
    }

    /// The gap that is still open when the flight ends.
    pub(crate) fn end(&mut self) -> Option<Gap> {
        self.close(self.expected - 1)
    }

    /// All gaps that have ended.
    pub(crate) fn told(&self) -> &[Gap] {
        &self.told
    }

    /// How many ticks are lost so far.
    pub(crate) fn lost(&self) -> u64 {
        self.lost
    }

    fn close(&mut self, last_tick: i64) -> Option<Gap> {
        let gap = Gap { first_tick: self.open.take()?, last_tick };
        self.told.push(gap);
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
    fn a_gap_is_told_once_when_it_has_ended() {
        let mut gaps = Gaps::default();
        assert_eq!((gaps.pass(0, false), gaps.pass(1, false)), (None, None));
        assert_eq!((gaps.pass(5, false), gaps.pass(6, false)), (Some(gap(2, 4)), None));
        assert_eq!(
            (gaps.pass(7, true), gaps.pass(9, true), gaps.pass(10, false)),
            (None, None, Some(gap(7, 9)))
        );
        assert_eq!((gaps.end(), gaps.lost(), gaps.told().len()), (None, 6, 2));
    }

    #[test]
    fn a_gap_at_the_end_is_told_too() {
        let mut gaps = Gaps::default();
        assert_eq!((gaps.pass(0, false), gaps.pass(1, true)), (None, None));
        assert_eq!((gaps.end(), gaps.lost()), (Some(gap(1, 1)), 1));
    }
}
