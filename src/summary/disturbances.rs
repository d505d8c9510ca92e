//! The lines of the summary about faults, lost processes and chance.
//!
//! Never computes a value; each is in the flight's summary already.

use super::line::{NOT_SEEN, line, paragraph};
use ringwing_flight::counted;
use ringwing_recorder::metrics::{ChanceEvent, FaultRecovery, FlightSummary, UnplannedLoss};
use std::fmt;

/// Moments with faults, and losses, listed one by one; the summary only counts the others. More lines push the verdict off
/// a terminal.
const LISTED: usize = 12;

/// Writes how the formation recovered from the faults of each moment.
pub(super) fn write_recoveries(f: &mut fmt::Formatter<'_>, flight: &FlightSummary) -> fmt::Result {
    let shown = shown(&flight.recoveries);
    for recovery in &shown {
        let (value, end) = outcome(recovery);
        let FaultRecovery { fault, time_s, .. } = recovery;
        let after = if recovery.faults == 0 { "a manoeuvre" } else { "a fault" };
        line(f, &format!("settled again after {after}"), &value, &format!("{fault} at {time_s:.2} s{end}"))?;
    }
    let moments = flight.fault_moments.saturating_sub(shown.len() as u64);
    if moments == 0 {
        return Ok(());
    }
    // Subtract instead of adding up the rest: the list of moments is capped, the totals are not.
    let faults = flight.faults - shown.iter().map(|recovery| recovery.faults).sum::<u64>();
    let cut_short = flight.recoveries_cut_short - shown.iter().filter(|one| is_cut_short(one)).count() as u64;
    let remark = format!("{}, {cut_short} cut short by the next one", counted(faults, "fault"));
    line(f, "faults at other moments", &counted(moments, "moment"), &remark)
}

fn is_cut_short(recovery: &FaultRecovery) -> bool {
    recovery.cut_short_s.is_some()
}

/// The first few, and always the one with the longest recovery and the last one, in order of time.
fn shown(recoveries: &[FaultRecovery]) -> Vec<&FaultRecovery> {
    let last = recoveries.len().saturating_sub(1);
    // Of equally long ones the first.
    let worst = (0..recoveries.len()).rev().max_by(|one, other| {
        // A recovery without an end has no length, so every other one is longer.
        let seconds = |place: usize| recoveries[place].recovery_s.unwrap_or(-1.0);
        seconds(*one).total_cmp(&seconds(*other))
    });
    let is_always = |place: usize| place == last || Some(place) == worst;
    // The worst and the last have their places in the list before the others share what is left.
    let mut others = LISTED - (0..recoveries.len()).filter(|place| is_always(*place)).count();
    let is_shown = |(place, _): &(usize, &FaultRecovery)| {
        let has_room = !is_always(*place) && others > 0;
        others -= usize::from(has_room);
        is_always(*place) || has_room
    };
    recoveries.iter().enumerate().filter(is_shown).map(|(_, recovery)| recovery).collect()
}

/// How a recovery went, and what the remark says of its end.
fn outcome(recovery: &FaultRecovery) -> (String, String) {
    match (recovery.recovery_s, recovery.cut_short_s, &recovery.cut_short_by) {
        (Some(recovery_s), ..) => (format!("{recovery_s:.2} s"), String::new()),
        (None, Some(time_s), Some(by)) => ("cut short".into(), format!("; then {by} at {time_s:.2} s")),
        (None, ..) => (NOT_SEEN.into(), String::new()),
    }
}

/// Writes which processes were lost although no fault of the run asked for it.
pub(super) fn write_losses(f: &mut fmt::Formatter<'_>, flight: &FlightSummary) -> fmt::Result {
    let losses = flight.unplanned_loss_list.iter().take(LISTED);
    for UnplannedLoss { process, time_s, cause, .. } in losses {
        line(f, "lost unplanned", process, &format!("{cause} at {time_s:.2} s"))?;
    }
    match flight.unplanned_losses.saturating_sub(LISTED as u64) {
        0 => Ok(()),
        more => line(f, "more lost unplanned", &more.to_string(), ""),
    }
}

