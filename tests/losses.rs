//! Processes that are lost or stall without anybody having planned it.

use crate::harness::{Finished, Running, Swarm, processes_of, send, wait_until};
use ringwing_flight::{Part, UavId};
use ringwing_recorder::schema::UavState;
use rustix::process::Signal;

const AGENT: Part = Part::Agent(UavId(3));
/// Both modes, each with a duration that leaves time for what the test does.
const MODES: [&str; 2] = ["--duration 300", "--real-time --duration 4"];

/// Demands that the flight went to its end and that nothing is left of it; whether it met its requirements is another
/// question, for the paper's law suffers from a loss.
fn assert_flown(run: &Finished) {
    assert!(matches!(run.status.code(), Some(0 | 3)), "{}\n{:#}", run.stderr, run.summary);
    assert_eq!(run.summary["failures"].as_array().unwrap().len(), 0, "{}", run.stderr);
    run.assert_nothing_left();
}

fn assert_told(run: &Finished, event: &str) {
    let lines = run.log().lines();
    assert!(lines.iter().any(|line| line.starts_with(event)), "no {event:?} in {lines:#?}");
}

fn modes_of(states: &[UavState]) -> Vec<&str> {
    let mut modes: Vec<&str> = states.iter().map(|state| state.mode.as_str()).collect();
    modes.dedup();
    modes
}

#[test]
fn a_killed_agent_leaves_its_airframe_to_the_failsafe() {
    for mode in MODES {
        let run = Swarm::fly("paper-4.1").with(mode).start();
        run.wait_for_second(1.0);
        run.signal(AGENT, Signal::KILL);
        let run = run.finish();
        assert_flown(&run);
        assert!(run.stderr.contains("error: uav 3 was killed by signal 9"), "{}", run.stderr);
        assert_told(&run, "process.lost: uav 3 was killed by signal 9");
        assert_told(&run, "failsafe: uav 3");
        assert_eq!(modes_of(&run.log().states(3)), ["commanded", "loiter"]);
        assert_eq!(modes_of(&run.log().states(4)), ["commanded"]);
        let felt = &run.summary["flight"]["recoveries"];
        assert_eq!(felt.as_array().unwrap().len(), 1, "{felt}");
        assert!(felt[0]["fault"].as_str().unwrap().starts_with("uav 3 was killed by signal 9"), "{felt}");
        assert_eq!(run.summary["faults"], 1);
    }
}

#[test]
fn under_the_resilient_law_the_others_close_the_ring() {
    let run = Swarm::fly("paper-4.1").with("--duration 300 --set law=resilient").start();
    run.wait_for_second(1.0);
    run.signal(AGENT, Signal::KILL);
    let run = run.finish();
    assert_flown(&run);
    assert_eq!(modes_of(&run.log().states(3)), ["commanded", "loiter"]);
    for error in ["slot_error_max_m", "neighbour_error_max_m", "radius_error_max_m"] {
        assert!(run.number(error) < 0.05, "{error} {}", run.number(error));
    }
}

#[test]
fn an_airframe_without_its_agent_holds_or_vanishes_if_the_scenario_says_so() {
    for (failsafe, modes) in [("hold", vec!["commanded", "hold"]), ("vanish", vec!["commanded"])] {
        let run = Swarm::fly("paper-4.1").with(&format!("--duration 60 --set failsafe={failsafe}")).start();
        run.wait_for_second(1.0);
        run.signal(AGENT, Signal::KILL);
        let run = run.finish();
        assert_flown(&run);
        let states = run.log().states(3);
        assert_eq!(modes_of(&states), modes);
        assert_eq!(states.len() < 6001, failsafe == "vanish", "{} states", states.len());
    }
}

#[test]
fn a_frozen_agent_is_flown_without_and_taken_back() {
    for mode in MODES {
        let mut run = Swarm::fly("paper-4.1").with(mode).start();
        run.wait_for_second(1.0);
        let agent = run.signal(AGENT, Signal::STOP);
        run.wait_for_line("uav 3 flies without its agent");
        send(agent, Signal::CONT);
        let run = run.finish();
        assert_flown(&run);
        assert_told(&run, "process.frozen: uav 3");
        assert_told(&run, "process.thawed: uav 3");
        assert_eq!(modes_of(&run.log().states(3)), ["commanded", "loiter", "commanded"]);
    }
}

#[test]
fn an_agent_killed_while_it_starts_is_flown_without() {
    for attempt in 0..6_u64 {
        let run = Swarm::fly("paper-4.1").with("--duration 5 --uavs 12").start();
        std::thread::sleep(std::time::Duration::from_micros(700 * attempt));
        let agent = wait_until("the agent is spawned", || process_named(&run, "agent --uav 3 "));
        send(agent, Signal::KILL);
        let run = run.finish();
        assert_flown(&run);
        assert!(run.stderr.contains("uav 3 was killed by signal 9"), "{}", run.stderr);
        assert_eq!(run.number("ticks"), 500.0);
    }
}

fn process_named(run: &Running, words: &str) -> Option<u32> {
    let processes = processes_of(run.domain().id());
    let process = processes.iter().find(|line| line.contains(words))?;
    process.strip_prefix("/proc/")?.split(' ').next()?.parse().ok()
}

#[test]
fn a_killed_leader_or_recorder_is_replaced_and_the_flight_goes_on_as_it_would_have() {
    let undisturbed = Swarm::fly("paper-4.2").with("--duration 300").finish();
    for part in [Part::Leader, Part::Recorder] {
        let run = Swarm::fly("paper-4.2").with("--duration 300").start();
        for second in [10.0, 150.0] {
            run.wait_for_second(second);
            run.signal(part, Signal::KILL);
        }
        let run = run.finish();
        assert_flown(&run);
        assert_eq!(run.stderr.matches("a new one takes over").count(), 2, "{}", run.stderr);
        assert_eq!(
            run.text("payload_hash"),
            undisturbed.text("payload_hash"),
            "after the loss of the {part}"
        );
    }
}

