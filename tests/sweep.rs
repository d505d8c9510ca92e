//! `ringwing sweep`: what was flown survives a kill, shards make the whole, and real processes fly the same rows.

use crate::harness::{finished, ringwing, send, wait_until};
use ringwing_flight::draw::Draws;
use rustix::process::Signal;
use serde_json::Value;
use std::{
    collections::BTreeMap,
    env, fs,
    path::Path,
    process::{Command, Stdio},
};

/// Flights of the sweep that is killed; `RINGWING_SWEEP_FLIGHTS=5000` flies more.
const FLIGHTS: u64 = 300;
/// How many times it is killed.
const KILLS: u32 = 6;
/// Rows that real processes fly again; `RINGWING_SWEEP_ROWS=200` flies more.
const ROWS: u64 = 4;

/// Short flights of three UAVs: most of the time goes into what is tested here.
const SWEEP: &str = r#"
name = "short"
scenario = "paper-4.1"
faults = ["at 0 s link all->all loss {loss} %", "at 0.1 s link leader->all delay {delay} s"]
[set]
formation.uavs = 3
time.duration_s = 0.3
requirements.settling_max_s = 5
requirements.slot_error_max_m = 70
[axes]
loss = "10, 20 .. 50"
delay = [0, 0.1]
"#;

/// The number that an environment variable has, or `usual`.
fn size(variable: &str, usual: u64) -> u64 {
    env::var(variable).map_or(usual, |text| text.parse().expect("a number"))
}

/// A sweep of [`SWEEP`] with results in `out`.
fn sweep(folder: &Path, out: &str, arguments: &str) -> Command {
    let file = folder.join("short.toml");
    if !file.exists() {
        fs::write(&file, SWEEP).unwrap();
    }
    let mut command = ringwing();
    command.arg("sweep").arg(file).args(arguments.split_whitespace()).arg("--out").arg(folder.join(out));
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

pub fn rows(folder: &Path, out: &str) -> String {
    fs::read_to_string(folder.join(out).join("flights.csv")).unwrap()
}

/// The rows of the file, as it is while the sweep flies.
fn lines(folder: &Path, out: &str) -> u64 {
    let text = fs::read(folder.join(out).join("flights.csv")).unwrap_or_default();
    String::from_utf8_lossy(&text).matches('\n').count() as u64
}

#[test]
fn a_sweep_that_is_killed_many_times_has_the_rows_of_an_undisturbed_one() {
    let folder = tempfile::tempdir().unwrap();
    let flights = size("RINGWING_SWEEP_FLIGHTS", FLIGHTS);
    let arguments = format!("--seeds {}", flights / 10);
    finished(sweep(folder.path(), "whole", &arguments), 0);
    let mut draws = Draws::new(1, [5, 5, 5], 0);
    for kill in 0..KILLS {
        let mut child = sweep(folder.path(), "killed", &arguments).spawn().unwrap();
        // A share of what is left, so that every kill comes before the end.
        let before = lines(folder.path(), "killed");
        let more = ((flights - before) as f64 * 0.5 * draws.uniform() / f64::from(KILLS - kill)) as u64 + 2;
        wait_until("some more flights have landed", || {
            (lines(folder.path(), "killed") >= before + more).then_some(())
        });
        send(child.id(), Signal::KILL);
        assert!(!child.wait().unwrap().success());
        let landed = lines(folder.path(), "killed");
        assert!(landed < flights, "the sweep was over before the kill {kill}");
    }
    finished(sweep(folder.path(), "killed", &arguments), 0);
    let whole = rows(folder.path(), "whole");
    assert_eq!(whole.lines().count() as u64, flights + 1);
    assert!(rows(folder.path(), "killed") == whole, "the rows differ");
}

#[test]
fn an_interrupted_sweep_keeps_its_flights_and_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let child = sweep(folder.path(), "one", "--seeds 40").spawn().unwrap();
    wait_until("some flights have landed", || (lines(folder.path(), "one") > 10).then_some(()));
    send(child.id(), Signal::TERM);
    let output = child.wait_with_output().unwrap();
    let message = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{message}");
    assert!(message.contains("interrupted after") && message.contains("goes on from here"), "{message}");
    let landed = lines(folder.path(), "one");
    let output = finished(sweep(folder.path(), "one", "--seeds 40"), 0);
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(message.contains(&format!("{} flown before", landed - 1)), "{message}");
    // With more seeds the sweep goes on as well, and with fewer it does not.
    finished(sweep(folder.path(), "one", "--seeds 41"), 0);
    assert_eq!(lines(folder.path(), "one"), 411);
    let output = finished(sweep(folder.path(), "one", "--seeds 3"), 2);
    assert!(String::from_utf8_lossy(&output.stderr).contains("another sweep, or of more seeds"));
    finished(sweep(folder.path(), "one", "--seeds 3 --fresh"), 0);
    assert_eq!(lines(folder.path(), "one"), 31);
}

