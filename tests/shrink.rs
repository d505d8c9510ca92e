//! `ringwing shrink`: the small scenario is written, flies, and violates what the large one violated.

use crate::harness::{ringwing, send};
use rustix::process::Signal;
use std::{
    fs,
    io::{BufRead, BufReader},
    path::{Path, PathBuf},
    process::{Command, Output, Stdio},
};

/// Violates `faults_act` because nothing thaws a UAV that flies; the other faults have no part in that.
const IDLE: &str = r#"
time.duration_s = 3.0
requirements.faults_act = true
faults = [
    { at_s = 0.5, do = "link all->all loss 20 % for 0.5 s" },
    { at_s = 1.234, do = "thaw uav 2" },
]
"#;

fn output(command: &mut Command) -> Output {
    command.output().unwrap()
}

fn idle(folder: &Path) -> PathBuf {
    let file = folder.join("idle.toml");
    fs::write(&file, IDLE).unwrap();
    file
}

fn run(scenario: &Path, out: &Path) -> Output {
    output(ringwing().arg("run").arg(scenario).arg("--simulated").arg("--out").arg(out))
}

#[test]
fn a_small_scenario_is_written_and_violates_the_same_requirement() {
    let folder = tempfile::tempdir().unwrap();
    let small = folder.path().join("small.toml");
    let shrunk = output(ringwing().arg("shrink").arg(idle(folder.path())).arg("--out").arg(&small));
    assert!(shrunk.status.success(), "{}", String::from_utf8_lossy(&shrunk.stderr));
    let text = fs::read_to_string(&small).unwrap();
    assert!(text.starts_with("# This flight violates faults_act."), "{text}");
    assert!(text.contains("thaw uav 2") && !text.contains("loss"), "{text}");
    assert!(String::from_utf8_lossy(&shrunk.stdout).starts_with(&text));
    assert_eq!(run(&small, folder.path()).status.code(), Some(3));
}

#[test]
fn a_log_is_shrunk_like_its_scenario() {
    let folder = tempfile::tempdir().unwrap();
    let scenario = idle(folder.path());
    assert_eq!(run(&scenario, folder.path()).status.code(), Some(3));
    let small = |input: &Path, name: &str| {
        let out = folder.path().join(name);
        let shrunk = output(ringwing().arg("shrink").arg(input).arg("--out").arg(&out));
        assert!(shrunk.status.success(), "{}", String::from_utf8_lossy(&shrunk.stderr));
        let text = fs::read_to_string(&out).unwrap();
        // The comments name the input.
        text.lines().filter(|line| !line.starts_with('#')).collect::<Vec<_>>().join("\n")
    };
    assert_eq!(small(&folder.path().join("latest"), "of-log.toml"), small(&scenario, "of-scenario.toml"));
}

#[test]
fn a_flight_that_passes_is_refused_and_nothing_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("small.toml");
    let arguments = ["--set", "requirements.faults_act=false", "--out"];
    let refused = output(ringwing().arg("shrink").arg(idle(folder.path())).args(arguments).arg(&out));
    assert_eq!(refused.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&refused.stderr).contains("passes, so there is nothing to shrink"));
    assert!(!out.exists());
}

#[test]
fn an_interrupted_search_writes_the_smallest_scenario_so_far() {
    let folder = tempfile::tempdir().unwrap();
    let small = folder.path().join("small.toml");
    // Many faults of a long flight: the search takes much longer than the signal.
    let mut command = ringwing();
    command.args(["shrink", "storm", "--set", "control.law=paper", "--set", "seed=1", "--out"]).arg(&small);
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let mut line = String::new();
    BufReader::new(child.stderr.take().unwrap()).read_line(&mut line).unwrap();
    assert!(line.contains("flight"), "{line}");
    send(child.id(), Signal::INT);
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    let text = fs::read_to_string(&small).unwrap();
    assert!(text.contains("; the search was interrupted.\n"), "{text}");
    assert!(String::from_utf8_lossy(&output.stdout).starts_with(&text));
}
