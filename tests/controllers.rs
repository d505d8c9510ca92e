//! Controllers of the user's: programs that fly UAVs in place of the built-in law.

use crate::{
    harness::{Finished, Swarm, ringwing},
    sweep::{rows, table},
};
use ringwing_flight::{Part, UavId};
use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::{Path, PathBuf},
    process::{Command, Output},
    sync::OnceLock,
};

/// The controller in `examples/controllers/consensus`, built with what the command under test was built with.
pub fn consensus() -> &'static str {
    static BUILT: OnceLock<PathBuf> = OnceLock::new();
    let manifest = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/controllers/consensus/Cargo.toml");
    let path =
        BUILT.get_or_init(|| built(&["--manifest-path", manifest.to_str().unwrap()]).join("consensus"));
    path.to_str().unwrap()
}

/// Builds what `arguments` name; returns the folder of the command under test, where it is then.
pub fn built(arguments: &[&str]) -> &'static Path {
    let bin = Path::new(env!("CARGO_BIN_EXE_ringwing")).parent().unwrap();
    let mut build = Command::new(env!("CARGO"));
    build.args(["build", "--offline", "--locked", "--quiet"]).args(arguments);
    // In the profile and the folder of the command, so that the crates which both need are not built twice.
    build.args(bin.ends_with("release").then_some("--release"));
    build.current_dir(env!("CARGO_MANIFEST_DIR")).env("CARGO_TARGET_DIR", bin.parent().unwrap());
    let output = build.output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    bin
}

/// What programs of `uav` have printed.
pub fn output(run: &Finished, uav: u32) -> String {
    fs::read_to_string(run.folder.join(format!("output/uav-{uav}.txt"))).unwrap_or_default()
}

/// Flies the run again.
pub fn verify(run: &Finished) -> Output {
    ringwing().arg("verify").arg(&run.folder).output().unwrap()
}

#[test]
fn a_controller_in_rust_forms_the_ring_and_its_flight_repeats_to_the_bit() {
    let run = Swarm::fly("paper-4.1").agent(&format!("all={}", consensus())).finish();
    run.assert_ended_with(0);
    assert!(run.number("slot_error_max_m") < 0.01, "{:#}", run.summary);
    // Verifying simulates the flight, with the same program in another role.
    for how in [&[][..], &["--processes"]] {
        let verified = ringwing().arg("verify").arg(&run.folder).args(how).output().unwrap();
        assert!(verified.status.success(), "{how:?}: {}", String::from_utf8_lossy(&verified.stdout));
    }
    let built_in = Swarm::fly("paper-4.1").finish();
    assert_ne!(run.text("payload_hash"), built_in.text("payload_hash"), "it is another law");
    let (log, of_built_in) = (run.log(), built_in.log());
    for uav in 1..=6 {
        let (notes, states) = (log.notes(uav), log.states(uav));
        assert!(notes.iter().map(|notes| notes.tick).eq(states.iter().map(|state| state.tick)));
        let names: BTreeSet<_> = notes.iter().flat_map(|notes| &notes.notes).map(|note| &note.name).collect();
        assert!(names.into_iter().eq(["correction_m_s"]));
        // In its slot, between neighbours in theirs, there is nothing left to correct.
        assert!(notes[0].notes[0].value > 1.0 && notes.last().unwrap().notes[0].value < 0.01);
        assert!(!of_built_in.topics.contains_key(&format!("/uav/{uav:03}/notes")));
    }
}

#[test]
fn controllers_fly_beside_the_built_in_law_and_survive_the_loss_of_a_uav() {
    let run = Swarm::fly("dropout").agent(&format!("1, 2={}", consensus())).finish();
    run.assert_ended_with(0);
    assert!(run.stderr.contains("fault: uav 3 is killed"), "{}", run.stderr);
}

#[test]
fn a_controller_is_killed_and_started_again_like_any_agent() {
    let run = Swarm::fly("paper-4.1")
        .with("--law resilient --duration 60")
        .fault("at 20 s restart uav 3 after 5 s")
        .agent(&format!("3={}", consensus()))
        .start();
    run.wait_for_second(5.0);
    let executable = fs::read_link(format!("/proc/{}/exe", run.process(Part::Agent(UavId(3))))).unwrap();
    assert_eq!(executable, Path::new(consensus()).canonicalize().unwrap());
    let run = run.finish();
    run.assert_ended_with(0);
    for event in ["uav 3 is killed", "uav 3 is started"] {
        assert!(run.stderr.contains(event), "{}", run.stderr);
    }
}

