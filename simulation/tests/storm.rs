//! The preset `storm`, whose requirements tell the two laws apart.

use crate::support::preset;
use ringwing_simulation::fly;
use std::thread;

/// The seeds for whoever has the time; flying them takes minutes without optimization.
const ALL_SEEDS: u64 = 20;

/// What the storm of `seed` violates under `law`.
fn violations(law: &str, seed: u64) -> Vec<String> {
    let scenario = preset("storm", &[&format!("control.law={law}"), &format!("seed={seed}")]);
    let flown = fly(&scenario).unwrap();
    assert!(flown.summary.turn_rate_saturated_share.is_some(), "seed {seed}");
    flown.violations
}

fn assert_the_laws_are_told_apart(seeds: impl Iterator<Item = u64>) {
    for seed in seeds {
        thread::scope(|scope| {
            scope.spawn(move || assert_eq!(violations("resilient", seed), [""; 0], "seed {seed}"));
            scope.spawn(move || {
                let paper = violations("paper", seed);
                let is_thrown_about =
                    paper.iter().any(|violation| violation.starts_with("turn rate cut in "));
                assert!(is_thrown_about, "seed {seed}: {paper:?}");
            });
        });
    }
}

#[test]
fn only_the_resilient_law_passes_the_storm() {
    assert_the_laws_are_told_apart([1, 2, 13].into_iter());
}

#[test]
#[ignore = "takes minutes without optimization; run it after a change of the law or of the storm"]
fn only_the_resilient_law_passes_twenty_storms() {
    assert_the_laws_are_told_apart(1..=ALL_SEEDS);
}
