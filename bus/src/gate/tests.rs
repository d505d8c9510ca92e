use super::*;
use crate::{Due, StopFlag, WaitStrategy, monotonic_ns, usable_cores};
use ringwing_flight::UavId;
use std::{sync::Arc, thread};

fn shared_gate() -> (tempfile::TempDir, Arc<Gate>) {
    let folder = tempfile::tempdir().unwrap();
    let gate = Gate::create(&folder.path().join("gate")).unwrap();
    (folder, Arc::new(gate))
}

#[test]
fn a_closed_gate_stays_closed() {
    let (_folder, gate) = shared_gate();
    gate.open_tick(Tick(0), 1);
    gate.close();
    gate.open_tick(Tick(1), 1);
    assert!(gate.is_closed());
}

#[test]
fn four_threads_step_through_a_thousand_ticks_together() {
    let (_folder, gate) = shared_gate();
    let workers: Vec<_> = UavId::all(4)
        .map(|uav| {
            let gate = gate.clone();
            thread::spawn(move || {
                let (mut strategy, stop, mut seen) =
                    (WaitStrategy::yielding(5, usable_cores()), StopFlag::default(), Vec::new());
                while let Wait::Tick(tick) = gate.wait(seen.last().copied(), &mut strategy, &stop, || ()) {
                    seen.push(tick);
                    gate.answer(Part::Agent(uav), tick);
                }
                seen
            })
        })
        .collect();
    let mut strategy = WaitStrategy::yielding(5, usable_cores());
    let ticks: Vec<Tick> = (-1..1000).map(Tick).collect();
    for tick in &ticks {
        gate.open_tick(*tick, 4);
        while !gate.is_answered() {
            gate.wait_for_answers(&mut strategy, Duration::from_secs(1));
        }
    }
    gate.close();
    for worker in workers {
        assert_eq!(worker.join().unwrap(), ticks);
    }
}

#[test]
fn a_tick_ends_the_wait_before_during_and_after_the_time_to_stand_by_for_it() {
    const MS: u64 = 1_000_000;
    let (_folder, gate) = shared_gate();
    let (mut strategy, stop) = (WaitStrategy::timed(), StopFlag::default());
    for (round, due_in_ms) in (0..).zip([50, 2, 0]) {
        let at_ns = monotonic_ns() + due_in_ms * MS;
        gate.set_due(Due { at_ns, lead_ns: MS });
        thread::scope(|scope| {
            scope.spawn(|| {
                thread::sleep(Duration::from_millis(2));
                gate.open_tick(Tick(round), 1);
            });
            let seen = (round > 0).then(|| Tick(round - 1));
            assert_eq!(gate.wait(seen, &mut strategy, &stop, || ()), Wait::Tick(Tick(round)));
        });
    }
}

#[test]
fn a_missing_answer_ends_the_wait_after_the_limit() {
    let (_folder, gate) = shared_gate();
    gate.open_tick(Tick(0), 1);
    gate.wait_for_answers(&mut WaitStrategy::timed(), Duration::from_millis(1));
    assert!(!gate.is_answered());
}

#[test]
fn a_newcomer_has_missed_the_open_tick_only_while_the_world_holds_the_next() {
    let (_folder, gate) = shared_gate();
    let mut gate = Arc::into_inner(gate).unwrap();
    gate.open_tick(Tick(4), 1);
    gate.note_missed(Part::Leader);
    assert_eq!(gate.missed(), None, "tick 4 still waits for answers");
    gate.hold_before(Tick(5));
    gate.note_missed(Part::Leader);
    assert_eq!((gate.held(), gate.missed()), (Some(Tick(5)), Some(Tick(4))));
    assert!(gate.has_answered(Part::Leader), "it has no part in tick 4");
    gate.release();
    assert_eq!(gate.held(), None);
}

#[test]
fn each_part_answers_on_its_own_and_a_successor_starts_afresh() {
    let (_folder, gate) = shared_gate();
    let mut gate = Arc::into_inner(gate).unwrap();
    let [one, other] = [1, 2].map(|uav| Part::Agent(UavId(uav)));
    gate.open_tick(Tick(4), 2);
    gate.answer(one, Tick(4));
    assert!(gate.has_answered(one) && !gate.has_answered(other));
    gate.note_missed(one);
    assert!(!gate.has_answered(one), "its predecessor answered tick 4, not it");
}

#[test]
fn every_part_is_ready_on_its_own() {
    let (_folder, gate) = shared_gate();
    let parts: Vec<Part> = Part::all(ringwing_flight::payload::MAX_UAVS).collect();
    for (pid, part) in (1..).zip(&parts) {
        gate.set_ready_process(*part, Some(pid));
    }
    for (pid, part) in (1..).zip(&parts) {
        assert_eq!(gate.ready_process(*part), Some(pid));
    }
    assert_eq!((gate.tick(), gate.held(), gate.stop_requested()), (None, None, false), "beside all else");
}

#[test]
fn the_page_of_another_version_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("gate");
    std::fs::write(&path, [0; 64]).unwrap();
    let error = Gate::open(&path).unwrap_err();
    assert!(error.to_string().contains("another version"), "{error}");
}
