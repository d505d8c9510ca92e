//! When the formation has settled.

/// Slot error up to which a UAV is in its slot, metres. A smaller tolerance never settles in wind or with noise; a larger one
/// calls a loose ring a formation.
pub(super) const TOLERANCE_M: f64 = 1.0;
/// Seconds for which every UAV must stay in its slot. With a shorter time, a swarm that swings through its slots
/// counts as settled; with a longer one, short flights end before they settle.
const HOLD_S: u32 = 5;

/// Watches the largest slot error.
#[derive(Debug, Clone)]
pub(super) struct Settling {
    hold_ticks: i64,
    /// The first tick since which every slot error is within tolerance.
    holding_since: Option<i64>,
    settled_at: Option<i64>,
}

impl Settling {
    pub(super) fn new(rate_hz: u32) -> Self {
        Self { hold_ticks: i64::from(HOLD_S * rate_hz), holding_since: None, settled_at: None }
    }

    /// Takes the largest slot error of `tick`. A tick without one changes nothing.
    pub(super) fn observe(&mut self, tick: i64, slot_error_max_m: Option<f64>) {
        let Some(error_m) = slot_error_max_m else { return };
        if error_m > TOLERANCE_M {
            self.holding_since = None;
            return;
        }
        let since = *self.holding_since.get_or_insert(tick);
        if tick - since >= self.hold_ticks {
            // The first time counts. What later faults do is measured as recovery.
            self.settled_at.get_or_insert(since);
        }
    }

    /// The tick since which the formation held for long enough, or has held until the end of the flight.
    pub(super) fn settled_at(&self) -> Option<i64> {
        self.settled_at.or(self.holding_since)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Settling at 10 Hz of a flight of 200 ticks in which the formation begins or ceases to hold at each of `turns`.
    fn settled_at(turns: &[i64]) -> Option<i64> {
        let mut settling = Settling::new(10);
        for tick in 0..200 {
            let holds = turns.iter().filter(|turn| **turn <= tick).count() % 2 == 1;
            settling.observe(tick, Some(if holds { 0.0 } else { 2.0 }));
        }
        settling.settled_at()
    }

    #[test]
    fn a_formation_that_holds_for_five_seconds_has_settled() {
        assert_eq!(settled_at(&[30, 81]), Some(30));
        assert_eq!(settled_at(&[30, 80]), None);
        assert_eq!(settled_at(&[30, 80, 90]), Some(90));
    }

    #[test]
    fn a_later_error_does_not_unsettle_the_formation() {
        assert_eq!(settled_at(&[30, 100, 120]), Some(30));
    }

    #[test]
    fn a_formation_that_holds_at_the_end_of_the_flight_has_settled() {
        assert_eq!(settled_at(&[199]), Some(199));
        assert_eq!(settled_at(&[]), None);
    }

    #[test]
    fn an_error_at_the_tolerance_counts_as_settled_and_a_missing_error_changes_nothing() {
        let mut settling = Settling::new(10);
        settling.observe(0, Some(1.0));
        settling.observe(1, None);
        assert_eq!(settling.settled_at(), Some(0));
    }
}