/// Writes by what the flight depends on chance, if it does.
pub(super) fn write_chance(f: &mut fmt::Formatter<'_>, flight: &FlightSummary) -> fmt::Result {
    let Some(ChanceEvent { what, time_s }) = flight.chance_event_list.first() else { return Ok(()) };
    let rest = match flight.chance_events - 1 {
        0 => String::new(),
        more => format!(", and {} by chance", counted(more, "more event")),
    };
    let text = format!("this flight is not repeatable: {what} at {time_s:.2} s{rest}");
    paragraph(f, "           ", &text)
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Text<'f>(&'f FlightSummary);

    impl fmt::Display for Text<'_> {
        fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            write_recoveries(f, self.0)?;
            write_losses(f, self.0)?;
            write_chance(f, self.0)
        }
    }

    /// The lines about `flight`, with single spaces.
    fn lines(flight: &FlightSummary) -> Vec<String> {
        let words = |line: &str| line.split_whitespace().collect::<Vec<_>>().join(" ");
        Text(flight).to_string().lines().map(words).collect()
    }

    fn recovery(number: u32, recovery_s: Option<f64>) -> FaultRecovery {
        FaultRecovery {
            fault: format!("fault {number}"),
            faults: 1,
            time_s: f64::from(number),
            recovery_s,
            ..FaultRecovery::default()
        }
    }

    fn cut_short(number: u32) -> FaultRecovery {
        FaultRecovery {
            cut_short_s: Some(f64::from(number + 1)),
            cut_short_by: Some(format!("fault {}", number + 1)),
            ..recovery(number, None)
        }
    }

    #[test]
    fn each_outcome_of_a_recovery_is_told() {
        let recoveries = vec![cut_short(1), recovery(2, Some(6.05)), recovery(3, None)];
        let flight = FlightSummary {
            faults: 3,
            fault_moments: 3,
            recoveries_cut_short: 1,
            recoveries,
            ..FlightSummary::default()
        };
        assert_eq!(
            lines(&flight),
            [
                "settled again after a fault cut short fault 1 at 1.00 s; then fault 2 at 2.00 s",
                "settled again after a fault 6.05 s fault 2 at 2.00 s",
                "settled again after a fault not seen to the end fault 3 at 3.00 s",
            ]
        );
    }

    #[test]
    fn a_shortened_list_shows_the_worst_and_the_last_and_counts_the_others() {
        let mut recoveries: Vec<_> = (1..=30).map(cut_short).collect();
        recoveries[20] = recovery(21, Some(18.1));
        recoveries[25] = recovery(26, Some(2.0));
        recoveries[29] = recovery(30, Some(1.0));
        let flight = FlightSummary {
            faults: 45,
            fault_moments: 30,
            recoveries_cut_short: 27,
            recoveries,
            ..FlightSummary::default()
        };
        let lines = lines(&flight);
        assert_eq!(lines.len(), LISTED + 1);
        assert_eq!(lines[LISTED - 2], "settled again after a fault 18.10 s fault 21 at 21.00 s");
        assert_eq!(lines[LISTED - 1], "settled again after a fault 1.00 s fault 30 at 30.00 s");
        assert_eq!(
            lines[LISTED],
            "faults at other moments 18 moments 33 faults, 17 cut short by the next one"
        );
    }

    #[test]
    fn losses_and_chance_are_told() {
        let loss = |number: u32| UnplannedLoss {
            process: format!("uav {number}"),
            time_s: 12.5,
            cause: "killed by signal 9 (SIGKILL)".into(),
            signal: Some(9),
        };
        let chance = ChanceEvent { what: "uav 1 was killed".into(), time_s: 12.5 };
        let flight = FlightSummary {
            unplanned_losses: 14,
            unplanned_loss_list: (1..=14).map(loss).collect(),
            chance_events: 2,
            chance_event_list: vec![chance.clone(), chance],
            ..FlightSummary::default()
        };
        let lines = lines(&flight);
        assert_eq!(lines[0], "lost unplanned uav 1 killed by signal 9 (SIGKILL) at 12.50 s");
        assert_eq!(lines[LISTED], "more lost unplanned 2");
        let chance = "this flight is not repeatable: uav 1 was killed at 12.50 s, and 1 more event by chance";
        assert_eq!(lines[LISTED + 1..], [chance]);
        assert_eq!(Text(&FlightSummary::default()).to_string(), "");
    }
}
