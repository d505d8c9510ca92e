//! What flies does not change unnoticed: payload hashes of flights of every kind, as the processes flew them.
//!
//! A hash here changes only with the flight itself. After a deliberate change of the flight, pin the new hashes and say why.

use ringwing_scenario::{Scenario, Setting, Source};

/// Each flight: the arguments of `ringwing run` that fly it with processes, and its payload hash.
const PINNED: [(&str, &str); 22] = [
    ("paper-4.1", "1b87282c9ce2654791f3b1ce4ad3ec6d"),
    ("paper-4.2", "2e0766c04283bf8b5252da2f15dadfd3"),
    ("delay", "c54cebb3b450f9708831cb76bdb6166b"),
    ("dropout", "d9738e438ac6a553de1fc9bbab3d86cc"),
    ("dropout-return", "29b357a935481a7445027dd30e42ac05"),
    ("leader-loss", "74ee1331fed89bf14c060ce749af81b0"),
    ("lossy", "1a4e4fc51fb3360a36d2a660122677cf"),
    ("partition", "f730242e4ae95bf085ac4e29e0fc6213"),
    ("sensors", "b3e9c43415c4ce41923a59f06f9e5d20"),
    ("storm", "74482c0dfd878b73485d977efaba8f1c"),
    ("paper-4.1 --law paper", "1b87282c9ce2654791f3b1ce4ad3ec6d"),
    ("dropout --law paper", "7cc9af7f06ad62f8a93e3bccdcb50431"),
    ("storm --law paper", "7f469abd881cd68daba56465d0c1bfd4"),
    ("paper-4.1 --uavs 3 --seed 11 --law resilient", "7fdf928eec2181369f6739ad43d431e9"),
    ("paper-4.2 --uavs 3 --seed 12", "3ccef19b4f5bc4ff2fa3c92bf31cc5fc"),
    ("paper-4.1 --uavs 7 --seed 11 --law resilient", "f4763f753ce1f41e7950f64092786bb4"),
    ("paper-4.2 --uavs 7 --seed 12", "867e667c56b32d3214651e32257b1e91"),
    ("paper-4.1 --uavs 33 --seed 11 --law resilient", "b075ac955eba5fd37291c61bd37e8755"),
    ("paper-4.2 --uavs 33 --seed 12", "4cc1486ef8e6fad353ece40678c5d3e8"),
    ("dropout --uavs 12 --seed 5", "88866675069d46046164365c3b9c031d"),
    ("paper-4.1 --set start.uavs=[] --seed 9", "a8c4ed16f9e88c26aaf222a6e8974e2d"),
    ("storm --seed 42", "bf709781e49b197a29b17f954f3a4628"),
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
