//! Runs that stand still as a whole and go on, and signals that whoever starts a run has set to be ignored.

use crate::harness::{Finished, Running, Swarm, log_in, newest_run, send, wait_until};
use ringwing_flight::{Part, UavId};
use rustix::process::Signal;
use std::{fs, process::Command, thread, time::Duration};

/// Shorter than the pause below: if the time asleep counted, processes would be given up.
const IMPATIENT: &str = "--set answer_timeout_s=0.4 --set start_timeout_s=1";
/// How long the run stands still.
const PAUSE: Duration = Duration::from_millis(1800);

/// The processes of a swarm of six.
fn processes(run: &Running) -> Vec<u32> {
    Part::all(6).map(|part| run.process(part)).collect()
}

/// The letter of the process's state: `T` if it is stopped.
fn state(process: u32) -> Option<char> {
    let stat = fs::read_to_string(format!("/proc/{process}/stat")).ok()?;
    stat.rsplit_once(')')?.1.trim_start().chars().next()
}

fn wait_until_stopped(processes: &[u32]) {
    for process in processes {
        wait_until("the process is stopped", || (state(*process) == Some('T')).then_some(()));
    }
}

/// A flight in lockstep that is not over before the test has sent its signals: for a second of it, everybody waits for a
/// slow UAV.
fn flight_in_lockstep() -> Swarm {
    let flight = Swarm::fly("paper-4.2").with("--duration 30").with(IMPATIENT);
    flight.fault("at 1 s slow uav 3 by 20 ms for 1 s")
}

/// Asserts that a flight in lockstep went to its end as if nothing had disturbed it.
fn assert_undisturbed(run: &Finished) {
    assert_eq!(run.summary["failures"].as_array().unwrap().len(), 0, "{}", run.stderr);
    run.assert_nothing_left();
    let other = flight_in_lockstep().finish();
    assert_eq!(run.text("payload_hash"), other.text("payload_hash"), "{}", run.stderr);
    let lines = run.log().lines();
    assert!(!lines.iter().any(|line| line.starts_with("process.")), "{lines:#?}");
}

#[test]
fn ctrl_z_stops_every_process_and_a_flight_in_lockstep_goes_on_to_the_bit() {
    let run = flight_in_lockstep().start();
    run.wait_for_second(1.1);
    let all: Vec<u32> = processes(&run).into_iter().chain([run.launcher()]).collect();
    send(run.launcher(), Signal::TSTP);
    wait_until_stopped(&all);
    thread::sleep(PAUSE);
    assert!(all.iter().all(|process| state(*process) == Some('T')));
    send(run.launcher(), Signal::CONT);
    assert_undisturbed(&run.finish());
}

#[test]
fn ctrl_z_keeps_what_a_fault_has_frozen() {
    let flight = Swarm::fly("paper-4.1").with("--real-time --duration 4");
    let run = flight.fault("at 0.3 s freeze uav 3 for 2 s").start();
    run.wait_for_second(0.6);
    let (frozen, other) = (run.process(Part::Agent(UavId(3))), run.process(Part::Leader));
    wait_until_stopped(&[frozen]);
    send(run.launcher(), Signal::TSTP);
    wait_until_stopped(&[other, run.launcher()]);
    send(run.launcher(), Signal::CONT);
    wait_until("the leader runs again", || (state(other) != Some('T')).then_some(()));
    assert_eq!(state(frozen), Some('T'));
    run.finish().assert_nothing_left();
}

#[test]
fn a_run_in_real_time_says_that_it_stood_still_and_for_how_long() {
    let run = Swarm::fly("paper-4.1").with(&format!("--real-time --duration 3 {IMPATIENT}")).start();
    run.wait_for_second(0.5);
    send(run.launcher(), Signal::TSTP);
    wait_until_stopped(&[run.launcher()]);
    thread::sleep(PAUSE);
    send(run.launcher(), Signal::CONT);
    let run = run.finish();
    assert!(matches!(run.status.code(), Some(0 | 3)), "{}\n{:#}", run.stderr, run.summary);
    assert_eq!(run.number("ticks"), 300.0);
    let lines = run.log().lines();
    let paused: Vec<&String> = lines.iter().filter(|line| line.starts_with("run.paused: ")).collect();
    let [line] = paused.as_slice() else { panic!("{lines:#?}") };
    let seconds: f64 = line.split_whitespace().nth(6).unwrap().parse().unwrap();
    assert!((1.4..30.0).contains(&seconds), "{line}");
}

#[test]
fn a_container_that_is_paused_costs_no_process() {
    let run = flight_in_lockstep().start();
    run.wait_for_second(1.1);
    let all: Vec<u32> = processes(&run).into_iter().chain([run.launcher()]).collect();
    for process in &all {
        send(*process, Signal::STOP);
    }
    wait_until_stopped(&all);
    thread::sleep(PAUSE);
    for process in &all {
        send(*process, Signal::CONT);
    }
    assert_undisturbed(&run.finish());
}

#[test]
fn signals_that_were_ignored_from_the_start_stay_ignored() {
    let out = tempfile::tempdir().unwrap();
    // What `nohup` and a shell's `&` do.
    let script = format!(
        "trap '' HUP INT; exec {} run paper-4.1 --real-time --duration 2 --out {}",
        env!("CARGO_BIN_EXE_ringwing"),
        out.path().display()
    );
    let mut run = Command::new("bash")
        .args(["-c", &script])
        .stdout(std::process::Stdio::null())
        .stderr(std::process::Stdio::null())
        .spawn()
        .unwrap();
    wait_until("the flight has begun", || {
        let folder = newest_run(out.path())?;
        log_in(&folder).exists().then_some(())
    });
    send(run.id(), Signal::INT);
    send(run.id(), Signal::HUP);
    let status = wait_until("the run ends", || run.try_wait().unwrap());
    assert!(matches!(status.code(), Some(0 | 3)), "{status}");
}
