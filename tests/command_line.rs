//! The command as people and scripts use it.

use crate::harness::{Swarm, ringwing};
use ringwing_flight::{Part, UavId};
use serde_json::Value;
use std::{
    fs,
    process::{Command, Output},
};

fn output(arguments: &[&str]) -> (Option<i32>, String, String) {
    let Output { status, stdout, stderr } = ringwing().args(arguments).output().unwrap();
    (status.code(), String::from_utf8(stdout).unwrap(), String::from_utf8(stderr).unwrap())
}

#[test]
fn without_arguments_it_flies_the_papers_section_4_2() {
    let folder = tempfile::tempdir().unwrap();
    let output = ringwing().current_dir(folder.path()).output().unwrap();
    let table = String::from_utf8(output.stdout).unwrap();
    assert_eq!(output.status.code(), Some(0), "{table}");
    for line in
        ["paper-4.2: 6 UAVs", "clearance of Obstacle 1", "settled within", "verdict  passed", "repeat  "]
    {
        assert!(table.contains(line), "no {line:?} in {table}");
    }
    assert_eq!(fs::read_dir(folder.path().join("runs")).unwrap().count(), 1);
}

#[test]
fn a_flight_is_repeated_to_the_bit_by_its_printed_command() {
    let run =
        Swarm::fly("paper-4.1").with("--uavs 5 --seed 42 --duration 7 --set formation_gain=1.5").finish();
    let again =
        Command::new("bash").args(["-c", &format!("{} --json", run.text("command"))]).output().unwrap();
    let again: Value = serde_json::from_slice(&again.stdout).unwrap();
    assert_eq!(again["payload_hash"], run.summary["payload_hash"]);
    // So does the scenario that the run wrote down.
    let file = run.folder.join("scenario.toml");
    let again = Swarm::fly(file.to_str().unwrap()).finish();
    assert_eq!(again.summary["payload_hash"], run.summary["payload_hash"]);
}

#[test]
fn json_goes_to_stdout_and_nothing_else_does() {
    let out = tempfile::tempdir().unwrap();
    let (code, json, said) = output(&["run", "paper-4.1", "--json", "--out", out.path().to_str().unwrap()]);
    assert_eq!((code, said.as_str()), (Some(0), ""));
    let summary: Value = serde_json::from_str(&json).unwrap();
    assert_eq!(summary["verdict"], "passed");
    assert!(summary["real_time_factor"].as_f64().unwrap() > 0.0);
    assert!(summary["obstacles"].as_array().unwrap().is_empty());
}

#[test]
fn all_that_is_wrong_with_a_scenario_is_said_at_once_before_anything_starts() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("bad.toml");
    fs::write(&file, "[formation]\nuavs = 2\nspacing = 40\n[time]\nduration_s = \"long\"\n").unwrap();
    let file = file.to_str().unwrap();
    for arguments in [&["run", file][..], &["scenario", "check", file]] {
        let (code, _, said) = output(arguments);
        assert_eq!(code, Some(2), "{said}");
        for problem in ["line 2: formation.uavs", "line 3: formation.spacing", "line 5: time.duration_s"] {
            assert!(said.contains(problem), "no {problem:?} in {said}");
        }
    }
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
}

#[test]
fn wrong_usage_ends_with_2_and_says_what_would_be_right() {
    for (arguments, hint) in [
        (&["run", "no-such-scenario"][..], "paper-4.2"),
        (&["run", "--uavs", "2"], "--uavs 2"),
        (&["run", "--uavs", "many"], "--uavs"),
        (&["run", "--duration", "-3"], "--duration"),
        (&["run", "--set", "speed"], "key=value"),
        (&["run", "--set", "wind.speed=3"], "no such key"),
        (&["run", "--by-hand", "pilot"], "agent-"),
        (&["run", "--by-hand", "agent-99"], "UAVs 1 to 6"),
        (&["run", "--set", "start.draw.separation_m=1000", "--uavs", "50"], "separation_m"),
        (&["fly"], "Usage"),
        (&["agent", "--uav", "1", "--domain", "x"], "a domain's name"),
    ] {
        let (code, _, said) = output(arguments);
        assert_eq!(code, Some(2), "{arguments:?}: {said}");
        assert!(said.to_lowercase().contains(&hint.to_lowercase()), "no {hint:?} in {said}");
    }
}

#[test]
fn a_process_without_its_run_says_so() {
    for process in [&["world"][..], &["leader"], &["recorder"], &["agent", "--uav", "1"]] {
        let (code, _, said) = output(&[process, &["--domain", "zzzzzz"]].concat());
        assert_eq!(code, Some(1));
        assert!(said.contains("no run with this domain"), "{said}");
    }
}

#[test]
fn a_preset_is_a_template_that_flies() {
    let (code, list, _) = output(&["scenario", "list"]);
    assert_eq!(code, Some(0));
    let folder = tempfile::tempdir().unwrap();
    for name in list.lines().map(|line| line.split(' ').next().unwrap()) {
        let (_, template, _) = output(&["scenario", "show", name]);
        let file = folder.path().join("mine.toml");
        fs::write(&file, template).unwrap();
        let run = Swarm::fly(file.to_str().unwrap()).with("--duration 2").finish();
        assert_eq!(run.text("scenario"), name);
        assert_eq!(run.number("ticks"), 200.0);
    }
}

#[test]
fn processes_started_by_hand_fly_the_same() {
    let expected = Swarm::fly("paper-4.1").with("--duration 20").finish();
    let parts = ["world", "leader", "recorder", "agent-2"];
    let by_hand: String = parts.map(|part| format!("--by-hand {part} ")).concat();
    let mut run = Swarm::fly("paper-4.1").with(&format!("--duration 20 {by_hand}")).start();
    let mut children: Vec<_> = parts
        .map(|_| {
            let line = run.wait_for_line("waiting for: ringwing ");
            let arguments = line.split_once("waiting for: ringwing ").unwrap().1.to_owned();
            ringwing().args(arguments.split(' ')).spawn().unwrap()
        })
        .into();
    let run = run.finish();
    assert_eq!(run.summary["failures"].as_array().unwrap().len(), 0, "{}", run.stderr);
    assert_eq!(run.text("payload_hash"), expected.text("payload_hash"));
    for child in &mut children {
        assert!(child.wait().unwrap().success());
    }
    run.assert_nothing_left();
}

#[test]
fn a_place_that_is_taken_is_refused_and_one_that_is_free_is_not() {
    let mut run = Swarm::fly("paper-4.1").with("--real-time --duration 4").start();
    let domain = run.domain().id().to_string();
    let agent = run.process(Part::Agent(UavId(4)));
    let arguments = ["agent", "--uav", "4", "--domain", &domain];
    let (code, _, said) = output(&arguments);
    assert_eq!(code, Some(1));
    assert!(said.contains(&format!("process {agent} already is the uav 4")), "{said}");
    crate::harness::send(agent, rustix::process::Signal::KILL);
    run.wait_for_line("uav 4 flies without its agent");
    let mut successor = ringwing().args(arguments).spawn().unwrap();
    run.wait_for_line("uav 4 is ready");
    let run = run.finish();
    assert!(successor.wait().unwrap().success());
    let states = run.log().states(4);
    assert_eq!(states.last().unwrap().mode, "commanded", "flown by the agent that was started by hand");
    run.assert_nothing_left();
}
