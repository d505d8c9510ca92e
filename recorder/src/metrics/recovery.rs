//! How long the formation takes to recover from each fault, and to take up the formation of each manoeuvre.
//!
//! Must never call a formation recovered that was not seen whole for as long as a settled one.

use super::hold::{Hold, Wholeness};
use ringwing_flight::Tick;
use serde::{Deserialize, Serialize};

/// Moments with faults in a summary; further ones are only counted. More make the summary of a run with many faults too
/// long to read.
const LISTED: usize = 100;
/// Faults of one moment that are named; the others are only counted. More make a line too long to read.
const NAMED: usize = 3;

/// The faults and manoeuvres of one moment, and how long the formation took to recover.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct FaultRecovery {
    /// What happened, as a sentence; several are separated by semicolons.
    pub fault: String,
    /// Number of faults at that moment; 0 if there was only a manoeuvre.
    pub faults: u64,
    /// When it happened, in simulated time.
    pub time_s: f64,
    /// Time from the fault until every slot error is within 1 m and stays so for at least 5 s and to the next fault or
    /// the end of the flight; 0 if the fault had no effect. Absent if no such recovery was seen.
    pub recovery_s: Option<f64>,
    /// When the next fault came, if that was before the formation had recovered.
    pub cut_short_s: Option<f64>,
    /// What that next fault was.
    pub cut_short_by: Option<String>,
}

/// All recoveries of a flight.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Recoveries {
    /// Number of faults.
    pub(super) faults: u64,
    /// Number of moments at which there were faults.
    pub(super) moments: u64,
    /// Number of those that the next one cut short.
    pub(super) cut_short: u64,
    /// The longest recovery; absent unless the formation recovered from every fault.
    pub(super) longest_s: Option<f64>,
    /// The first moments, the one with the longest recovery, and the last one, in order of time.
    pub(super) listed: Vec<FaultRecovery>,
}

/// A fault or the start of a manoeuvre.
#[derive(Debug, Clone)]
pub(super) struct Disturbance {
    pub(super) tick: i64,
    pub(super) text: String,
    pub(super) is_fault: bool,
}

/// Watches whether the formation is whole after each fault and manoeuvre.
#[derive(Debug, Clone)]
pub(super) struct RecoveryWatch {
    rate_hz: u32,
    /// The first moments whose recovery is over.
    first: Vec<FaultRecovery>,
    /// Of all later ones, the one with the longest recovery.
    worst: Option<FaultRecovery>,
    /// The newest moment, whose recovery goes on.
    newest: Option<FaultMoment>,
    faults: u64,
    moments: u64,
    cut_short: u64,
    /// The longest of the recoveries that are over.
    longest_s: Option<f64>,
    /// The last tick that was observed, and how the formation was.
    observed: Option<(i64, Wholeness)>,
}

/// The faults and manoeuvres of one tick.
#[derive(Debug, Clone)]
struct FaultMoment {
    named: Vec<String>,
    /// How many more there are.
    unnamed: u64,
    faults: u64,
    tick: i64,
    /// How long the formation has been whole since.
    hold: Hold,
}

impl FaultMoment {
    fn new(tick: i64) -> Self {
        Self { named: Vec::new(), unnamed: 0, faults: 0, tick, hold: Hold::default() }
    }

    fn add(&mut self, what: &Disturbance) {
        self.faults += u64::from(what.is_fault);
        if self.named.len() < NAMED {
            self.named.push(what.text.clone());
        } else {
            self.unnamed += 1;
        }
    }

    /// Its faults as one sentence.
    fn text(&self) -> String {
        let more = self.unnamed;
        let rest = if more > 0 { format!("; and {more} more at once") } else { String::new() };
        self.named.join("; ") + &rest
    }

    fn recovery(&self, rate_hz: u32) -> FaultRecovery {
        let settled = self.hold.settled_since(rate_hz);
        FaultRecovery {
            fault: self.text(),
            faults: self.faults,
            time_s: Tick(self.tick).seconds(rate_hz),
            recovery_s: settled.map(|tick| Tick(tick - self.tick).seconds(rate_hz)),
            cut_short_s: None,
            cut_short_by: None,
        }
    }
}

impl RecoveryWatch {
    pub(super) fn new(rate_hz: u32) -> Self {
        Self {
            rate_hz,
            first: Vec::new(),
            worst: None,
            newest: None,
            faults: 0,
            moments: 0,
            cut_short: 0,
            longest_s: None,
            observed: None,
        }
    }

    /// Takes a disturbance. Several of one tick are one moment: as two, the first would end in the tick in which it begins,
    /// before anything could recover.
    pub(super) fn on_disturbance(&mut self, what: &Disturbance) {
        let tick = what.tick;
        self.faults += u64::from(what.is_fault);
        if let Some(newest) = self.newest.as_mut().filter(|newest| newest.tick == tick) {
            newest.add(what);
            return;
        }
        self.moments += 1;
        let mut moment = FaultMoment::new(tick);
        moment.add(what);
        match self.newest.take() {
            // A report that comes after that of a later fault: nobody watched between the two.
            Some(newest) if newest.tick > tick => {
                self.close(&moment, &newest);
                self.newest = Some(newest);
            }
            before => {
                if let Some(before) = before {
                    self.close(&before, &moment);
                }
                // A report may come after the frame of its tick, so the newest frame counts as well.
                if let Some((observed, wholeness)) = self.observed.filter(|(observed, _)| *observed >= tick) {
                    moment.hold.observe(observed, wholeness, self.rate_hz);
                }
                self.newest = Some(moment);
            }
        }
    }

    /// Ends the recovery of `moment`, because `next` has come.
    fn close(&mut self, moment: &FaultMoment, next: &FaultMoment) {
        let mut recovery = moment.recovery(self.rate_hz);
        if recovery.recovery_s.is_none() {
            self.cut_short += 1;
            recovery.cut_short_s = Some(Tick(next.tick).seconds(self.rate_hz));
            recovery.cut_short_by = Some(next.text());
        }
        self.longest_s = longer(self.longest_s, recovery.recovery_s);
        // Two places are for the worst and the last.
        if self.first.len() < LISTED - 2 {
            self.first.push(recovery);
        } else if self.worst.as_ref().is_none_or(|worst| recovery.recovery_s > worst.recovery_s) {
            self.worst = Some(recovery);
        }
    }

    /// Takes the next tick.
    pub(super) fn observe(&mut self, tick: i64, wholeness: Wholeness) {
        self.observed = Some((tick, wholeness));
        if let Some(newest) = &mut self.newest {
            newest.hold.observe(tick, wholeness, self.rate_hz);
        }
    }

    /// All recoveries so far.
    pub(super) fn recoveries(&self) -> Recoveries {
        let last = self.newest.as_ref().map(|newest| newest.recovery(self.rate_hz));
        let has_recovered =
            self.cut_short == 0 && last.as_ref().is_some_and(|last| last.recovery_s.is_some());
        let longest_s = longer(self.longest_s, last.as_ref().and_then(|last| last.recovery_s));
        let mut listed: Vec<_> = self.first.iter().chain(&self.worst).cloned().chain(last).collect();
        // A late report is listed where it belongs.
        listed.sort_by(|one, other| one.time_s.total_cmp(&other.time_s));
        Recoveries {
            faults: self.faults,
            moments: self.moments,
            cut_short: self.cut_short,
            longest_s: longest_s.filter(|_| has_recovered),
            listed,
        }
    }
}

fn longer(one: Option<f64>, other: Option<f64>) -> Option<f64> {
    one.into_iter().chain(other).reduce(f64::max)
}

#[cfg(test)]
mod tests;
