//! How long the formation takes to recover from each fault.

use super::settling::TOLERANCE_M;
use ringwing_flight::Tick;
use serde::{Deserialize, Serialize};

/// Faults listed in a summary; further ones are only counted. More make the summary of a run with many faults too long to
/// read.
const LISTED: usize = 100;

/// A fault, and how long the formation took to recover.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FaultRecovery {
    /// What happened, as a sentence.
    pub fault: String,
    /// When it happened, in simulated time.
    pub time_s: f64,
    /// Time from the fault until every slot error is within 1 m and stays so to the next fault or the end of the flight.
    /// Absent if the formation did not recover; 0 if the fault had no effect.
    pub recovery_s: Option<f64>,
}

/// Watches the largest slot error after each fault.
#[derive(Debug, Clone, Default)]
pub(super) struct RecoveryWatch {
    faults: Vec<ListedFault>,
    count: u64,
    /// Whether there were more faults than are listed. Then the last listed one is no longer watched.
    overflown: bool,
    /// The last tick that had a slot error, and the largest of them.
    newest: Option<(i64, f64)>,
}

#[derive(Debug, Clone)]
struct ListedFault {
    what: String,
    tick: i64,
    /// The first tick since which every slot error is within tolerance.
    whole_since: Option<i64>,
}

impl RecoveryWatch {
    /// Takes a disturbance of `tick`, described by `what`. Several of one tick are listed as one fault.
    pub(super) fn on_disturbance(&mut self, tick: i64, what: &str) {
        self.count += 1;
        if let Some(last) = self.faults.last_mut().filter(|last| last.tick == tick) {
            // As two faults, the first would end in the tick in which it begins, before anything could recover.
            last.what = format!("{}; {what}", last.what);
        } else if self.faults.len() < LISTED {
            // A report may come after the frame of its tick, so frames since that tick count as well.
            let after = self.newest.filter(|(newest, error_m)| *newest >= tick && *error_m <= TOLERANCE_M);
            let whole_since = after.map(|(newest, _)| newest);
            self.faults.push(ListedFault { what: what.to_owned(), tick, whole_since });
        } else {
            self.overflown = true;
        }
    }

    /// Takes the largest slot error of `tick`. A tick without one changes nothing.
    pub(super) fn observe(&mut self, tick: i64, slot_error_max_m: Option<f64>) {
        let Some(error_m) = slot_error_max_m else { return };
        self.newest = Some((tick, error_m));
        if let Some(last) = self.faults.last_mut().filter(|_| !self.overflown) {
            last.whole_since = (error_m <= TOLERANCE_M).then(|| last.whole_since.unwrap_or(tick));
        }
    }

    /// The number of faults so far.
    pub(super) fn count(&self) -> u64 {
        self.count
    }

    /// The listed faults, in order of time.
    pub(super) fn recoveries(&self, rate_hz: u32) -> Vec<FaultRecovery> {
        let recovery = |fault: &ListedFault| FaultRecovery {
            fault: fault.what.clone(),
            time_s: Tick(fault.tick).seconds(rate_hz),
            recovery_s: fault.whole_since.map(|tick| Tick(tick - fault.tick).seconds(rate_hz)),
        };
        self.faults.iter().map(recovery).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Seconds to recover from faults at `faults`, at 10 Hz, in a flight of 100 ticks with slot errors in `bad`.
    fn recoveries(faults: &[i64], bad: std::ops::Range<i64>) -> Vec<Option<f64>> {
        let mut watch = RecoveryWatch::default();
        for tick in 0..100 {
            if faults.contains(&tick) {
                watch.on_disturbance(tick, "loss");
            }
            watch.observe(tick, Some(if bad.contains(&tick) { 1.5 } else { 0.5 }));
        }
        watch.recoveries(10).into_iter().map(|recovery| recovery.recovery_s).collect()
    }

    #[test]
    fn recovery_ends_when_the_formation_is_whole_for_good() {
        assert_eq!(recoveries(&[20], 25..60), [Some(4.0)]);
        assert_eq!(recoveries(&[20], 25..100), [None]);
        assert_eq!(recoveries(&[20], 0..10), [Some(0.0)]);
    }

    #[test]
    fn a_fault_can_recover_only_until_the_next_one() {
        assert_eq!(recoveries(&[20, 50], 25..60), [None, Some(1.0)]);
        assert_eq!(recoveries(&[20, 70], 25..60), [Some(4.0), Some(0.0)]);
    }

    #[test]
    fn faults_of_one_tick_are_listed_as_one_and_many_faults_are_only_counted() {
        let mut watch = RecoveryWatch::default();
        for tick in 0..500 {
            watch.on_disturbance(tick / 2, "loss");
        }
        assert_eq!((watch.count(), watch.recoveries(10).len()), (500, LISTED));
        assert_eq!(watch.recoveries(10)[0].fault, "loss; loss");
    }

    #[test]
    fn a_late_report_gives_the_same_recovery_as_one_in_time() {
        let (mut in_time, mut late) = (RecoveryWatch::default(), RecoveryWatch::default());
        in_time.on_disturbance(7, "loss");
        for tick in 7..10 {
            in_time.observe(tick, Some(2.0 - 0.5 * (tick - 7) as f64));
            late.observe(tick, Some(2.0 - 0.5 * (tick - 7) as f64));
        }
        late.on_disturbance(7, "loss");
        assert_eq!(late.recoveries(10), in_time.recoveries(10));
    }
}