#[test]
fn merged_shards_have_the_rows_of_the_whole_sweep() {
    let folder = tempfile::tempdir().unwrap();
    finished(sweep(folder.path(), "whole", "--seeds 4"), 0);
    finished(sweep(folder.path(), "parts", "--seeds 4 --shard 1/3"), 0);
    // The second shard is found as a job of Slurm finds it, and has a folder of its own.
    let mut second = sweep(folder.path(), "part-2", "--seeds 4");
    second.envs([
        ("SLURM_ARRAY_TASK_ID", "1"),
        ("SLURM_ARRAY_TASK_COUNT", "3"),
        ("SLURM_ARRAY_TASK_MIN", "0"),
    ]);
    finished(second, 0);
    let merge = |code| {
        let mut command = ringwing();
        command.args(["sweep", "merge"]).args(["parts", "part-2"].map(|out| folder.path().join(out)));
        finished(command, code)
    };
    let output = merge(1);
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(message.contains("13 flights of 10 cells are missing"), "{message}");
    finished(sweep(folder.path(), "parts", "--seeds 4 --shard 3/3"), 0);
    merge(0);
    assert!(rows(folder.path(), "parts") == rows(folder.path(), "whole"), "the rows differ");
}

/// The rows as maps from column to text.
pub fn table(text: &str) -> Vec<BTreeMap<String, String>> {
    let mut lines = text.lines().map(|line| line.split(',').map(ToOwned::to_owned));
    let names: Vec<String> = lines.next().unwrap().collect();
    lines.map(|line| names.iter().cloned().zip(line).collect()).collect()
}

#[test]
fn real_processes_fly_rows_that_are_drawn_at_random_to_the_same_hashes() {
    let folder = tempfile::tempdir().unwrap();
    finished(sweep(folder.path(), "one", "--seeds 20 --set time.duration_s=2"), 0);
    let rows = table(&rows(folder.path(), "one"));
    assert_eq!(rows.len(), 200);
    let mut hashes = std::collections::BTreeSet::new();
    for draw in 0..size("RINGWING_SWEEP_ROWS", ROWS) {
        let row = &rows[(Draws::new(7, [1, 1, 1], draw).uniform() * rows.len() as f64) as usize];
        let output = ringwing()
            .args(["run", "paper-4.1", "--no-record", "--json", "--seed", &row["seed"], "--out"])
            .arg(folder.path())
            .args(["--set", "formation.uavs=3", "--set", "time.duration_s=2"])
            .args(["--fault", &format!("at 0 s link all->all loss {} %", row["loss"])])
            .args(["--fault", &format!("at 0.1 s link leader->all delay {} s", row["delay"])])
            .output()
            .unwrap();
        let summary: Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!(summary["payload_hash"], row["payload_hash"].as_str(), "seed {}", row["seed"]);
        hashes.insert(row["payload_hash"].clone());
    }
    assert!(hashes.len() > 1, "the flights are all the same");
}

#[test]
fn a_sweep_by_processes_has_the_rows_of_the_simulation() {
    let folder = tempfile::tempdir().unwrap();
    // Many short flights: the last counts of links must not get lost with their senders.
    let arguments = "--axis loss=20 --seeds 10";
    finished(sweep(folder.path(), "simulated", arguments), 0);
    finished(sweep(folder.path(), "flown", &format!("{arguments} --processes --jobs 2")), 0);
    assert_eq!(rows(folder.path(), "flown"), rows(folder.path(), "simulated"));
}

