//! `ringwing hunt`: the finding flies and is as bad as printed, and a killed hunt goes on to the same end.

use crate::harness::{finished, newest_run, ringwing, send, wait_until};
use rustix::process::Signal;
use serde_json::Value;
use std::{
    fs,
    path::Path,
    process::{Command, Stdio},
};

/// Short flights of three UAVs: most of the time goes into what is tested here.
const SHORT: &str = "name = \"short\"\ntime.duration_s = 6.0\nformation.uavs = 3\n";
const BUDGET: &str = "1 kill, 1 freeze of at most 1 s, 1 link fault of at most 1 s, loss at most 30 %";

/// A hunt of [`SHORT`] with results in `out`; the words of `arguments` follow.
fn hunt(folder: &Path, out: &str, arguments: &str) -> Command {
    let file = folder.join("short.toml");
    if !file.exists() {
        fs::write(&file, SHORT).unwrap();
    }
    let mut command = ringwing();
    command.arg("hunt").arg(file).args(["--budget", BUDGET]).args(arguments.split_whitespace());
    command.arg("--out").arg(folder.join(out));
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

/// The rows in the order of their flights.
fn rows(folder: &Path, out: &str) -> Vec<String> {
    let text = fs::read_to_string(folder.join(out).join("flights.csv")).unwrap();
    let mut rows: Vec<_> = text.lines().skip(1).map(ToOwned::to_owned).collect();
    rows.sort_by_key(|row| row.split(',').next().unwrap().parse::<u64>().unwrap());
    rows
}

/// The rows of the file, as it is while the hunt flies.
fn lines(folder: &Path, out: &str) -> usize {
    let text = fs::read(folder.join(out).join("flights.csv")).unwrap_or_default();
    String::from_utf8_lossy(&text).matches('\n').count()
}

#[test]
fn the_finding_flies_and_is_as_bad_as_printed() {
    let folder = tempfile::tempdir().unwrap();
    let output = finished(hunt(folder.path(), "one", "--flights 60 --json"), 0);
    let result: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((&result["flights"], &result["end"]), (&60.into(), &"flights".into()), "{result}");
    let number = |key: &str| result[key].as_f64().unwrap();
    assert!(number("shrunk") <= number("worst") && number("worst") < number("without"), "{result}");
    let scenario = folder.path().join("one/worst.toml");
    let flown = ringwing()
        .arg("run")
        .arg(&scenario)
        .args(["--simulated", "--no-record", "--json", "--out"])
        .arg(folder.path())
        .output()
        .unwrap();
    let summary: Value = serde_json::from_slice(&flown.stdout).unwrap();
    assert_eq!(summary["closest_pair_m"], result["shrunk"], "{summary}");
    assert!(newest_run(folder.path()).is_some());
    let text = fs::read_to_string(scenario).unwrap();
    assert!(text.contains(&format!("# Budget: {BUDGET}\n# Seed of the search: 1\n")), "{text}");
}

#[test]
fn a_hunt_that_is_killed_goes_on_to_the_same_end_on_any_number_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = "--flights 200 --goal slot_error_max_m";
    finished(hunt(folder.path(), "whole", &format!("{arguments} --jobs 1")), 0);
    for kill in 1..=3 {
        let mut child = hunt(folder.path(), "killed", &format!("{arguments} --jobs 3")).spawn().unwrap();
        wait_until("some more flights have landed", || {
            (lines(folder.path(), "killed") > 25 * kill).then_some(())
        });
        send(child.id(), Signal::KILL);
        assert!(!child.wait().unwrap().success());
        // The header is a line as well, so a hunt that is over has 201 lines.
        assert!(lines(folder.path(), "killed") <= 200, "the hunt was over before kill {kill}");
    }
    let output = finished(hunt(folder.path(), "killed", &format!("{arguments} --jobs 2")), 0);
    assert!(String::from_utf8_lossy(&output.stderr).contains("flown before"));
    assert_eq!(rows(folder.path(), "killed"), rows(folder.path(), "whole"));
    let worst = |out: &str| fs::read_to_string(folder.path().join(out).join("worst.toml")).unwrap();
    assert_eq!(worst("killed"), worst("whole"));
}

#[test]
fn an_interrupted_hunt_writes_the_worst_so_far_and_another_hunt_needs_another_folder() {
    let folder = tempfile::tempdir().unwrap();
    let long = "--flights 1000000 --patience 1000000";
    let child = hunt(folder.path(), "one", long).spawn().unwrap();
    wait_until("some flights have landed", || (lines(folder.path(), "one") > 40).then_some(()));
    send(child.id(), Signal::INT);
    let output = child.wait_with_output().unwrap();
    let message = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{message}");
    assert!(message.contains("interrupted after"), "{message}");
    assert!(folder.path().join("one/worst.toml").exists());
    let output = finished(hunt(folder.path(), "one", "--search-seed 2 --flights 40"), 2);
    assert!(String::from_utf8_lossy(&output.stderr).contains("holds another hunt"));
    finished(hunt(folder.path(), "one", "--search-seed 2 --flights 40 --fresh"), 0);
    assert_eq!(rows(folder.path(), "one").len(), 40);
}

#[test]
fn a_wrong_hunt_is_refused_before_anything_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    for (budget, goal, expected) in [
        ("", "closest_pair_m", "error: --budget \"\": the budget has no fault: give a number of faults"),
        ("2 kils", "closest_pair_m", "error: --budget \"2 kils\": word 2, \"kils\": did you mean kills?"),
        ("1 kill, from 1 s to 99 s", "closest_pair_m", "the flight ends at 90 s"),
        ("1 kill", "closest_par_m", "error: --goal closest_par_m: there is no such figure; the figures are"),
    ] {
        let output = ringwing()
            .args(["hunt", "dropout", "--budget", budget, "--goal", goal, "--out"])
            .arg(&out)
            .output()
            .unwrap();
        let message = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{budget}: {message}");
        assert!(message.contains(expected), "{budget}: {message}");
        assert!(!out.exists(), "{budget}");
    }
}
