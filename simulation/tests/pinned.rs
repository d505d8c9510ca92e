//! What flies does not change unnoticed: payload hashes of flights of every kind, as the processes flew them.
//!
//! A hash here changes only with the flight itself. After a deliberate change of the flight, pin the new hashes and say why.

use ringwing_scenario::{Scenario, Setting, Source};

/// Each flight: the arguments of `ringwing run` that fly it with processes, and its payload hash.
const PINNED: [(&str, &str); 22] = [
    ("paper-4.1", "1b87282c9ce2654791f3b1ce4ad3ec6d"),
    ("paper-4.2", "2e0766c04283bf8b5252da2f15dadfd3"),
    ("delay", "b8076b4b65f0f1c78dd79092f7df9fc1"),
    ("dropout", "1d9617545a58a735c17ce72cccf29ba8"),
    ("dropout-return", "aedcc27b6827220bc3d95564c20ecc91"),
    ("leader-loss", "461690988918f99b0655efacfaeb7c0c"),
    ("lossy", "e1be0913abcbe9114fbdd61b24391587"),
    ("partition", "527f25073123e55e86618e2d04426d1a"),
    ("sensors", "7c07380619d2b2aeace4caa2a29f3970"),
    ("storm", "f72bd245cd63f1b10d78d976d877ab6f"),
    ("paper-4.1 --law paper", "1b87282c9ce2654791f3b1ce4ad3ec6d"),
    ("dropout --law paper", "7cc9af7f06ad62f8a93e3bccdcb50431"),
    ("storm --law paper", "7f469abd881cd68daba56465d0c1bfd4"),
    ("paper-4.1 --uavs 3 --seed 11 --law resilient", "ecf30fd58ba11ff2e020fdda5e38d521"),
    ("paper-4.2 --uavs 3 --seed 12", "3ccef19b4f5bc4ff2fa3c92bf31cc5fc"),
    ("paper-4.1 --uavs 7 --seed 11 --law resilient", "83c6a1a9280811a9c4053e3cf3924683"),
    ("paper-4.2 --uavs 7 --seed 12", "867e667c56b32d3214651e32257b1e91"),
    ("paper-4.1 --uavs 33 --seed 11 --law resilient", "074b5552bad2bbb019954f8d76e78266"),
    ("paper-4.2 --uavs 33 --seed 12", "4cc1486ef8e6fad353ece40678c5d3e8"),
    ("dropout --uavs 12 --seed 5", "a1aa32b058beb0775290c8fbb374fe41"),
    ("paper-4.1 --set start.uavs=[] --seed 9", "a8c4ed16f9e88c26aaf222a6e8974e2d"),
    ("storm --seed 42", "b56622af2887ee55fa1369257011c558"),
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
