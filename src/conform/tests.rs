//! What the checks ask and how they judge; `tests/conform.rs` flies them.

use super::*;
use ringwing_scenario::start;
use std::collections::BTreeSet;

fn check(name: &str) -> &'static Check {
    CHECKS.iter().find(|check| check.name == name).unwrap()
}

#[test]
fn every_check_is_a_scenario_that_can_be_flown_and_does_what_it_says() {
    for check in &CHECKS {
        start::states(&check.scenario().unwrap()).unwrap();
    }
    let of = |name| check(name).scenario().unwrap();
    // A sentence or key that is not understood would be left out, so count them.
    for name in ["delayed", "lossy", "frozen", "restarted", "killed", "silence", "alone"] {
        assert_eq!(of(name).faults.len(), 1, "{name}");
    }
    assert_eq!((of("crowd").formation.uavs, of("inside").obstacles.len()), (12, 1));
    assert!(of("crowd").control.collision_filter && of("far").start.draw.ahead_radii < -20_000.0);
}

#[test]
fn names_of_checks_are_different_and_fit_their_column() {
    let names: BTreeSet<_> = CHECKS.iter().map(|check| check.name).collect();
    assert_eq!(names.len(), CHECKS.len());
    assert!(names.iter().all(|name| name.len() < 11), "{names:?}");
    assert!(CHECKS[0].name == GATE && names.contains(TIMED));
}

#[test]
fn each_demand_has_its_own_reasons() {
    let found = || Findings {
        collisions: vec!["uav 1 collides".into()],
        cut: Some("beyond its limits".into()),
        difference: Some("tick 7".into()),
        commanded: 6,
        slot_error_max_m: Some(30.0),
        ..Findings::default()
    };
    let reasons = |name| check(name).reasons(&found()).join("; ");
    assert_eq!(reasons("answers"), "");
    assert_eq!(reasons("limits"), "beyond its limits");
    assert_eq!(reasons("repeats"), "tick 7");
    assert_eq!(reasons("ring"), "uav 1 collides; at the end, a UAV is 30.0 m from its slot; 1 m is allowed");
    assert_eq!(reasons("frozen"), "at the end, a UAV is 30.0 m from its slot; 1 m is allowed");
    let silent = || Findings { failures: vec!["uav 2 is silent".into()], ..Findings::default() };
    assert!(CHECKS.iter().all(|check| check.reasons(&silent())[0] == "uav 2 is silent"));
    let good = |commanded| Findings { commanded, slot_error_max_m: Some(0.5), ..Findings::default() };
    assert!(CHECKS.iter().all(|check| check.reasons(&good(6)).is_empty()));
    // One UAV is lost for good in one check, and in the others all have to be back.
    assert!(check("killed").reasons(&good(5)).is_empty());
    assert_eq!(check("restarted").reasons(&good(5)), ["at the end, 5 of 6 UAVs fly on command"]);
}
