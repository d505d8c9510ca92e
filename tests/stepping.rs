//! A flight in lockstep that the user pauses, steps and resumes, as for debugging an agent.

use crate::harness::{Running, Swarm, ringwing, send, wait_until_gone};
use ringwing_flight::{Part, UavId};
use rustix::process::Signal;
use std::{process::Output, thread, time::Duration};

/// Shorter than the pause below: if the pause counted, the world would not wait for it to end.
const IMPATIENT: &str = "--set answer_timeout_s=0.4 --set start_timeout_s=1";
/// How long a paused flight stands still: longer than any of its time limits.
const PAUSE: Duration = Duration::from_millis(2600);

/// A flight that is not over before the test has paused it: for a second of it, everybody waits for a slow UAV.
fn flight() -> Swarm {
    let flight = Swarm::fly("paper-4.2").with("--duration 30 --set law=resilient").with(IMPATIENT);
    flight.fault("at 1 s slow uav 3 by 20 ms for 1 s")
}

/// The exit code and the output of `ringwing` with this verb, the run's domain, and `rest`.
fn told(run: &Running, verb: &str, rest: &[&str]) -> (Option<i32>, String) {
    let id = run.domain().id().to_string();
    let Output { status, stdout, stderr } = ringwing().args([verb, &id]).args(rest).output().unwrap();
    (status.code(), String::from_utf8(stdout).unwrap() + &String::from_utf8(stderr).unwrap())
}

/// Asserts that the answer is a success, and returns the tick in it.
fn tick((code, output): (Option<i32>, String)) -> i64 {
    assert_eq!(code, Some(0), "{output}");
    let number = output.strip_prefix("tick ").and_then(|rest| rest.split(',').next());
    number.and_then(|number| number.parse().ok()).unwrap_or_else(|| panic!("no tick in {output:?}"))
}

#[test]
fn a_pause_changes_no_bit_of_the_flight_and_no_time_limit_runs_meanwhile() {
    let run = flight().start();
    run.wait_for_second(1.1);
    let paused = tick(told(&run, "pause", &[]));
    let gate = run.domain().gate().unwrap();
    assert_eq!(gate.tick().unwrap().0, paused - 1, "the tick before is flown, and the next is not open");
    // Neither an agent nor the leader that is stopped now is late for anything.
    let stopped = [Part::Agent(UavId(2)), Part::Leader].map(|part| run.signal(part, Signal::STOP));
    thread::sleep(PAUSE);
    assert_eq!(gate.tick().unwrap().0, paused - 1);
    for process in stopped {
        send(process, Signal::CONT);
    }
    assert_eq!(tick(told(&run, "step", &[])), paused + 1);
    assert_eq!(tick(told(&run, "step", &["25"])), paused + 26);
    assert_eq!(gate.tick().unwrap().0, paused + 25);
    assert_eq!(tick(told(&run, "pause", &[])), paused + 26, "it is paused already");
    assert_eq!(tick(told(&run, "resume", &[])), paused + 26);
    let run = run.finish();
    run.assert_nothing_left();
    assert_eq!(run.summary["failures"].as_array().unwrap().len(), 0, "{}", run.stderr);
    let lines = run.log().lines();
    assert!(!lines.iter().any(|line| line.starts_with("process.") || line.contains("overdue")), "{lines:#?}");
    let other = flight().finish();
    assert_eq!(run.text("payload_hash"), other.text("payload_hash"));
    assert_eq!(lines, other.log().lines());
}

#[test]
fn a_fault_that_is_asked_for_during_a_pause_acts_before_the_next_tick_and_repeats() {
    let run = flight().start();
    run.wait_for_second(1.1);
    let paused = tick(told(&run, "pause", &[]));
    assert_eq!(tick(told(&run, "fault", &["kill uav 5"])), paused);
    assert_eq!(tick(told(&run, "fault", &["link 2->3 loss 30 %"])), paused, "a second one at the same tick");
    assert_eq!(tick(told(&run, "step", &["10"])), paused + 10);
    assert_eq!(tick(told(&run, "fault", &["start uav 5"])), paused + 10);
    tick(told(&run, "resume", &[]));
    let run = run.finish();
    run.assert_nothing_left();
    let at_s = |tick: i64| tick as f64 / 100.0;
    let repeated = flight()
        .fault(&format!("at {} s kill uav 5", at_s(paused)))
        .fault(&format!("at {} s link 2->3 loss 30 %", at_s(paused)))
        .fault(&format!("at {} s start uav 5", at_s(paused + 10)))
        .finish();
    assert_eq!(run.text("payload_hash"), repeated.text("payload_hash"));
    assert_ne!(run.text("payload_hash"), flight().finish().text("payload_hash"));
}

#[test]
fn what_cannot_be_paused_or_stepped_is_refused_with_the_reason() {
    let refused = |run: &Running, verb, why: &str| {
        let (code, output) = told(run, verb, &[]);
        assert!(code == Some(1) && output.contains(why), "{verb}: {output}");
    };
    let run = Swarm::fly("paper-4.1").with("--real-time --duration 600").start();
    run.wait_for_second(0.1);
    for verb in ["pause", "step", "resume"] {
        refused(&run, verb, "refused: a flight in real time follows the wall clock");
    }
    drop(run);
    let run = Swarm::fly("paper-4.1").with("--duration 36000").start();
    run.wait_for_second(0.1);
    for verb in ["step", "resume"] {
        refused(&run, verb, "refused: the flight is not paused");
    }
    assert_eq!(told(&run, "step", &["0"]).0, Some(2));
}

#[test]
fn a_step_beyond_the_end_is_answered_when_the_flight_is_over() {
    let run = flight().start();
    run.wait_for_second(1.1);
    tick(told(&run, "pause", &[]));
    let (code, output) = told(&run, "step", &["100000"]);
    assert!(code == Some(0) && output.ends_with("the flight is over\n"), "{output}");
    assert_eq!(run.finish().number("ticks"), 3000.0);
}

#[test]
fn a_paused_run_ends_in_order_when_it_is_interrupted_and_leaves_nothing_when_it_is_killed() {
    for signal in [Signal::INT, Signal::KILL] {
        let run = flight().start();
        run.wait_for_second(1.1);
        tick(told(&run, "pause", &[]));
        let id = run.domain().id().clone();
        send(run.launcher(), signal);
        let run = run.finish();
        if signal == Signal::INT {
            run.assert_ended_with(1);
            assert!(run.stderr.contains("interrupt"), "{}", run.stderr);
            assert_eq!(run.log().states(1).len() as f64, run.number("ticks") + 1.0, "the log is whole");
        } else {
            assert!(ringwing().arg("clean").status().unwrap().success());
            wait_until_gone(&id);
        }
    }
}
