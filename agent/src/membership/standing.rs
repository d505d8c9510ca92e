//! The standing of a UAV: its incarnation and its status in one number. Of two reports, the higher one is newer.
//!
//! Never knows when a report was made: the number alone decides.

/// Three times the incarnation, plus 0 for alive, 1 for suspected, 2 for lost.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Standing(u32);

impl Standing {
    pub(super) fn incarnation(self) -> u32 {
        self.0 / 3
    }

    pub(super) fn is_lost(self) -> bool {
        self.0 % 3 == 2
    }

    /// Suspected in the same incarnation; a lost UAV stays lost.
    pub(super) fn suspected(self) -> Self {
        // Only a damaged report can reach the last incarnation. Saturating keeps it from overflowing.
        self.max(Self((self.0 - self.0 % 3).saturating_add(1)))
    }

    /// Lost in the same incarnation.
    pub(super) fn lost(self) -> Self {
        Self((self.0 - self.0 % 3).saturating_add(2))
    }

    /// Alive in the next incarnation, which outranks a suspicion or a loss report. A standing that is alive stays as
    /// it is.
    pub(super) fn refuted(self) -> Self {
        // `u32::MAX` is a multiple of three, so rounding up cannot overflow.
        Self(self.0.div_ceil(3) * 3)
    }
}

impl From<u32> for Standing {
    fn from(number: u32) -> Self {
        Self(number)
    }
}

impl From<Standing> for u32 {
    fn from(standing: Standing) -> Self {
        standing.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lost_outranks_suspected_and_the_next_incarnation_outranks_both() {
        let alive = Standing::from(6);
        assert!(alive < alive.suspected() && alive.suspected() < alive.lost());
        assert!(alive.lost() < alive.lost().refuted());
        assert_eq!(alive.lost().refuted().incarnation(), 3);
        assert_eq!(alive.lost().suspected(), alive.lost(), "a lost UAV cannot become suspected");
    }

    #[test]
    fn a_report_of_being_alive_needs_no_refutation() {
        assert_eq!(Standing::from(6).refuted(), Standing::from(6));
    }

    #[test]
    fn no_received_number_overflows() {
        for number in [u32::MAX, u32::MAX - 1, u32::MAX - 2] {
            let standing = Standing::from(number);
            assert!(!standing.refuted().is_lost() && standing.refuted() >= standing);
            assert!(standing.lost() >= standing.suspected());
        }
    }
}
