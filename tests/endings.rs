//! Runs that end early. Each reports why, closes its log if a process is left to do so, and leaves nothing behind.

use crate::harness::{
    Swarm, leftovers, log_in, newest_run, processes_of, ringwing, send, wait_until, wait_until_gone,
};
use ringwing_flight::Part;
use rustix::process::Signal;
use std::{process::Command, time::Duration};

const MODES: [&str; 2] = ["--duration 36000", "--real-time --duration 3600"];

#[test]
fn an_interrupted_run_closes_its_log_and_reports_how_far_it_flew() {
    for (mode, signal) in MODES.into_iter().zip([Signal::INT, Signal::TERM]) {
        let run = Swarm::fly("paper-4.2").with(mode).start();
        run.wait_for_second(1.5);
        send(run.launcher(), signal);
        let run = run.finish();
        run.assert_ended_with(1);
        assert_eq!(run.text("verdict"), "failed");
        assert_eq!(run.summary["failures"][0], "interrupted before the end");
        let states = run.log().states(1);
        assert!(
            states.len() > 100 && states.len() as f64 == run.number("ticks") + 1.0,
            "{} states",
            states.len()
        );
    }
}

#[test]
fn an_interrupt_before_the_flight_begins_ends_the_run() {
    let run = Swarm::fly("paper-4.2").with("--uavs 40 --duration 36000").start();
    send(run.launcher(), Signal::INT);
    let run = run.finish();
    run.assert_ended_with(1);
}

#[test]
fn an_interrupt_at_any_moment_during_startup_leaves_nothing_behind() {
    for milliseconds in [0, 2, 5, 10, 20, 40, 80, 160] {
        let out = tempfile::tempdir().unwrap();
        let mut child = ringwing()
            .args(["run", "--uavs", "60", "--duration", "36000", "--out"])
            .arg(out.path())
            .stderr(std::process::Stdio::null())
            .stdout(std::process::Stdio::null())
            .spawn()
            .unwrap();
        std::thread::sleep(Duration::from_millis(milliseconds));
        send(child.id(), Signal::TERM);
        let launcher = child.id();
        wait_until("the run ends", || child.try_wait().unwrap());
        let folders = std::fs::read_dir(out.path()).unwrap().map(|folder| folder.unwrap().file_name());
        for folder in folders.filter(|name| name != "latest").map(|name| name.into_string().unwrap()) {
            let domain = folder.rsplit('-').next().unwrap().parse().unwrap();
            assert!(
                leftovers(&domain).is_empty(),
                "launcher {launcher}, after {milliseconds} ms: {:?}",
                leftovers(&domain)
            );
        }
    }
}

#[test]
fn two_interrupts_during_startup_end_the_run() {
    for milliseconds in [20, 60, 100, 140, 180] {
        let run = Swarm::fly("paper-4.2").with("--uavs 60 --duration 36000").start();
        std::thread::sleep(Duration::from_millis(milliseconds));
        send(run.launcher(), Signal::INT);
        // The launcher may have ended already.
        let _ = std::panic::catch_unwind(|| send(run.launcher(), Signal::INT));
        run.finish().assert_ended_with(1);
    }
}

#[test]
fn a_world_that_is_stopped_early_fails_the_run() {
    let run = Swarm::fly("paper-4.2").with("--duration 36000").start();
    run.wait_for_second(1.0);
    run.signal(Part::World, Signal::TERM);
    let run = run.finish();
    run.assert_ended_with(1);
    assert_eq!(run.summary["failures"][0], "the world ended the flight early");
}

#[test]
fn a_run_does_not_fail_when_its_output_is_closed() {
    let out = tempfile::tempdir().unwrap();
    let script = format!(
        "{} run paper-4.1 --duration 5 --out {} 2>&1 | true",
        env!("CARGO_BIN_EXE_ringwing"),
        out.path().display()
    );
    let status = Command::new("bash").args(["-o", "pipefail", "-c", &script]).status().unwrap();
    // The flight ended in order; 141 says that nobody read the summary.
    assert_eq!(status.code(), Some(141), "{status}");
}

#[test]
fn a_process_started_by_hand_ends_when_its_launcher_is_gone() {
    let mut run = Swarm::fly("paper-4.1").with("--real-time --duration 3600 --by-hand agent-2").start();
    let line = run.wait_for_line("waiting for: ringwing ");
    let arguments = line.split_once("waiting for: ringwing ").unwrap().1.to_owned();
    let mut agent = ringwing().args(arguments.split(' ')).spawn().unwrap();
    run.wait_for_second(0.5);
    let domain = run.domain().id().clone();
    send(run.launcher(), Signal::KILL);
    drop(run);
    wait_until("the process started by hand ends", || agent.try_wait().unwrap());
    assert!(ringwing().arg("clean").status().unwrap().success());
    wait_until_gone(&domain);
}

