//! `ringwing conform`: controllers that are fit, and broken ones, each of which fails for its own reason.

use crate::{c_controllers::broken_in_cpp, controllers::consensus, harness::ringwing};
use serde_json::Value;
use std::{fs, path::Path, process::Command};

/// The report on the controller `command`, whose exit code has to be `code`, and the folder of its flights; of the checks
/// `only`, or of all.
fn report(command: &str, only: Option<&str>, code: i32) -> (Value, tempfile::TempDir) {
    let folder = tempfile::tempdir().unwrap();
    let mut conform = ringwing();
    conform.args(["conform", command, "--json", "--out"]).arg(folder.path().join("flights"));
    conform.args(only.iter().flat_map(|checks| ["--only", *checks]));
    let output = conform.output().unwrap();
    let errors = String::from_utf8_lossy(&output.stderr);
    let report: Value = serde_json::from_slice(&output.stdout).unwrap_or_else(|_| panic!("{errors}"));
    assert_eq!(output.status.code(), Some(code), "{report:#}\n{errors}");
    assert_eq!(report["fit"], code == 0, "{report:#}");
    (report, folder)
}

/// The grade of a check, and its reasons.
fn grade(report: &Value, check: &str) -> (String, String) {
    let rows = report["checks"].as_array().unwrap();
    let row = rows.iter().find(|row| row["check"] == check).unwrap_or_else(|| panic!("{check}: {report:#}"));
    let reasons = row["reasons"].as_array().unwrap().iter().map(|reason| reason.as_str().unwrap());
    (row["grade"].as_str().unwrap().into(), reasons.collect::<Vec<_>>().join("\n"))
}

/// Asserts that the report finds fault with `check`, for a reason that contains `text`.
fn assert_not_fit(report: &Value, check: &str, text: &str) {
    let (grade, reasons) = grade(report, check);
    assert!(grade == "not_fit" && reasons.contains(text), "{check}: {grade}, no {text:?} in {reasons}");
}

#[test]
fn the_consensus_law_is_fit_and_each_flight_has_its_own_folder() {
    let (report, folder) = report(consensus(), None, 0);
    let checks = report["checks"].as_array().unwrap();
    let flights = checks.iter().flat_map(|row| row["folders"].as_array().unwrap());
    let logs = flights.map(|flight| {
        let flight = Path::new(flight.as_str().unwrap());
        assert!(flight.starts_with(folder.path()) && flight.join("scenario.toml").exists(), "{flight:?}");
    });
    assert_eq!(logs.count(), checks.len() + 1, "one flight for each check, and a second one to compare");
    let of = |key: &str| report["latency"][key].as_f64().unwrap();
    assert!(of("p50_us") > 0.0 && of("p50_us") <= of("p99_us") && of("p99_us") <= of("max_us"), "{report:#}");
}

#[test]
fn the_built_in_law_passes_the_same_checks() {
    let folder = tempfile::tempdir().unwrap();
    let output = ringwing().args(["conform", "--built-in"]).current_dir(folder.path()).output().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    assert_eq!(output.status.code(), Some(0), "{text}");
    assert!(text.contains("verdict  fit") && !text.contains("not fit"), "{text}");
}

#[test]
fn a_controller_that_does_not_answer_ends_the_battery_with_the_reason() {
    for (command, reason) in [
        (format!("{} --gain nan", consensus()), "not a finite number"),
        ("sh -c 'exit 4'".into(), "exit status 4"),
    ] {
        let (report, _folder) = report(&command, None, 3);
        assert_not_fit(&report, "answers", reason);
        let checks = report["checks"].as_array().unwrap();
        assert!(checks[1..].iter().all(|row| row["grade"] == "skipped"), "{report:#}");
    }
}

#[test]
fn a_controller_that_hangs_is_named_and_nothing_of_it_is_left() {
    let Some(program) = broken_in_cpp() else { return };
    let (report, _folder) = report(&format!("{program} sleeps for-conform"), None, 3);
    assert_not_fit(&report, "answers", "uav 6 has not answered for 2.");
    let left = Command::new("pgrep").args(["-f", "sleeps for-conform agent"]).output();
    assert!(left.is_ok_and(|found| found.stdout.is_empty()), "a controller that hangs is killed");
}

/// Each of these answers, and the check that it does not pass is the one for its weakness.
#[test]
fn a_controller_that_is_weak_in_one_thing_does_not_pass_the_check_for_it() {
    let consensus = consensus();
    let dice = format!("sh -c 'exec {consensus} --gain 0.5$(date +%N) \"$@\"' sh");
    let crashes = format!("case \"$*\" in *\"--uav 12 \"*) exit 5;; esac; exec {consensus} \"$@\"");
    for (command, weak_in, reason, good_at) in [
        (dice, "repeats", "tick ", "answers"),
        (format!("{consensus} --gain 0"), "ring", "m from its slot", "answers"),
        (format!("{consensus} --gain 1e9"), "limits", "beyond its limits", "answers"),
        (format!("sh -c '{crashes}' sh"), "crowd", "uav 12", "inside"),
    ] {
        let (report, _folder) = report(&command, Some(&format!("{weak_in},{good_at}")), 3);
        assert_not_fit(&report, weak_in, reason);
        assert_eq!(grade(&report, good_at).0, "fit", "{report:#}");
        assert_eq!(report["checks"].as_array().unwrap().len(), 2, "{report:#}");
    }
}

#[test]
fn what_names_no_controller_is_wrong_usage_and_flies_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let said = |arguments: &[&str]| {
        let output = ringwing().arg("conform").args(arguments).current_dir(folder.path()).output().unwrap();
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        String::from_utf8(output.stderr).unwrap()
    };
    assert!(said(&[]).contains("COMMAND"));
    assert!(said(&["", "--json"]).contains("expected a program"));
    assert!(said(&["./mine", "--only", "loops"]).contains("possible values: answers, limits"));
    assert!(said(&["./mine", "--built-in"]).contains("cannot be used with"));
    assert!(said(&["./mine"]).contains("program \"./mine\" cannot be started"));
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0, "nothing is left behind");
}
