//! The presets with faults, flown by the paper's law and by the resilient law.

use crate::harness::{Finished, Swarm};

fn flown(preset: &str, law: &str) -> Finished {
    let run = Swarm::fly(preset).with(&format!("--law {law} --no-record")).finish();
    assert_eq!(run.summary["failures"].as_array().unwrap().len(), 0, "{preset}: {}", run.stderr);
    run.assert_nothing_left();
    run
}

#[test]
fn the_resilient_law_passes_every_preset_and_the_papers_law_fails_under_lasting_faults() {
    for preset in ["dropout", "dropout-return", "delay", "lossy", "partition", "leader-loss", "storm"] {
        let resilient = flown(preset, "resilient");
        resilient.assert_ended_with(0);
        assert_eq!(resilient.summary["flight"]["views"], 1, "{preset}: {:#}", resilient.summary);
        let paper = flown(preset, "paper");
        let (paper_error_m, resilient_error_m) =
            (paper.number("slot_error_max_m"), resilient.number("slot_error_max_m"));
        assert!(resilient_error_m < 0.05, "{preset}: {resilient_error_m}");
        // The paper's law may settle again if the fault ends before the flight does.
        let lasts = ["dropout", "delay"].contains(&preset);
        assert!(!lasts || paper_error_m > 10.0, "{preset}: {paper_error_m}");
    }
}

#[test]
fn the_ring_is_whole_within_ten_seconds_of_a_dropout() {
    let run = flown("dropout", "resilient");
    let recoveries = &run.summary["flight"]["recoveries"];
    assert_eq!(recoveries[0]["fault"], "uav 3 is killed: kill uav 3");
    let recovery_s = recoveries[0]["recovery_s"].as_f64().unwrap();
    assert!((1.0..10.0).contains(&recovery_s), "{recoveries:#}");
}

#[test]
fn the_swarm_agrees_and_recovers_after_a_storm_of_any_seed() {
    for seed in 2..8 {
        let run = Swarm::fly("storm").with(&format!("--no-record --seed {seed}")).finish();
        run.assert_ended_with(0);
        assert_eq!(run.summary["flight"]["views"], 1, "seed {seed}");
        assert!(run.summary["flight"]["disagreed_until_s"].as_f64().unwrap() < 90.0, "seed {seed}");
    }
}
