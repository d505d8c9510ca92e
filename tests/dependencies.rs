//! Which crate may use which: ARCHITECTURE.md draws the arrows, this test guards them.

use serde_json::Value;
use std::{collections::BTreeSet, process::Command};

const ALLOWED: [(&str, &[&str]); 7] = [
    ("ringwing", &["agent", "leader", "messages", "recorder", "scenario", "world"]),
    ("ringwing-agent", &["messages", "scenario"]),
    ("ringwing-leader", &["messages", "scenario"]),
    ("ringwing-recorder", &["messages", "scenario"]),
    ("ringwing-world", &["messages", "scenario"]),
    ("ringwing-messages", &[]),
    ("ringwing-scenario", &[]),
];

#[test]
fn crates_depend_only_as_the_architecture_allows() {
    let output = Command::new(env!("CARGO"))
        .args(["metadata", "--format-version", "1", "--no-deps", "--offline"])
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .unwrap();
    let metadata: Value = serde_json::from_slice(&output.stdout).unwrap();
    let packages = metadata["packages"].as_array().unwrap();
    assert_eq!(packages.len(), ALLOWED.len(), "a crate that this test does not know");
    for (name, allowed) in ALLOWED {
        let package = packages.iter().find(|package| package["name"] == name).unwrap();
        let used: BTreeSet<&str> = package["dependencies"]
            .as_array()
            .unwrap()
            .iter()
            .filter_map(|dependency| dependency["name"].as_str()?.strip_prefix("ringwing-"))
            .collect();
        assert_eq!(used, allowed.iter().copied().collect(), "{name}");
    }
}

/// Modules that hold physics, control or measurement, and know nothing of where their data come from or go to.
const PURE: [&str; 39] = [
    "agent/src/arrivals.rs",
    "agent/src/impairment",
    "agent/src/impairment.rs",
    "agent/src/law",
    "agent/src/lead.rs",
    "agent/src/link.rs",
    "agent/src/membership",
    "agent/src/membership.rs",
    "agent/src/neighbours.rs",
    "agent/src/own.rs",
    "agent/src/pilot.rs",
    "agent/src/slots.rs",
    "leader/src/path.rs",
    "recorder/src/faults.rs",
    "recorder/src/geo.rs",
    "recorder/src/links.rs",
    "recorder/src/layout",
    "recorder/src/layout.rs",
    "recorder/src/metrics",
    "recorder/src/metrics.rs",
    "recorder/src/palette.rs",
    "recorder/src/replay.rs",
    "recorder/src/scene",
    "recorder/src/scene.rs",
    "recorder/src/schema.rs",
    "recorder/src/swarm.rs",
    "recorder/src/verdict.rs",
    "recorder/src/view.rs",
    "scenario/src",
    "src/bench/doctor/parse.rs",
    "src/bench/hops.rs",
    "src/bench/plan.rs",
    "src/bench/samples.rs",
    "src/bench/statistics.rs",
    "src/drawing",
    "world/src/airframe.rs",
    "world/src/collisions.rs",
    "world/src/schedule.rs",
    "world/src/sky.rs",
];

#[test]
fn pure_modules_know_no_processes_clocks_or_shared_memory() {
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    for path in PURE.map(|path| root.join(path)) {
        assert!(path.exists(), "{}", path.display());
        for file in files_below(&path) {
            let text = std::fs::read_to_string(&file).unwrap();
            for foreign in ["iceoryx2", "clap::", "Instant", "SystemTime", "monotonic_ns"] {
                assert!(!text.contains(foreign), "{} knows {foreign}", file.display());
            }
        }
    }
}

fn files_below(path: &std::path::Path) -> Vec<std::path::PathBuf> {
    if path.is_file() {
        return vec![path.to_owned()];
    }
    let entries = std::fs::read_dir(path).unwrap().map(|entry| entry.unwrap().path());
    entries.flat_map(|entry| files_below(&entry)).collect()
}
