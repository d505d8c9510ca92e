//! `run --simulated` is the same command as a run with processes: the same log to the byte, summary and exit code.

use crate::harness::{ringwing, wait_until};
use serde_json::Value;
use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Output, Stdio},
};

/// Figures of the summary that tell of the wall clock or of the run's own folder, and not of the flight.
const OF_THE_RUN: [&str; 6] = ["start_s", "wall_s", "real_time_factor", "latency", "log", "late_max_us"];

/// The same flight, by processes and simulated.
struct Flown {
    output: Output,
    summary: Value,
    log: Vec<u8>,
}

fn run(out: &Path, arguments: &str, faults: &[&str], is_simulated: bool) -> Flown {
    let mut command = ringwing();
    // The simulation records no wall-clock times, so the processes must not either, or the logs would differ.
    command.arg("run").args(arguments.split_whitespace()).args(["--no-timing", "--json", "--out"]).arg(out);
    command.args(faults.iter().flat_map(|fault| ["--fault", fault]));
    command.args(is_simulated.then_some("--simulated"));
    let output = command.output().unwrap();
    let summary: Value = serde_json::from_slice(&output.stdout)
        .unwrap_or_else(|error| panic!("{error}: {}", String::from_utf8_lossy(&output.stderr)));
    let log = fs::read(summary["log"].as_str().expect("a log")).unwrap();
    Flown { output, summary, log }
}

/// Flies both ways and asserts that log, summary and exit code are the same.
fn assert_same(arguments: &str, faults: &[&str]) {
    let out = tempfile::tempdir().unwrap();
    let (real, simulated) =
        (run(out.path(), arguments, faults, false), run(out.path(), arguments, faults, true));
    assert_eq!(real.output.status.code(), simulated.output.status.code(), "{arguments}");
    let (figures, expected) = (of_flight(&simulated.summary), of_flight(&real.summary));
    for (key, value) in &expected {
        assert_eq!(figures.get(key), Some(value), "{arguments}: {key}");
    }
    assert_eq!(figures.len(), expected.len());
    assert!(real.log == simulated.log, "{arguments}: the logs differ");
}

fn of_flight(summary: &Value) -> serde_json::Map<String, Value> {
    let mut figures = summary.as_object().unwrap().clone();
    figures.retain(|key, _| !OF_THE_RUN.contains(&key.as_str()));
    // The commands differ by their flags `--simulated` and `--out` only.
    figures.remove("command");
    figures
}

#[test]
fn the_log_is_that_of_the_processes_to_the_byte() {
    assert_same("paper-4.2 --duration 40", &[]);
    assert_same(
        "paper-4.1 --duration 30 --uavs 7 --seed 5 --law resilient",
        &[
            "at 4 s link all loss 20 % for 10 s",
            "at 5 s link leader->all delay 200 ms jitter 50 ms",
            "at 6 s kill uav 3",
            "at 8 s freeze uav 5 for 3 s",
            "at 14 s start uav 3",
        ],
    );
}

#[test]
fn a_violated_requirement_ends_both_with_the_same_code() {
    let out = tempfile::tempdir().unwrap();
    let arguments = "paper-4.1 --duration 3 --set requirements.slot_error_max_m=0.01";
    let simulated = run(out.path(), arguments, &[], true);
    assert_eq!(simulated.output.status.code(), Some(3));
    assert_same(arguments, &[]);
}

#[test]
fn a_simulated_run_opens_no_shared_memory() {
    let out = tempfile::tempdir().unwrap();
    let mut child = endless(out.path()).spawn().unwrap();
    let log = wait_until("a log is written", || log_in(out.path()));
    assert!(log.exists());
    let maps = fs::read_to_string(format!("/proc/{}/maps", child.id())).unwrap();
    let mapped: Vec<_> = maps.lines().filter(|line| line.contains("/dev/shm")).collect();
    let open = fs::read_dir(format!("/proc/{}/fd", child.id())).unwrap();
    let opened: Vec<_> = open
        .filter_map(|entry| fs::read_link(entry.ok()?.path()).ok())
        .filter(|path| path.starts_with("/dev/shm"))
        .collect();
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(mapped.is_empty() && opened.is_empty(), "{mapped:?} {opened:?}");
}

#[test]
fn an_interrupted_simulation_closes_its_log_and_fails() {
    let out = tempfile::tempdir().unwrap();
    let child = endless(out.path()).spawn().unwrap();
    wait_until("a log is written", || log_in(out.path()));
    crate::harness::send(child.id(), rustix::process::Signal::TERM);
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(1), "{}", String::from_utf8_lossy(&output.stderr));
    let summary: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(
        (&summary["verdict"], &summary["failures"][0]),
        (&"failed".into(), &"interrupted before the end".into())
    );
    let log = crate::harness::log::Log::read(Path::new(summary["log"].as_str().unwrap()));
    assert_eq!(log.states(1).len() as f64, summary["ticks"].as_f64().unwrap() + 1.0);
}

/// A simulated run that takes hours.
fn endless(out: &Path) -> Command {
    let mut command = ringwing();
    command.args(["run", "paper-4.2", "--simulated", "--json", "--duration", "86400", "--out"]).arg(out);
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

/// The log of the run below `out`, once its first flush is in the file.
fn log_in(out: &Path) -> Option<PathBuf> {
    let folder = fs::read_dir(out).ok()?.next()?.ok()?.path();
    let files = fs::read_dir(folder).ok()?.filter_map(|entry| Some(entry.ok()?.path()));
    let mut logs = files.filter(|path| path.extension().is_some_and(|extension| extension == "mcap"));
    logs.find(|path| fs::metadata(path).is_ok_and(|metadata| metadata.len() > 100_000))
}
