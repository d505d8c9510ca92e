//! When the formation has settled.

use super::hold::{Hold, Wholeness};

/// Watches whether the formation is whole.
#[derive(Debug, Clone)]
pub(super) struct Settling {
    rate_hz: u32,
    hold: Hold,
    settled_at: Option<i64>,
}

impl Settling {
    pub(super) fn new(rate_hz: u32) -> Self {
        Self { rate_hz, hold: Hold::default(), settled_at: None }
    }

    /// Takes the next tick.
    pub(super) fn observe(&mut self, tick: i64, wholeness: Wholeness) {
        self.hold.observe(tick, wholeness, self.rate_hz);
        // The first time counts. What later faults do is measured as recovery.
        self.settled_at = self.settled_at.or_else(|| self.hold.settled_since(self.rate_hz));
    }

    /// The tick since which the formation held for long enough.
    pub(super) fn settled_at(&self) -> Option<i64> {
        self.settled_at
    }

    /// The tick since which an unsettled formation has been whole: the flight ended before it could count as settled.
    pub(super) fn unfinished_since(&self) -> Option<i64> {
        self.hold.since().filter(|_| self.settled_at.is_none())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Settling at 10 Hz of a flight of 200 ticks in which the formation begins or ceases to hold at each of `turns`:
    /// since when it has settled, and since when it has been whole without having settled.
    fn settled_at(turns: &[i64]) -> (Option<i64>, Option<i64>) {
        let mut settling = Settling::new(10);
        for tick in 0..200 {
            let holds = turns.iter().filter(|turn| **turn <= tick).count() % 2 == 1;
            settling.observe(tick, if holds { Wholeness::Whole } else { Wholeness::Broken });
        }
        (settling.settled_at(), settling.unfinished_since())
    }

    #[test]
    fn a_formation_that_holds_for_five_seconds_has_settled() {
        assert_eq!(settled_at(&[30, 81]), (Some(30), None));
        assert_eq!(settled_at(&[30, 80]), (None, None));
        assert_eq!(settled_at(&[30, 80, 90]), (Some(90), None));
    }

    #[test]
    fn a_later_error_does_not_unsettle_the_formation() {
        assert_eq!(settled_at(&[30, 100, 120]), (Some(30), None));
    }

    #[test]
    fn a_formation_that_holds_for_less_than_five_seconds_at_the_end_has_not_settled() {
        assert_eq!(settled_at(&[199]), (None, Some(199)));
        assert_eq!(settled_at(&[150]), (None, Some(150)));
        assert_eq!(settled_at(&[149]), (Some(149), None));
        assert_eq!(settled_at(&[]), (None, None));
    }
}
