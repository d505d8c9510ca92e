//! Swarms from the smallest size to hundreds of UAVs fly without tuning.

use crate::harness::Swarm;

#[test]
fn three_uavs_fly() {
    let run = Swarm::fly("paper-4.1").with("--uavs 3 --seed 5 --duration 10").finish();
    run.assert_nothing_left();
    assert_eq!(run.number("ticks"), 1000.0);
    assert_eq!(run.summary["failures"].as_array().unwrap().len(), 0);
}

#[test]
fn two_hundred_uavs_fly() {
    let run = Swarm::fly("paper-4.1").with("--uavs 200 --duration 1").finish();
    run.assert_nothing_left();
    assert_eq!(run.summary["failures"].as_array().unwrap().len(), 0, "{}", run.stderr);
    assert_eq!(run.number("ticks"), 100.0);
    let log = run.log();
    for uav in [1, 77, 200] {
        assert_eq!(log.states(uav).len(), 101);
        assert!(log.controls(uav)[1..].iter().all(|control| control.leader_age_s == Some(0.01)));
    }
}
