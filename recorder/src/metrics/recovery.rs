//! How long the formation takes to be whole again after each fault.

use super::settling::TOLERANCE_M;
use ringwing_flight::Tick;
use serde::{Deserialize, Serialize};

/// More faults than this are counted and not listed.
const LISTED: usize = 100;

/// A fault, and how long it was felt.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FaultRecovery {
    /// What happened.
    pub fault: String,
    /// When.
    pub time_s: f64,
    /// From then until every slot error was within 1 m and stayed so, to the next fault or the end of the flight; absent
    /// where it never was. 0 for a fault that nobody felt.
    pub recovery_s: Option<f64>,
}

/// Watches the largest slot error after each fault.
#[derive(Debug, Clone, Default)]
pub(super) struct RecoveryWatch {
    faults: Vec<Felt>,
    count: u64,
    /// There was one more than are listed, which ends the time of the last of those.
    overflown: bool,
    /// The last tick that had a slot error, and the largest of them.
    newest: Option<(i64, f64)>,
}

#[derive(Debug, Clone)]
struct Felt {
    what: String,
    tick: i64,
    /// The first tick of those within tolerance, without one outside since.
    whole_since: Option<i64>,
}

impl RecoveryWatch {
    /// Takes a disturbance of `tick`, described by `what`; several of one tick are one.
    pub(super) fn on_disturbance(&mut self, tick: i64, what: &str) {
        self.count += 1;
        if let Some(last) = self.faults.last_mut().filter(|last| last.tick == tick) {
            last.what = format!("{}; {what}", last.what);
        } else if self.faults.len() < LISTED {
            // One that is reported after the frame of its tick counts from there on as well.
            let after = self.newest.filter(|(newest, error_m)| *newest >= tick && *error_m <= TOLERANCE_M);
            let whole_since = after.map(|(newest, _)| newest);
            self.faults.push(Felt { what: what.to_owned(), tick, whole_since });
        } else {
            self.overflown = true;
        }
    }

    /// Takes the largest slot error of `tick`; a tick without one says nothing.
    pub(super) fn observe(&mut self, tick: i64, slot_error_max_m: Option<f64>) {
        let Some(error_m) = slot_error_max_m else { return };
        self.newest = Some((tick, error_m));
        if let Some(last) = self.faults.last_mut().filter(|_| !self.overflown) {
            last.whole_since = (error_m <= TOLERANCE_M).then(|| last.whole_since.unwrap_or(tick));
        }
    }

    /// How many faults there were.
    pub(super) fn count(&self) -> u64 {
        self.count
    }

    /// The first of them, in order of time.
    pub(super) fn recoveries(&self, rate_hz: u32) -> Vec<FaultRecovery> {
        let recovery = |felt: &Felt| FaultRecovery {
            fault: felt.what.clone(),
            time_s: Tick(felt.tick).seconds(rate_hz),
            recovery_s: felt.whole_since.map(|tick| Tick(tick - felt.tick).seconds(rate_hz)),
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
    fn a_fault_is_felt_until_the_formation_is_whole_for_good() {
        assert_eq!(recoveries(&[20], 25..60), [Some(4.0)]);
        assert_eq!(recoveries(&[20], 25..100), [None]);
        assert_eq!(recoveries(&[20], 0..10), [Some(0.0)]);
    }

    #[test]
    fn a_fault_before_the_next_one_has_until_then() {
        assert_eq!(recoveries(&[20, 50], 25..60), [None, Some(1.0)]);
        assert_eq!(recoveries(&[20, 70], 25..60), [Some(4.0), Some(0.0)]);
    }

    #[test]
    fn faults_of_one_tick_are_one_and_a_flood_is_counted() {
        let mut watch = RecoveryWatch::default();
        for tick in 0..500 {
            watch.on_disturbance(tick / 2, "loss");
        }
        assert_eq!((watch.count(), watch.recoveries(10).len()), (500, LISTED));
        assert_eq!(watch.recoveries(10)[0].fault, "loss; loss");
    }
}
