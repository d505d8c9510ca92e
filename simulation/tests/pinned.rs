//! What flies does not change unnoticed: payload hashes of flights of every kind, as the processes flew them.
//!
//! A hash here changes only with the flight itself. After a deliberate change of the flight, pin the new hashes and say why.

use ringwing_scenario::{Scenario, Setting, Source};

/// Each flight: the arguments of `ringwing run` that fly it with processes, and its payload hash.
const PINNED: [(&str, &str); 22] = [
    ("paper-4.1", "1b87282c9ce2654791f3b1ce4ad3ec6d"),
    ("paper-4.2", "2e0766c04283bf8b5252da2f15dadfd3"),
    ("delay", "41407b2c74bab37ca46b4fb7b8b4754e"),
    ("dropout", "c67fc36cd696ad8e4d40f285ffed1862"),
    ("dropout-return", "7aad5cdc43b08e36f23fb559cd1a14b3"),
    ("leader-loss", "0eab86085a8444d349d0ffea1d14ee78"),
    ("lossy", "d2bb4136be5de9c5c74079d018d7495b"),
    ("partition", "d052804a8e508615675464e09415fb3c"),
    ("sensors", "755e14fd69dd26429367ca9126d7576a"),
    ("storm", "41e81bf1508b42da6c4aabb2928ab0ca"),
    ("paper-4.1 --law paper", "1b87282c9ce2654791f3b1ce4ad3ec6d"),
    ("dropout --law paper", "7cc9af7f06ad62f8a93e3bccdcb50431"),
    ("storm --law paper", "7f469abd881cd68daba56465d0c1bfd4"),
    ("paper-4.1 --uavs 3 --seed 11 --law resilient", "ecf30fd58ba11ff2e020fdda5e38d521"),
    ("paper-4.2 --uavs 3 --seed 12", "3ccef19b4f5bc4ff2fa3c92bf31cc5fc"),
    ("paper-4.1 --uavs 7 --seed 11 --law resilient", "ecbaadd23ce8eb16a499bb8960a6d3a3"),
    ("paper-4.2 --uavs 7 --seed 12", "867e667c56b32d3214651e32257b1e91"),
    ("paper-4.1 --uavs 33 --seed 11 --law resilient", "e711c0187f9b64b856630e6fca14343f"),
    ("paper-4.2 --uavs 33 --seed 12", "4cc1486ef8e6fad353ece40678c5d3e8"),
    ("dropout --uavs 12 --seed 5", "7bb62f187943840c1906e3df69619c5f"),
    ("paper-4.1 --set start.uavs=[] --seed 9", "a8c4ed16f9e88c26aaf222a6e8974e2d"),
    ("storm --seed 42", "6cd2e4a3d932af78e12a81073a8eefea"),
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
