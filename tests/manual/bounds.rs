//! What a scenario may say for a key, found by asking the reader of scenarios about values that cannot be right.
//!
//! Never repeats a bound: each comes out of the message with which the code refuses a value.

use ringwing_scenario::{PathKind, Scenario, Setting, Source, StartState};

/// Values that break every bound that a number can have.
const NUMBERS: [&str; 5] = ["-1e7", "-1.0", "0.0", "1e-9", "1e7"];
const WHOLE_NUMBERS: [&str; 3] = ["0", "1", "4000000000"];

/// What is said of a bound that no short phrase describes, such as the places of UAVs.
const OTHER: &str = "further limits follow from other keys";

/// A scenario in which each key has a value and each rule applies.
pub(super) struct Example {
    source: Source,
}

impl Example {
    pub(super) fn new() -> Self {
        let mut scenario = ringwing_scenario::example_scenario();
        scenario.control.collision_filter = true;
        scenario.control.ring_closes = true;
        scenario.leader.path.kind = PathKind::Racetrack;
        let start = scenario.start.uavs[0];
        let [x, y] = start.position_m;
        let beside = |uav: u32| StartState { position_m: [x + 20.0 * f64::from(uav), y], ..start };
        scenario.start.uavs = (0..scenario.formation.uavs).map(beside).collect();
        let example = Self { source: Source { name: "example".into(), text: scenario.to_toml() } };
        assert_eq!(example.refusals("seed", "1"), [""; 0], "the example is valid");
        example
    }

    /// The bounds of the number of `key`, in words.
    pub(super) fn bounds(&self, key: &str, is_whole: bool) -> String {
        let probes: &[&str] = if is_whole { &WHOLE_NUMBERS } else { &NUMBERS };
        let mut bounds: Vec<String> = Vec::new();
        for refusal in probes.iter().flat_map(|probe| self.refusals(key, probe)) {
            let bound = bound(&refusal);
            if !bounds.contains(&bound) {
                bounds.push(bound);
            }
        }
        // A time that must be above 0 is told its range from 0 as well.
        if bounds.iter().any(|bound| bound == "above 0") {
            for bound in &mut bounds {
                *bound = bound
                    .strip_prefix("0 to ")
                    .map_or_else(|| bound.clone(), |high| format!("at most {high}"));
            }
        }
        // The vague one last.
        bounds.sort_by_key(|bound| bound == OTHER);
        bounds.join(", ")
    }

    /// What is wrong with `value` for `key`, as the reader says it.
    fn refusals(&self, key: &str, value: &str) -> Vec<String> {
        let setting = Setting::parse(&format!("{key}={value}")).unwrap();
        let Err(error) = Scenario::read(&self.source, &[setting]) else { return Vec::new() };
        let of_key = error.problems().iter().filter(|problem| problem.key.as_deref() == Some(key));
        of_key.map(|problem| problem.message.clone()).collect()
    }
}

/// The bound behind the refusal of a value.
fn bound(refusal: &str) -> String {
    let between = |begin: &str, end: &str| Some(refusal.split_once(begin)?.1.split_once(end)?.0.to_owned());
    // `speed_min_m_s 12 m/s`: the key is the first word.
    let key = |begin: &str| Some(format!("`{}`", between(begin, ": give")?.split(' ').next()?));
    // `at 1 Hz, 4 ticks are longer than membership.loss_timeout_s 1 s`: a longer tick does not fit.
    let fit = |is: &str| Some(format!("so that {} fit into {}", between("Hz, ", is)?, key(is)?));
    None.or_else(|| between(" is outside ", ": give"))
        .or_else(|| Some(format!("at least {}", between(" is shorter than ", " at ")?)))
        .or_else(|| refusal.contains(" is less than one tick at ").then(|| "at least 1 tick".into()))
        .or_else(|| fit(" is longer than "))
        .or_else(|| fit(" are longer than "))
        .or_else(|| refusal.contains(" is not above 0:").then(|| "above 0".into()))
        .or_else(|| refusal.contains(" is below 0:").then(|| "0 or more".into()))
        .or_else(|| Some(format!("above {}", key(" is not above ")?)))
        .or_else(|| Some(format!("below {}", key(" is not below ")?)))
        .or_else(|| Some(format!("at most {}", key(" is above ")?)))
        .or_else(|| Some(format!("at least {}", key(" is below ")?)))
        .unwrap_or_else(|| OTHER.into())
}

#[test]
fn bounds_are_those_of_the_code() {
    let example = Example::new();
    assert!(example.bounds("time.rate_hz", true).starts_with("1 to 1000 Hz"));
    assert_eq!(example.bounds("time.duration_s", false), "above 0, at least 1 tick, at most 86400 s");
    assert_eq!(example.bounds("control.obstacle_gain_m", false), "0 or more");
    assert!(example.bounds("obstacles.0.radius_m", false).starts_with("above 0, below `braking_distance_m`"));
    assert!(example.bounds("airframe.command_timeout_s", false).contains("at least 1 tick"));
    assert!(example.bounds("leader.speed_m_s", false).contains("at least `airframe.speed_min_m_s`"));
}