#[test]
fn a_killed_leader_is_replaced_in_real_time() {
    let run = Swarm::fly("paper-4.1").with("--real-time --duration 3").start();
    run.wait_for_second(1.0);
    run.signal(Part::Leader, Signal::KILL);
    let run = run.finish();
    assert_flown(&run);
    assert_told(&run, "process.lost: the leader was killed by signal 9");
    assert_told(&run, "process.ready: leader is ready");
    let controls = run.log().controls(1);
    assert_eq!(controls.last().unwrap().leader_age_s, Some(0.01), "the new leader is heard");
}

#[test]
fn a_frozen_leader_is_replaced_when_it_stays_so() {
    let run = Swarm::fly("paper-4.1").with("--duration 60 --set answer_timeout_s=0.2").start();
    run.wait_for_second(5.0);
    run.signal(Part::Leader, Signal::STOP);
    let run = run.finish();
    run.assert_ended_with(0);
    assert_told(&run, "process.overdue: leader stayed frozen");
}

#[test]
fn a_leader_that_cannot_be_replaced_any_more_ends_the_run_at_once() {
    for mode in ["--duration 36000", "--real-time --duration 3600"] {
        let run = Swarm::fly("paper-4.1").with(mode).with("--set supervision.replacements=0").start();
        run.wait_for_second(1.0);
        run.signal(Part::Leader, Signal::KILL);
        let run = run.finish();
        run.assert_ended_with(1);
        assert_eq!(run.summary["failures"][0], "the leader was killed by signal 9, after 0 replacements");
        assert_eq!(run.summary["failures"].as_array().unwrap().len(), 1, "{:#}", run.summary);
        assert!(run.log().states(1).len() > 100);
    }
}

#[test]
fn an_agent_that_stays_frozen_is_flown_without_to_the_end() {
    let run = Swarm::fly("paper-4.1").with("--duration 30").start();
    run.wait_for_second(5.0);
    run.signal(AGENT, Signal::STOP);
    let run = run.finish();
    assert_flown(&run);
    assert!(run.stderr.contains("uav 3 was still frozen at the end; killed"), "{}", run.stderr);
}

#[test]
fn the_flight_begins_when_all_who_live_are_ready_and_not_before() {
    let hashes: Vec<String> = (0..3)
        .map(|_| {
            let run = Swarm::fly("paper-4.1").with("--uavs 30 --duration 2").start();
            run.signal(Part::Agent(UavId(1)), Signal::KILL);
            let run = run.finish();
            assert_flown(&run);
            for uav in 2..=30 {
                assert_eq!(run.log().controls(uav).len(), 201, "uav {uav} was there from the first tick on");
            }
            run.text("payload_hash").to_owned()
        })
        .collect();
    assert!(hashes.iter().all(|hash| *hash == hashes[0]), "{hashes:?}");
}

#[test]
fn leaders_may_die_one_after_the_other() {
    let undisturbed = Swarm::fly("paper-4.2").with("--duration 200").finish();
    let run = Swarm::fly("paper-4.2").with("--duration 200").start();
    run.wait_for_second(5.0);
    for _ in 0..6 {
        let leader = run.signal(Part::Leader, Signal::KILL);
        wait_until("a successor is ready", || (run.process(Part::Leader) != leader).then_some(()));
    }
    let run = run.finish();
    run.assert_ended_with(0);
    assert_eq!(run.stderr.matches("a new one takes over").count(), 6, "{}", run.stderr);
    assert_eq!(run.text("payload_hash"), undisturbed.text("payload_hash"));
}

#[test]
fn a_new_recorder_takes_over_and_says_what_is_missing() {
    for (mode, ticks) in [("--duration 300", 30_000), ("--real-time --duration 4", 400)] {
        let run = Swarm::fly("paper-4.1").with(mode).start();
        run.wait_for_second(2.5);
        run.signal(Part::Recorder, Signal::KILL);
        let run = run.finish();
        assert_flown(&run);
        assert_told(&run, "recorder.gap: ");
        let states = run.log().states(1);
        let lost = ticks + 1 - states.len();
        // A second that was not flushed, and in real time the moment until the new one listened.
        assert!(lost > 0 && lost <= 150, "{lost} ticks lost");
        // Counted, and in real time also the ticks on either side of which not all had come.
        let counted = run.number("ticks_lost") as usize;
        assert!((lost..=lost + 2).contains(&counted), "{lost} lost, {counted} counted");
        assert!(states.windows(2).all(|pair| pair[0].tick < pair[1].tick), "in order, nothing twice");
        assert_eq!(states[0].tick, 0);
        let files: Vec<_> =
            std::fs::read_dir(&run.folder).unwrap().map(|entry| entry.unwrap().file_name()).collect();
        assert_eq!(files.len(), 5, "{files:?}");
    }
}

#[test]
fn a_frozen_recorder_stops_the_flight_for_a_bounded_time_only() {
    let mut run = Swarm::fly("paper-4.1").with("--duration 300 --set answer_timeout_s=0.2").start();
    run.wait_for_second(5.0);
    let recorder = run.signal(Part::Recorder, Signal::STOP);
    run.wait_for_line("the recorder does not fetch what there is");
    run.wait_for_second(100.0);
    send(recorder, Signal::CONT);
    let run = run.finish();
    assert_flown(&run);
    assert_told(&run, "recorder.gap: ");
}
