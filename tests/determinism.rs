//! The same scenario, seed and build give the same payloads, to the bit, whatever else goes on.

use crate::harness::Swarm;
use ringwing_flight::{Part, UavId};
use ringwing_scenario::{Scenario, Setting, Source};
use ringwing_simulation::Simulation;
use rustix::process::{Pid, setpriority_process};
use std::{
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering::Relaxed},
    },
    thread,
};

/// Drawn starts, so that the seed counts, and an obstacle in the way, so that every term of the law does.
const ARGUMENTS: &str = "--duration 20 --uavs 7 --seed 11 --set obstacles.1.position_m=[150,10]";

fn hash_of(arguments: &str) -> String {
    let run = Swarm::fly("paper-4.2").with(arguments).finish();
    run.assert_nothing_left();
    run.text("payload_hash").to_owned()
}

#[test]
fn the_same_flight_has_the_same_hash_recorded_or_not_loaded_or_not() {
    let hash = hash_of(ARGUMENTS);
    assert_eq!(hash.len(), 32);
    assert_eq!(hash, hash_of(&format!("{ARGUMENTS} --no-record")), "recorder off");
    assert_eq!(hash, loaded(|| hash_of(ARGUMENTS)), "busy machine");
    assert_eq!(hash, niced(), "agents niced");
    assert_ne!(hash, hash_of(&ARGUMENTS.replace("--seed 11", "--seed 12")), "another seed is another flight");
}

/// Runs `flight` while every core is busy with something else.
fn loaded<T>(flight: impl FnOnce() -> T) -> T {
    let stop = Arc::new(AtomicBool::new(false));
    let busy: Vec<_> = (0..4)
        .map(|_| {
            let stop = stop.clone();
            thread::spawn(move || {
                while !stop.load(Relaxed) {
                    std::hint::spin_loop();
                }
            })
        })
        .collect();
    let result = flight();
    stop.store(true, Relaxed);
    for thread in busy {
        thread.join().unwrap();
    }
    result
}

/// The hash of a flight whose agents run at different priorities.
fn niced() -> String {
    let run = Swarm::fly("paper-4.2").with(ARGUMENTS).start();
    for uav in UavId::all(7) {
        let process = run.process(Part::Agent(uav));
        let pid = Pid::from_raw(process.cast_signed());
        // A flight this short may be over already; then the process is gone.
        let _ = setpriority_process(pid, uav.0.cast_signed() * 2);
    }
    run.finish().text("payload_hash").to_owned()
}

#[test]
fn the_processes_fly_what_one_process_computes() {
    let run = Swarm::fly("paper-4.2").with(ARGUMENTS).finish();
    let log = run.log();
    let logged: Vec<_> = (1..=7).map(|uav| (log.states(uav), log.controls(uav))).collect();
    let settings = [
        Setting::parse("time.duration_s=20").unwrap(),
        Setting::parse("formation.uavs=7").unwrap(),
        Setting::parse("seed=11").unwrap(),
        Setting::parse("obstacles.1.position_m=[150,10]").unwrap(),
    ];
    let scenario = Scenario::read(&Source::find("paper-4.2").unwrap(), &settings).unwrap();
    let mut simulation = Simulation::new(&scenario).unwrap();
    // Tick -1 is not part of the flight.
    simulation.step();
    let mut repelled = 0;
    for tick in 0..=2000 {
        assert_eq!(simulation.step(), tick < 2000);
        for (uav, (states, controls)) in UavId::all(7).zip(&logged) {
            let (state, sensed) = (&states[tick], simulation.sensed(uav).unwrap());
            let [x_m, y_m] = sensed.position_m;
            let computed = [x_m, y_m, sensed.heading_rad, sensed.speed_m_s, sensed.turn_rate_rad_s];
            let flown = [state.x_m, state.y_m, state.heading_rad, state.speed_m_s, state.turn_rate_rad_s];
            assert_eq!(computed.map(f64::to_bits), flown.map(f64::to_bits), "{uav} at tick {tick}");
            repelled += usize::from(controls[tick].repulsion_m > 0.0);
        }
    }
    assert!(repelled > 100, "the obstacle was met");
}

#[test]
fn without_timing_the_same_flight_gives_the_same_file() {
    let [one, other] = [(), ()].map(|()| {
        let run = Swarm::fly("paper-4.1").with("--duration 15 --no-timing").finish();
        std::fs::read(run.log_path()).unwrap()
    });
    assert!(one == other, "the files differ");
}
