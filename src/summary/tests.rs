use super::*;
use ringwing_flight::WorldReport;
use ringwing_recorder::{RecorderReport, metrics::FlightSummary};
use std::{path::PathBuf, time::Duration};

fn outcome(ticks: i64, flight_time: Duration, flight: FlightSummary) -> Outcome {
    Outcome {
        added_faults: Vec::new(),
        folder: PathBuf::from("runs/test"),
        world: Some(WorldReport {
            last_tick: ticks,
            complete: true,
            payload_hash: "00ff".into(),
            collisions: Vec::new(),
            failsafes: 0,
            refused_commands: 0,
            reused_commands: 0,
            missed_deadlines: 0,
            unanswered_ticks: 0,
            late_max_us: 0.0,
            latency: None,
        }),
        recorder: Some(RecorderReport { summary: flight, ..RecorderReport::default() }),
        failures: Vec::new(),
        ticks,
        flight_time,
        start_time: Duration::ZERO,
    }
}

fn summary(scenario: &Scenario, outcome: &Outcome) -> Summary {
    of_run(scenario, outcome, false, "ringwing run".into())
}

fn flown() -> FlightSummary {
    FlightSummary { ticks: 1000, commanded: 6, ..FlightSummary::default() }
}

#[test]
fn the_real_time_factor_is_absent_where_it_cannot_be_measured() {
    let factor = |ticks, flight_time| {
        let summary = summary(&Scenario::default(), &outcome(ticks, flight_time, flown()));
        assert!(summary.simulated_s >= 0.0 && summary.ticks >= 0);
        summary.real_time_factor
    };
    assert_eq!(factor(1000, Duration::from_secs(2)), Some(5.0));
    assert_eq!(factor(1000, Duration::from_nanos(2200)), None);
    assert_eq!(factor(-1, Duration::from_secs(1)), None);
    assert_eq!(factor(-1, Duration::ZERO), None);
}

#[test]
fn a_seed_above_what_a_float_holds_is_text_too() {
    let scenario = Scenario { seed: u64::MAX - 1, ..Scenario::default() };
    let json = summary(&scenario, &outcome(1000, Duration::from_secs(1), flown())).to_json();
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(json["seed_text"], "18446744073709551614");
}

#[test]
fn a_flight_that_nobody_measured_does_not_pass() {
    let summary =
        summary(&Scenario::default(), &outcome(1000, Duration::from_secs(1), FlightSummary::default()));
    assert_eq!(summary.verdict, Verdict::Violated);
    let text = SummaryText(&summary).to_string();
    assert!(text.contains("no tick of the flight was measured"), "{text}");
}

#[test]
fn a_formation_that_was_not_seen_to_settle_says_so() {
    let scenario = Scenario::default();
    let text =
        |flight| SummaryText(&summary(&scenario, &outcome(1000, Duration::from_secs(1), flight))).to_string();
    let unfinished = text(FlightSummary { whole_since_s: Some(7.0), ..flown() });
    let line = unfinished.lines().find(|line| line.contains("settled within")).unwrap().to_owned();
    assert!(line.contains("not seen to the end") && line.contains("since 7.00 s"), "{line}");
    assert!(text(flown()).contains("never"));
    assert!(!unfinished.contains("UAVs on command"));
    let alone = text(FlightSummary { commanded: 1, ..flown() });
    assert!(
        alone.lines().any(|line| line.contains("UAVs on command at the end") && line.ends_with("1 of 6"))
    );
}