#[test]
fn a_second_interrupt_ends_a_run_whose_world_does_not_answer() {
    let mut run = Swarm::fly("paper-4.2").with("--duration 36000 --set answer_timeout_s=60").start();
    run.wait_for_second(1.0);
    run.signal(Part::World, Signal::STOP);
    run.wait_for_line("world is frozen");
    send(run.launcher(), Signal::INT);
    run.wait_for_line("interrupted; ending the flight");
    send(run.launcher(), Signal::INT);
    let run = run.finish();
    run.assert_ended_with(1);
    assert!(run.summary["failures"][0].as_str().unwrap().contains("interrupted twice"), "{:#}", run.summary);
}

#[test]
fn a_killed_world_ends_the_run_with_its_log_closed() {
    for mode in MODES {
        let run = Swarm::fly("paper-4.2").with(mode).start();
        run.wait_for_second(1.5);
        run.signal(Part::World, Signal::KILL);
        let run = run.finish();
        run.assert_ended_with(1);
        assert_eq!(run.summary["failures"][0], "the world was killed by signal 9");
        assert_eq!(run.summary["flight"]["unplanned_loss_list"][0]["process"], "world");
        assert!(run.summary["payload_hash"].is_null());
        assert!(run.log().states(1).len() > 100);
    }
}

#[test]
fn a_world_that_stays_frozen_ends_the_run() {
    let run = Swarm::fly("paper-4.2").with("--duration 36000 --set answer_timeout_s=0.2").start();
    run.wait_for_second(1.0);
    run.signal(Part::World, Signal::STOP);
    let run = run.finish();
    run.assert_ended_with(1);
    assert!(run.stderr.contains("world stayed frozen for too long"), "{}", run.stderr);
}

/// Kills a launcher and waits until its processes have ended by themselves. Returns the domain left behind.
fn orphan(mode: &str) -> ringwing_bus::DomainId {
    let run = Swarm::fly("paper-4.2").with(mode).start();
    run.wait_for_second(1.0);
    // Frozen processes cannot react, so this also shows that the kernel ends them.
    run.signal(Part::Leader, Signal::STOP);
    run.signal(Part::Recorder, Signal::STOP);
    let domain = run.domain().id().clone();
    assert_eq!(processes_of(&domain).len(), 9);
    send(run.launcher(), Signal::KILL);
    drop(run);
    let start = std::time::Instant::now();
    wait_until("the orphans end", || processes_of(&domain).is_empty().then_some(()));
    assert!(start.elapsed() < Duration::from_secs(1), "{:?}", start.elapsed());
    domain
}

#[test]
fn the_processes_of_a_killed_launcher_end_and_their_remains_are_removed() {
    for (mode, remove) in
        MODES.into_iter().zip([&["clean"][..], &["run", "paper-4.1", "--duration", "1", "--no-record"]])
    {
        let domain = orphan(mode);
        let out = tempfile::tempdir().unwrap();
        // The run of another test may have removed the domain already. Only the result matters: nothing is left.
        let status = ringwing().args(remove).current_dir(out.path()).output().unwrap().status;
        assert!(status.code().is_some_and(|code| code != 1), "{status}");
        wait_until_gone(&domain);
    }
}

#[test]
fn clean_does_not_touch_live_runs() {
    let run = Swarm::fly("paper-4.1").with("--real-time --duration 1").start();
    assert!(ringwing().arg("clean").output().unwrap().status.success());
    assert!(!leftovers(run.domain().id()).is_empty());
    run.finish().assert_nothing_left();
}

#[test]
fn a_folder_that_cannot_be_written_is_reported_with_a_remedy() {
    let file = tempfile::NamedTempFile::new().unwrap();
    for out in [file.path().display().to_string(), "/proc/no/such".into()] {
        let output = ringwing().args(["run", "--out", &out]).output().unwrap();
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(1), "{stderr}");
        assert!(stderr.contains(&out) && stderr.contains("choose another folder with --out"), "{stderr}");
    }
}

#[test]
fn a_full_disk_ends_the_log_but_not_the_flight() {
    let out = tempfile::tempdir().unwrap();
    // The file size limit of 30.7 MB is enough for shared memory and too small for this log. The write fails as it does on a full
    // disk, because no process of a run is killed by the signal for that limit.
    let script = format!(
        "ulimit -f 30000; exec {} run paper-4.2 --duration 500 --out {}",
        env!("CARGO_BIN_EXE_ringwing"),
        out.path().display()
    );
    let output = Command::new("bash").args(["-c", &script]).output().unwrap();
    let (table, stderr) =
        (String::from_utf8(output.stdout).unwrap(), String::from_utf8(output.stderr).unwrap());
    assert_eq!(output.status.code(), Some(1), "{stderr}");
    assert!(stderr.contains(".mcap: cannot be written"), "{stderr}");
    assert!(table.contains("the log is incomplete") && table.contains("500.0 s in"), "{table}");
    let folder = newest_run(out.path()).unwrap();
    assert!(crate::harness::log::Log::read(&log_in(&folder)).states(1).len() > 1000);
}