#[test]
fn a_cell_gets_flights_until_its_interval_is_narrow() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = "--axis loss=10 --axis delay=0 --seeds 10 --precision 0.3 --json";
    let output = finished(sweep(folder.path(), "one", arguments), 0);
    let result: Value = serde_json::from_slice(&output.stdout).unwrap();
    let cell = &result["cells"][0];
    let width = cell["success_high"].as_f64().unwrap() - cell["success_low"].as_f64().unwrap();
    assert!(width <= 0.3, "{cell}");
    assert_eq!(cell["flights"], 10, "{cell}");
}

#[test]
fn wrong_sweeps_are_refused_before_the_first_flight_with_file_and_line() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("wrong.toml");
    let cases = [
        (
            "delay = [0, 0.1]",
            "control.lwa = [0, 0.1]",
            "wrong.toml:12: control.lwa = 0: control.lwa: no such key",
        ),
        (
            "delay = [0, 0.1]",
            "formation.uavs = [3, 2]",
            "wrong.toml:12: formation.uavs = 2: formation.uavs: 2 is outside",
        ),
        ("10, 20 .. 50", "50 .. 10", "wrong.toml:11: axis loss: empty range"),
        ("10, 20 .. 50", "90, 95 .. 120", "wrong.toml:4: fault"),
        ("\"short\"", "7", "wrong.toml:2: name: give a text"),
        ("[axes]", "[axis]", "wrong.toml:10: axis: no such key"),
    ];
    for (from, to, expected) in cases {
        // Where the axis itself is replaced, the fault has no braces to fill.
        let text = if from.starts_with("delay") { SWEEP.replace("{delay}", "0.1") } else { SWEEP.into() };
        fs::write(&file, text.replace(from, to)).unwrap();
        let output =
            ringwing().arg("sweep").arg(&file).arg("--out").arg(folder.path().join("out")).output().unwrap();
        let message = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{to}: {message}");
        assert!(message.contains(expected), "{to}: {message}");
        assert!(!folder.path().join("out").exists(), "{to}: results were begun");
    }
}

#[test]
fn a_sweep_of_a_billion_cells_asks_for_confirmation() {
    let folder = tempfile::tempdir().unwrap();
    let output =
        finished(sweep(folder.path(), "out", "--axis leader.speed_m_s=1..100000 --axis loss=1..100000"), 2);
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(message.contains("20000000000 cells") && message.contains("--yes"), "{message}");
    assert!(!folder.path().join("out").exists());
}

#[test]
fn a_sweep_that_begins_anew_leaves_the_results_of_one_that_still_flies() {
    let folder = tempfile::tempdir().unwrap();
    finished(sweep(folder.path(), "one", "--axis loss=10 --seeds 1"), 0);
    let flights = fs::File::open(folder.path().join("one/flights.csv")).unwrap();
    // This process stands in for the other sweep.
    flights.try_lock().unwrap();
    let output = finished(sweep(folder.path(), "one", "--axis loss=10 --seeds 1 --fresh"), 1);
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(message.contains("another process writes these flights"), "{message}");
    assert!(
        ["sweep.json", "cells.csv", "flights.csv"].iter().all(|name| folder
            .path()
            .join("one")
            .join(name)
            .exists())
    );
}

#[test]
fn two_laws_and_two_sweeps_are_compared() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = "--axis control.law=paper,resilient --axis loss=10 --seeds 3";
    finished(sweep(folder.path(), "one", arguments), 0);
    finished(
        sweep(folder.path(), "other", &format!("{arguments} --set requirements.slot_error_max_m=0.001")),
        0,
    );
    let one = folder.path().join("one");
    let output = ringwing().args(["sweep", "compare", "--by", "control.law"]).arg(&one).output().unwrap();
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(text.starts_with("0 of 2 cells differ by more than chance between control.law paper"), "{text}");
    // The axis goes first, so the last cell has its first value again.
    let arguments =
        "--axis control.law=paper,resilient --axis loss=10,20 --combination one-at-a-time --seeds 2";
    finished(sweep(folder.path(), "in-turn", arguments), 0);
    let by = ["sweep", "compare", "--by", "control.law", "in-turn"];
    let output = ringwing().args(by).current_dir(folder.path()).output().unwrap();
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(text.contains("between control.law paper and control.law resilient"), "{text}");
    let output = ringwing()
        .args(["sweep", "compare", "--json"])
        .arg(&one)
        .arg(folder.path().join("other"))
        .output()
        .unwrap();
    let result: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(result["cells"].as_array().unwrap().len(), 4);
    assert_eq!(result["cells"][0]["other_passed"], 0);
}
