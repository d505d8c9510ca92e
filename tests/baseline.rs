//! `--baseline`: what faults cost is the same of processes, simulations and logs, and in the rows of a sweep.

use crate::harness::ringwing;
use serde_json::Value;
use std::{fs, path::Path, process::Output};

/// Three UAVs near the end of a short flight; one is frozen for a second.
const FROZEN: &str = "name = \"frozen\"\ntime.duration_s = 8.0\nformation.uavs = 3\ncontrol.law = \"resilient\"\n\
                      [[faults]]\nat_s = 3.0\ndo = \"freeze uav 2 for 1 s\"\n";

/// What a verb prints about the scenario [`FROZEN`] or something that was made of it; the words of `arguments` follow.
fn printed(folder: &Path, arguments: &str) -> Output {
    let file = folder.join("frozen.toml");
    if !file.exists() {
        fs::write(&file, FROZEN).unwrap();
    }
    ringwing().args(arguments.split_whitespace()).current_dir(folder).output().unwrap()
}

fn deviation(folder: &Path, arguments: &str) -> Value {
    let output = printed(folder, arguments);
    let summary: Value = serde_json::from_slice(&output.stdout)
        .unwrap_or_else(|error| panic!("{error}: {}", String::from_utf8_lossy(&output.stderr)));
    summary["deviation"].clone()
}

#[test]
fn processes_simulations_and_logs_agree_on_what_a_fault_cost() {
    let folder = tempfile::tempdir().unwrap();
    let by_processes = deviation(folder.path(), "run frozen.toml --baseline --json --out flown");
    let simulated = deviation(folder.path(), "run frozen.toml --baseline --json --simulated --out simulated");
    let reviewed = deviation(folder.path(), "review flown/latest --baseline --json");
    assert_eq!((&simulated, &reviewed), (&by_processes, &by_processes));
    assert!(by_processes["peak_m"].as_f64().unwrap() > 1.0, "{by_processes}");
    let saved = fs::read_to_string(folder.path().join("flown/latest/summary.json")).unwrap();
    assert_eq!(serde_json::from_str::<Value>(&saved).unwrap()["deviation"], by_processes);
    // Nobody asked, so there is no value.
    assert_eq!(deviation(folder.path(), "review flown/latest --json"), Value::Null);
}

#[test]
fn the_summary_says_what_a_fault_cost_and_review_draws_it() {
    let folder = tempfile::tempdir().unwrap();
    let output = printed(folder.path(), "run frozen.toml --baseline --simulated");
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    for words in ["largest deviation by the faults", "time back to within 1 m", "--baseline"] {
        assert!(text.contains(words), "{words}: {text}");
    }
    printed(folder.path(), "review runs/latest --baseline --out drawn");
    let table = fs::read_to_string(folder.path().join("drawn/deviations.csv")).unwrap();
    let two = |line: &str| line.split(',').nth(2).unwrap().parse::<f64>().ok();
    let rows: Vec<_> = table.lines().skip(1).map(two).collect();
    assert_eq!(rows[299], Some(0.0), "nothing deviates before the fault");
    assert!(rows.iter().flatten().any(|off_m| *off_m > 1.0));
    assert!(folder.path().join("drawn/deviations.svg").exists());
    printed(folder.path(), "review runs/latest --out plain");
    assert!(!folder.path().join("plain/deviations.csv").exists());
}

#[test]
fn a_sweep_has_the_cost_in_its_columns_if_asked() {
    let folder = tempfile::tempdir().unwrap();
    let peak_m = |out: &str, flag: &str| {
        printed(
            folder.path(),
            &format!("sweep frozen.toml --axis control.formation_gain=2 --seeds 1 --out {out} {flag}"),
        );
        let text = fs::read_to_string(folder.path().join(out).join("flights.csv")).unwrap();
        let mut lines = text.lines();
        let place = lines.next().unwrap().split(',').position(|name| name == "deviation_peak_m").unwrap();
        lines.next().unwrap().split(',').nth(place).unwrap().to_owned()
    };
    let simulated = peak_m("simulated", "--baseline");
    assert!(simulated.parse::<f64>().unwrap() > 1.0, "{simulated}");
    assert_eq!(peak_m("flown", "--baseline --processes"), simulated);
    assert_eq!(peak_m("plain", ""), "");
    let other = printed(
        folder.path(),
        "sweep frozen.toml --axis control.formation_gain=2 --seeds 1 --out plain --baseline",
    );
    assert!(String::from_utf8_lossy(&other.stderr).contains("one of them with --baseline"));
}

#[test]
fn a_flight_that_cannot_be_simulated_has_no_baseline() {
    let folder = tempfile::tempdir().unwrap();
    for (flag, reason) in [
        ("--set time.real_time=true", "real time"),
        ("--agent 2=./none", "uav 2: program \"./none\" cannot be started"),
    ] {
        let output = printed(folder.path(), &format!("run frozen.toml --baseline {flag}"));
        assert_eq!(output.status.code(), Some(2));
        let message = String::from_utf8_lossy(&output.stderr);
        assert!(message.contains("error: --baseline simulates the flight without its faults"), "{message}");
        assert!(message.contains(reason), "{message}");
    }
    assert!(!folder.path().join("runs").exists());
}
