//! The command line as people and scripts use it.

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
    // One folder, and the link `latest` to it.
    assert_eq!(fs::read_dir(folder.path().join("runs")).unwrap().count(), 2);
}

#[test]
fn the_printed_command_repeats_a_flight_to_the_bit() {
    let run =
        Swarm::fly("paper-4.1").with("--uavs 5 --seed 42 --duration 7 --set formation_gain=1.5").finish();
    let again =
        Command::new("bash").args(["-c", &format!("{} --json", run.text("command"))]).output().unwrap();
    let again: Value = serde_json::from_slice(&again.stdout).unwrap();
    assert_eq!(again["payload_hash"], run.summary["payload_hash"]);
    // The scenario file in the run's folder repeats the flight, too.
    let file = run.folder.join("scenario.toml");
    let again = Swarm::fly(file.to_str().unwrap()).finish();
    assert_eq!(again.summary["payload_hash"], run.summary["payload_hash"]);
}

#[test]
fn json_is_the_only_output() {
    let out = tempfile::tempdir().unwrap();
    let (code, json, stderr) = output(&["run", "paper-4.1", "--json", "--out", out.path().to_str().unwrap()]);
    assert_eq!((code, stderr.as_str()), (Some(0), ""));
    let summary: Value = serde_json::from_str(&json).unwrap();
    assert_eq!(summary["verdict"], "passed");
    assert!(summary["real_time_factor"].as_f64().unwrap() > 0.0);
    assert!(summary["obstacles"].as_array().unwrap().is_empty());
}

#[test]
fn all_errors_of_a_scenario_are_reported_at_once_before_anything_starts() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("bad.toml");
    fs::write(&file, "[formation]\nuavs = 2\nspacing = 40\n[time]\nduration_s = \"long\"\n").unwrap();
    let file = file.to_str().unwrap();
    for arguments in [&["run", file][..], &["scenario", "check", file]] {
        let (code, _, stderr) = output(arguments);
        assert_eq!(code, Some(2), "{stderr}");
        for problem in ["2: formation.uavs", "3: formation.spacing", "5: time.duration_s"] {
            let line = format!("error: {file}:{problem}");
            assert!(stderr.contains(&line), "no {line:?} in {stderr}");
        }
        assert!(stderr.ends_with("\n3 errors\n"), "{stderr}");
    }
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
}

#[test]
fn wrong_usage_exits_with_2_and_hints_at_the_fix() {
    for (arguments, hint) in [
        (&["run", "no-such-scenario"][..], "paper-4.2"),
        (&["run", "--uavs", "2"], "--uavs 2"),
        (&["run", "--uavs", "many"], "--uavs"),
        (&["run", "--duration", "-3"], "--duration"),
        (&["run", "--set", "speed"], "key=value"),
        (&["run", "--set", "wind.speed=3"], "no such key"),
        (&["run", "paper-42"], "did you mean paper-4.2?"),
        (&["run", "--set", "formation.uav=7"], "did you mean uavs?"),
        (&["run", "--set", "requirements.collision_max=0"], "did you mean collisions_max?"),
        (&["run", "--fault", "at 1 s kil uav 3"], "did you mean kill?"),
        (&["run", "--law", "resilent"], "'resilient'"),
        (&["run", "--by-hand", "pilot"], "agent-"),
        (&["run", "--by-hand", "agent-99"], "UAVs 1 to 6"),
        (&["run", "--set", "start.draw.separation_m=1000", "--uavs", "50"], "separation_m"),
        (&["fly"], "Usage"),
        (&["agent", "--uav", "1", "--domain", "x"], "a domain's name"),
    ] {
        let (code, _, stderr) = output(arguments);
        assert_eq!(code, Some(2), "{arguments:?}: {stderr}");
        assert!(stderr.to_lowercase().contains(&hint.to_lowercase()), "no {hint:?} in {stderr}");
        assert!(stderr.starts_with("error: "), "{stderr}");
    }
}

#[test]
fn a_process_started_without_a_run_reports_that_the_run_is_missing() {
    for process in [&["world"][..], &["leader"], &["recorder"], &["agent", "--uav", "1"]] {
        let (code, _, stderr) = output(&[process, &["--domain", "zzzzzz"]].concat());
        assert_eq!(code, Some(1));
        assert!(stderr.contains("no run of this name is live"), "{stderr}");
    }
}

#[test]
fn every_preset_flies_when_used_as_a_template() {
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
fn processes_started_by_hand_do_not_change_the_flight() {
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
fn a_second_agent_for_a_uav_is_refused_until_the_first_is_lost() {
    let mut run = Swarm::fly("paper-4.1").with("--real-time --duration 4").start();
    let domain = run.domain().id().to_string();
    let agent = run.process(Part::Agent(UavId(4)));
    let arguments = ["agent", "--uav", "4", "--domain", &domain];
    let (code, _, stderr) = output(&arguments);
    assert_eq!(code, Some(1));
    assert!(stderr.contains(&format!("process {agent} already is the uav 4")), "{stderr}");
    crate::harness::send(agent, rustix::process::Signal::KILL);
    run.wait_for_line("uav 4 flies without its agent");
    let mut successor = ringwing().args(arguments).spawn().unwrap();
    run.wait_for_line("uav 4 is ready");
    let run = run.finish();
    assert!(successor.wait().unwrap().success());
    let states = run.log().states(4);
    assert_eq!(states.last().unwrap().mode, "commanded", "the agent that was started by hand flies uav 4");
    run.assert_nothing_left();
}
