//! Since when the formation has been whole without interruption.

/// Slot error up to which a UAV is in its slot, metres. A smaller tolerance never settles in wind or with noise; a larger one
/// calls a loose ring a formation.
const TOLERANCE_M: f64 = 1.0;
/// Seconds for which every UAV must stay in its slot. With a shorter time, a swarm that swings through its slots
/// counts as settled; with a longer one, short flights end before they settle.
const HOLD_S: u32 = 5;
/// Seconds without a measurement that do not interrupt a hold. With a shorter time, a leader that is late in real time or
/// a recorder that is replaced interrupts it; with a longer one, the formation may break and mend unseen.
const UNMEASURED_S: u32 = 1;

/// How the formation is in one tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Wholeness {
    /// Every UAV that flies on command is in its slot.
    Whole,
    /// Some UAV is not in its slot, or no UAV flies on command: nobody is no formation.
    Broken,
    /// The slots are not known in this tick, because the leader is not.
    Unmeasured,
}

impl Wholeness {
    /// Of a tick in which this many UAVs fly on command, with this largest slot error.
    pub(super) fn of(commanded: u32, slot_error_max_m: Option<f64>) -> Self {
        match slot_error_max_m {
            // First of all: without a UAV there is no slot error either, and an empty sky would pass for unmeasured.
            _ if commanded == 0 => Self::Broken,
            None => Self::Unmeasured,
            Some(error_m) if error_m <= TOLERANCE_M => Self::Whole,
            Some(_) => Self::Broken,
        }
    }
}

/// Watches for how long the formation is whole.
#[derive(Debug, Clone, Default)]
pub(super) struct Hold {
    /// The first and the last tick of the present hold.
    ticks: Option<(i64, i64)>,
}

impl Hold {
    /// Takes the next tick of a flight at `rate_hz`.
    pub(super) fn observe(&mut self, tick: i64, wholeness: Wholeness, rate_hz: u32) {
        self.ticks = match (wholeness, self.ticks) {
            (Wholeness::Broken, _) => None,
            // It neither ends nor extends the hold: the next whole tick decides by the length of the gap.
            (Wholeness::Unmeasured, ticks) => ticks,
            (Wholeness::Whole, Some((since, until))) if tick - until <= ticks(UNMEASURED_S, rate_hz) => {
                Some((since, tick))
            }
            (Wholeness::Whole, _) => Some((tick, tick)),
        };
    }

    /// The first tick of the present hold.
    pub(super) fn since(&self) -> Option<i64> {
        self.ticks.map(|(since, _)| since)
    }

    /// The first tick of the present hold, if it has lasted long enough for a formation that is there to stay.
    pub(super) fn settled_since(&self, rate_hz: u32) -> Option<i64> {
        // Up to the last whole tick: time that nobody measured at the end does not count.
        self.ticks.filter(|(since, until)| until - since >= ticks(HOLD_S, rate_hz)).map(|(since, _)| since)
    }
}

fn ticks(seconds: u32, rate_hz: u32) -> i64 {
    i64::from(seconds) * i64::from(rate_hz)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nobody_is_no_formation_and_an_error_at_the_tolerance_is_whole() {
        assert_eq!(Wholeness::of(0, None), Wholeness::Broken);
        assert_eq!(Wholeness::of(6, None), Wholeness::Unmeasured);
        assert_eq!(Wholeness::of(6, Some(1.0)), Wholeness::Whole);
        assert_eq!(Wholeness::of(6, Some(1.001)), Wholeness::Broken);
    }

    #[test]
    fn a_hold_counts_after_five_seconds_in_which_it_was_measured() {
        let mut hold = Hold::default();
        for tick in 0..=49 {
            hold.observe(tick, Wholeness::Whole, 10);
        }
        assert_eq!((hold.since(), hold.settled_since(10)), (Some(0), None));
        hold.observe(50, Wholeness::Unmeasured, 10);
        assert_eq!(hold.settled_since(10), None, "what was not measured does not count");
        hold.observe(51, Wholeness::Whole, 10);
        assert_eq!(hold.settled_since(10), Some(0), "a short gap does not interrupt");
        hold.observe(62, Wholeness::Whole, 10);
        assert_eq!((hold.since(), hold.settled_since(10)), (Some(62), None), "a long gap does");
        hold.observe(63, Wholeness::Broken, 10);
        assert_eq!(hold.since(), None);
    }
}
