//! A member's standing: its incarnation, and what is said of it, in one number that only grows.

/// Three times the incarnation, and 0 for living, 1 for suspected, 2 for lost.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Standing(u32);

impl Standing {
    pub(super) fn incarnation(self) -> u32 {
        self.0 / 3
    }

    pub(super) fn is_lost(self) -> bool {
        self.0 % 3 == 2
    }

    pub(super) fn suspected(self) -> Self {
        self.max(Self((self.0 - self.0 % 3).saturating_add(1)))
    }

    pub(super) fn lost(self) -> Self {
        Self((self.0 - self.0 % 3).saturating_add(2))
    }

    /// That of a member of which this is said, and which lives.
    pub(super) fn refuted(self) -> Self {
        // The largest number is a multiple of three: this cannot overflow.
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
    fn lost_outweighs_suspected_and_a_new_incarnation_outweighs_both() {
        let alive = Standing::from(6);
        assert!(alive < alive.suspected() && alive.suspected() < alive.lost());
        assert!(alive.lost() < alive.lost().refuted());
        assert_eq!(alive.lost().refuted().incarnation(), 3);
        assert_eq!(alive.lost().suspected(), alive.lost(), "who is lost is not suspected any more");
    }

    #[test]
    fn what_is_said_of_the_living_needs_no_refuting() {
        assert_eq!(Standing::from(6).refuted(), Standing::from(6));
    }

    #[test]
    fn no_number_overflows() {
        for number in [u32::MAX, u32::MAX - 1, u32::MAX - 2] {
            let standing = Standing::from(number);
            assert!(!standing.refuted().is_lost() && standing.refuted() >= standing);
            assert!(standing.lost() >= standing.suspected());
        }
    }
}