/// Every way of a controller to break, one for each of UAVs 1 to 4; UAV 3 only leaves processes behind.
#[test]
fn each_broken_controller_is_named_and_the_others_fly_on() {
    let consensus = consensus();
    let run = Swarm::fly("paper-4.1")
        .with("--duration 20 --set supervision.start_timeout_s=3 --set failsafe=hold")
        .agent(&format!("1={consensus} --gain nan"))
        .agent("2=sh -c 'echo no idea how to fly >&2; exit 3'")
        // Three megabytes are more than the launcher keeps of what a program prints.
        .agent(&format!("3=sh -c 'yes | head -c 3000000 & sleep 98761 & exec {consensus} \"$@\"' sh"))
        // The last command keeps the shell from becoming the `sleep`, so a child of the program has to end too.
        .agent("4=sh -c 'sleep 98762; true'")
        .finish();
    run.assert_ended_with(3);
    let lines = run.log().lines();
    for event in [
        "controller.not_finite: uav 1 has a controller whose wish is not a finite number",
        "failsafe: uav 1",
        "failsafe: uav 2",
        "failsafe: uav 4",
    ] {
        assert!(lines.iter().any(|line| line.starts_with(event)), "no {event:?} in {lines:#?}");
    }
    for text in [
        "uav 2 gave up (exit status 3) before the flight",
        "uav 4 was not ready in time; killed",
        "uav 3 prints too much",
        "output/uav-2.txt",
    ] {
        assert!(run.stderr.contains(text), "no {text:?} in {}", run.stderr);
    }
    assert_eq!(output(&run, 2), "no idea how to fly\n");
    let of_flooder = output(&run, 3);
    assert!(of_flooder.starts_with("y\ny\n") && of_flooder.len() < 1_100_000, "{}", of_flooder.len());
    assert_eq!(run.log().states(3).last().unwrap().mode, "commanded");
    let left = Command::new("pgrep").args(["-f", "^sleep 9876"]).output();
    assert!(left.is_ok_and(|found| found.stdout.is_empty()), "what a controller started has ended with it");
}

#[test]
fn a_program_in_a_scenario_counts_from_its_file_and_verify_says_whose_controller_differs() {
    let folder = tempfile::tempdir().unwrap();
    let script = format!("#!/bin/sh\nexec {} --gain $(cat gain.txt) \"$@\"\n", consensus());
    fs::write(folder.path().join("mine.sh"), script).unwrap();
    fs::write(folder.path().join("gain.txt"), "0.4").unwrap();
    let scenario = folder.path().join("scenario.toml");
    let agents = "[[agents]]\nuavs = \"5\"\ncommand = [\"sh\", \"mine.sh\"]\n";
    fs::write(&scenario, format!("name = \"mine\"\ntime.duration_s = 5\n{agents}")).unwrap();
    let run = Swarm::fly(scenario.to_str().unwrap()).finish();
    run.assert_ended_with(0);
    assert!(verify(&run).status.success());

    fs::write(folder.path().join("gain.txt"), "0.6").unwrap();
    let verified = verify(&run);
    let text = String::from_utf8(verified.stdout).unwrap();
    assert_eq!(verified.status.code(), Some(3), "{text}");
    assert!(text.contains("the controller of uav 5 differs: sh mine.sh decided otherwise"), "{text}");
    assert!(!text.contains("controller of uav 4"), "{text}");
}

