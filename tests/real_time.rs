//! Real time: the world keeps to the wall clock and does not wait for late processes.

use crate::harness::{Swarm, ringwing, send, status_of};
use ringwing_flight::{Part, UavId};
use rustix::process::Signal;
use std::{
    fs,
    time::{Duration, Instant},
};

#[test]
fn a_second_takes_a_second_at_every_rate() {
    for rate_hz in [50, 100, 200] {
        let begin = Instant::now();
        let run = Swarm::fly("paper-4.1")
            .with(&format!("--real-time --duration 1.5 --no-record --set time.rate_hz={rate_hz}"))
            .finish();
        run.assert_nothing_left();
        assert_eq!(run.summary["failures"].as_array().unwrap().len(), 0, "{}", run.stderr);
        assert!(begin.elapsed() >= Duration::from_millis(1500), "the flight took less than its duration");
        assert_eq!(run.number("ticks"), 1.5 * f64::from(rate_hz));
        for count in ["missed_deadlines", "reused_commands", "late_max_us"] {
            assert!(run.number(count) >= 0.0);
        }
    }
}

#[test]
fn a_missing_command_is_replaced_by_the_last_one_and_the_schedule_holds() {
    let run = Swarm::fly("paper-4.1").with("--real-time --duration 2").start();
    run.wait_for_second(0.3);
    let agent = run.signal(Part::Agent(UavId(2)), Signal::STOP);
    run.wait_for_second(0.6);
    send(agent, Signal::CONT);
    let run = run.finish();
    assert!(run.number("reused_commands") >= 25.0, "{:#}", run.summary);
    assert_eq!(run.number("ticks"), 200.0);
    let modes: Vec<String> = run.log().states(2).into_iter().map(|state| state.mode).collect();
    assert!(
        modes.iter().all(|mode| mode == "commanded"),
        "the failsafe began after 0.3 s of silence, before the command timeout"
    );
}

#[test]
fn a_stalled_world_counts_every_missed_deadline_and_does_not_catch_up() {
    let run = Swarm::fly("paper-4.1").with("--real-time --duration 2").start();
    run.wait_for_second(0.3);
    let begin = Instant::now();
    let world = run.signal(Part::World, Signal::STOP);
    std::thread::sleep(Duration::from_millis(500));
    send(world, Signal::CONT);
    let run = run.finish();
    assert!(run.number("missed_deadlines") >= 45.0, "{:#}", run.summary);
    assert!(run.number("late_max_us") >= 450_000.0);
    // The world still had 1.7 s to fly when it stalled. Catching up on the half second would end the run after 1.7 s.
    assert!(begin.elapsed() >= Duration::from_millis(2100), "{:?}", begin.elapsed());
}

#[test]
fn pinning_and_a_priority_are_refused_without_real_time() {
    for flag in ["--pin", "--priority=10"] {
        let output = ringwing().args(["run", "paper-4.1", "--duration", "1", flag]).output().unwrap();
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{flag}: {stderr}");
        assert!(stderr.contains("need --real-time"), "{flag}: {stderr}");
    }
}

#[test]
fn processes_are_pinned_urgent_and_locked_where_that_is_permitted() {
    let run = Swarm::fly("paper-4.1").with("--real-time --duration 2 --pin --priority 10").start();
    let process = run.process(Part::Agent(UavId(2)));
    let [cores, locked] = ["Cpus_allowed_list", "VmLck"].map(|key| status_of(process, key).unwrap());
    let stat = fs::read_to_string(format!("/proc/{process}/stat")).unwrap();
    let run = run.finish();
    run.assert_nothing_left();
    assert_eq!(run.summary["failures"].as_array().unwrap().len(), 0, "{}", run.stderr);
    assert!(cores.parse::<u32>().is_ok(), "more than one core: {cores}");
    // Fields 40 and 41 of the line, counted from 1, are the priority and the policy, where 1 is SCHED_FIFO. The first two
    // fields end at the bracket.
    let fields: Vec<&str> = stat.rsplit_once(')').unwrap().1.split_whitespace().collect();
    let is_refused = run.stderr.contains("--priority 10 is not permitted");
    assert_eq!((fields[37], fields[38]), if is_refused { ("0", "0") } else { ("10", "1") });
    let is_unlocked = run.stderr.contains("locking memory is not permitted");
    assert_eq!(locked == "0 kB", is_unlocked, "{locked} locked");
}
