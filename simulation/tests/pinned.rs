//! What flies does not change unnoticed: payload hashes of flights of every kind, as the processes flew them.
//!
//! A hash here changes only with the flight itself. After a deliberate change of the flight, pin the new hashes and say why.

use ringwing_scenario::{Scenario, Setting, Source};

/// Each flight: the arguments of `ringwing run` that fly it with processes, and its payload hash.
const PINNED: [(&str, &str); 21] = [
    ("paper-4.1", "1b87282c9ce2654791f3b1ce4ad3ec6d"),
    ("paper-4.2", "2e0766c04283bf8b5252da2f15dadfd3"),
    ("delay", "503b9b964da63945ecdf15557ddfb593"),
    ("dropout", "0e874ad916c29d1c47462b589b4b5fbd"),
    ("dropout-return", "19407ba3e825212b281875df1584b74b"),
    ("leader-loss", "aa61a2445ba2a9b3b7d4501d2d6a85a7"),
    ("lossy", "142f67f4f8c28cfb61deb25d1e7ca42c"),
    ("partition", "ef4b71789855c1b8e212a9c0a4ce4e2c"),
    ("storm", "2ca453726a41597701fd21112aef9e5e"),
    ("paper-4.1 --law paper", "1b87282c9ce2654791f3b1ce4ad3ec6d"),
    ("dropout --law paper", "7cc9af7f06ad62f8a93e3bccdcb50431"),
    ("storm --law paper", "7f469abd881cd68daba56465d0c1bfd4"),
    ("paper-4.1 --uavs 3 --seed 11 --law resilient", "6d23c2c301b34baf7128e5e068317e70"),
    ("paper-4.2 --uavs 3 --seed 12", "3ccef19b4f5bc4ff2fa3c92bf31cc5fc"),
    ("paper-4.1 --uavs 7 --seed 11 --law resilient", "dbfd9bf47f3f99e20edce907b46e7574"),
    ("paper-4.2 --uavs 7 --seed 12", "867e667c56b32d3214651e32257b1e91"),
    ("paper-4.1 --uavs 33 --seed 11 --law resilient", "8691e1090bf19603e23ee1364181f7a5"),
    ("paper-4.2 --uavs 33 --seed 12", "4cc1486ef8e6fad353ece40678c5d3e8"),
    ("dropout --uavs 12 --seed 5", "66c63250fbcdade6558ef946fa319900"),
    ("paper-4.1 --set start.uavs=[] --seed 9", "a8c4ed16f9e88c26aaf222a6e8974e2d"),
    ("storm --seed 42", "ddd70a0d2e937086eb4d53df5e0345c2"),
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