#[test]
fn what_cannot_start_a_program_says_so_before_anything_flies() {
    let folder = tempfile::tempdir().unwrap();
    let flown = |arguments: &[&str]| {
        let output = ringwing().args(arguments).current_dir(folder.path()).output().unwrap();
        (output.status.code(), String::from_utf8(output.stderr).unwrap())
    };
    let agent = ["--agent", "3=./mine"];
    let (code, text) = flown(&[&["run", "paper-4.1"], &agent[..]].concat());
    assert_eq!(code, Some(1), "{text}");
    assert!(text.contains("uav 3: program \"./mine\" cannot be started in"), "{text}");
    for how in [
        &["run", "paper-4.1", "--simulated"][..],
        &["sweep", "paper-4.1", "--seeds", "1"],
        &["sweep", "paper-4.1", "--seeds", "1", "--processes"],
    ] {
        let (code, text) = flown(&[how, &agent[..]].concat());
        assert_eq!(code, Some(2), "{text}");
        assert!(text.contains("uav 3: program \"./mine\" cannot be started in"), "{text}");
    }
    let (code, text) = flown(&["run", "paper-4.1", "--agent", "9=./mine"]);
    assert_eq!(code, Some(2), "{text}");
    assert!(text.contains("there is no UAV 9: this swarm has UAVs 1 to 6"), "{text}");

    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0, "nothing is left behind");
}

#[test]
fn a_sweep_flies_controllers_in_the_simulation_as_processes_do_also_after_restarts() {
    let folder = tempfile::tempdir().unwrap();
    let fault = "at 4 s restart uav 3 after 1 s";
    let swept = |out: &str, how: &[&str]| {
        let mut sweep = ringwing();
        sweep.args(["sweep", "paper-4.1", "--axis", "formation.uavs=4, 5", "--seeds", "2", "--json"]);
        sweep.args(["--set", "time.duration_s=8", "--set", "control.law=resilient", "--fault", fault]);
        sweep
            .args(["--agent", &format!("2, 3={}", consensus()), "--out", out])
            .args(how)
            .current_dir(folder.path());
        let output = sweep.output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let flown = |row: &BTreeMap<String, String>| {
            ["cell", "seed", "payload_hash"].map(|column| row[column].clone())
        };
        table(&rows(folder.path(), out)).iter().map(flown).collect::<BTreeSet<_>>()
    };
    let simulated = swept("simulated", &[]);
    assert_eq!(simulated.len(), 4);
    assert!(simulated.iter().all(|[_, _, hash]| hash.len() == 32), "{simulated:?}");
    assert_eq!(simulated, swept("processes", &["--processes"]));
}

#[test]
fn a_simulated_flight_ends_with_the_reason_when_a_program_breaks() {
    let folder = tempfile::tempdir().unwrap();
    let consensus = consensus();
    let flown = |agent: &str| {
        let output = ringwing()
            .args(["run", "paper-4.1", "--simulated", "--duration", "2000", "--no-record", "--json", "--out"])
            .arg(folder.path())
            .args(["--set", "supervision.start_timeout_s=2", "--set", "supervision.answer_timeout_s=1"])
            .args(["--agent", agent])
            .output()
            .unwrap();
        (output.status.code(), [output.stdout, output.stderr].concat())
    };
    for (agent, reason) in [
        ("2=sh -c 'echo no idea how to fly >&2; exit 3'", "uav 2: its program ended (exit status: 3)"),
        ("4=sh -c 'sleep 98763; true'", "uav 4: its program did not answer within 2."),
        (
            r#"5=sh -c 'printf "\005\000\000\000hello" >&0; sleep 98763'"#,
            "uav 5: its program was built with another version of ringwing: \"hello\" instead of \"ringwing ",
        ),
        // It answers the first situations, and then it is killed.
        (
            &format!("6=sh -c '(sleep 0.5; kill -9 $$) & exec {consensus} \"$@\"' sh"),
            "uav 6: its program ended (signal: 9 (SIGKILL))",
        ),
        (
            &format!("1=sh -c '(sleep 0.5; kill -STOP $$) & exec {consensus} \"$@\"' sh"),
            "uav 1: its program did not answer within 1.",
        ),
    ] {
        let (code, text) = flown(agent);
        let text = String::from_utf8(text).unwrap();
        assert_eq!(code, Some(1), "{agent}: {text}");
        assert!(text.contains(reason), "{agent}: {text}");
    }
    let printed = fs::read_dir(folder.path())
        .unwrap()
        .filter_map(|run| fs::read_to_string(run.unwrap().path().join("output/uav-2.txt")).ok());
    assert!(printed.eq(["no idea how to fly\n"]));
    let left = Command::new("pgrep").args(["-f", "^sleep 98763"]).output();
    assert!(left.is_ok_and(|found| found.stdout.is_empty()), "what a program started has ended with it");
}
