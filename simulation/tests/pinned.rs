//! What flies does not change unnoticed: payload hashes of flights of every kind, as the processes flew them.
//!
//! A hash here changes only with the flight itself. After a deliberate change of the flight, pin the new hashes and say why.

use ringwing_scenario::{Scenario, Setting, Source};

/// Each flight: the arguments of `ringwing run` that fly it with processes, and its payload hash.
const PINNED: [(&str, &str); 21] = [
    ("paper-4.1", "1b87282c9ce2654791f3b1ce4ad3ec6d"),
    ("paper-4.2", "2e0766c04283bf8b5252da2f15dadfd3"),
    ("delay", "53c3252eaa68625ab544137101a36ec5"),
    ("dropout", "f4f108a359e35ddbe0d8958de9b21ac7"),
    ("dropout-return", "933a8ca8275ef8a74afccfb01d677d09"),
    ("leader-loss", "5c6caa22a5e7cc772fab7cd0bce40176"),
    ("lossy", "276dc5afbb26d1b816c38013547b5547"),
    ("partition", "77bcc8c98a5f737955876dbb95c85c37"),
    ("storm", "ba630285a20c4d3c471dab0a97b37c80"),
    ("paper-4.1 --law paper", "1b87282c9ce2654791f3b1ce4ad3ec6d"),
    ("dropout --law paper", "7cc9af7f06ad62f8a93e3bccdcb50431"),
    ("storm --law paper", "7f469abd881cd68daba56465d0c1bfd4"),
    ("paper-4.1 --uavs 3 --seed 11 --law resilient", "9a7ce066c1a37fe733e81a7fad0e0219"),
    ("paper-4.2 --uavs 3 --seed 12", "3ccef19b4f5bc4ff2fa3c92bf31cc5fc"),
    ("paper-4.1 --uavs 7 --seed 11 --law resilient", "a09d69f03d7bb028972e0e6366cf1e49"),
    ("paper-4.2 --uavs 7 --seed 12", "867e667c56b32d3214651e32257b1e91"),
    ("paper-4.1 --uavs 33 --seed 11 --law resilient", "7e07fbdebf3603a7bd0ec3d79ce2c4af"),
    ("paper-4.2 --uavs 33 --seed 12", "4cc1486ef8e6fad353ece40678c5d3e8"),
    ("dropout --uavs 12 --seed 5", "f31213a4a34b77da7d3b2e10439c89a1"),
    ("paper-4.1 --set start.uavs=[] --seed 9", "a8c4ed16f9e88c26aaf222a6e8974e2d"),
    ("storm --seed 42", "afb06effde7193953b5a3027e37cf720"),
];

/// The scenario that these arguments of `ringwing run` fly.
fn scenario(arguments: &str) -> Scenario {
    let mut words = arguments.split_whitespace();
    let preset = words.next().expect("a preset");
    let mut settings = Vec::new();
    while let (Some(flag), Some(value)) = (words.next(), words.next()) {
        settings.push(match flag {
            "--set" => Setting::parse(value).expect("a setting"),
            "--seed" => Setting::of_flag(flag, "seed", value),
            "--uavs" => Setting::of_flag(flag, "formation.uavs", value),
            "--law" => Setting::of_flag(flag, "control.law", value),
            _ => panic!("{flag}"),
        });
    }
    Scenario::read(&Source::find(preset).expect("a preset"), &settings).expect("a valid scenario")
}

#[test]
fn every_pinned_flight_has_its_hash() {
    let mut wrong = Vec::new();
    for (arguments, pinned) in PINNED {
        let flown = ringwing_simulation::fly(&scenario(arguments)).expect("a flight");
        let hash = flown.report.expect("a world that lives").payload_hash;
        if hash != pinned {
            wrong.push(format!("{arguments}: {hash} instead of {pinned}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
