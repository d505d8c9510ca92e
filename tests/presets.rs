//! The presets with faults: what the paper's law makes of each, and the resilient one.

use crate::harness::{Finished, Swarm};

fn flown(preset: &str, law: &str) -> Finished {
    let run = Swarm::fly(preset).with(&format!("--law {law} --no-record")).finish();
    assert_eq!(run.summary["failures"].as_array().unwrap().len(), 0, "{preset}: {}", run.stderr);
    run.assert_nothing_left();
    run
}

#[test]
fn the_resilient_law_meets_what_each_preset_asks_for_and_the_papers_does_not() {
    for preset in ["dropout", "dropout-return", "delay", "lossy", "partition", "leader-loss", "storm"] {
        let resilient = flown(preset, "resilient");
        resilient.assert_ended_with(0);
        assert_eq!(resilient.summary["flight"]["views"], 1, "{preset}: {:#}", resilient.summary);
        let paper = flown(preset, "paper");
        let (felt, healed) = (paper.number("slot_error_max_m"), resilient.number("slot_error_max_m"));
        assert!(healed < 0.05, "{preset}: {healed}");
        // Whose fault is over before the end, the paper's law may come to rest again.
        let lasts = ["dropout", "delay"].contains(&preset);
        assert!(!lasts || felt > 10.0, "{preset}: {felt}");
    }
}

#[test]
fn the_ring_is_whole_within_ten_seconds_of_a_dropout() {
    let run = flown("dropout", "resilient");
    let felt = &run.summary["flight"]["recoveries"];
    assert_eq!(felt[0]["fault"], "uav 3 is killed: kill uav 3");
    let recovery_s = felt[0]["recovery_s"].as_f64().unwrap();
    assert!((1.0..10.0).contains(&recovery_s), "{felt:#}");
}

#[test]
fn whatever_the_storm_brings_all_agree_in_the_end_and_are_whole() {
    for seed in 2..8 {
        let run = Swarm::fly("storm").with(&format!("--no-record --seed {seed}")).finish();
        run.assert_ended_with(0);
        assert_eq!(run.summary["flight"]["views"], 1, "seed {seed}");
        assert!(run.summary["flight"]["disagreed_until_s"].as_f64().unwrap() < 90.0, "seed {seed}");
    }
}
