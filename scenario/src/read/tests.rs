use super::*;
use crate::{ControlSection, DeadReckoning, Law, ObstacleSection, RequirementsSection, preset};
use proptest::{prelude::*, sample::Index};

fn read(text: &str, settings: &[&str]) -> Result<Scenario, ScenarioError> {
    let settings: Vec<_> = settings.iter().map(|text| Setting::parse(text).unwrap()).collect();
    Scenario::read(&Source { name: "wind.toml".into(), text: text.into() }, &settings)
}

fn problems(text: &str, settings: &[&str]) -> String {
    read(text, settings).unwrap_err().to_string()
}

const PRESET: &str = include_str!("../../presets/paper-4.2.toml");

#[test]
fn every_mistake_is_reported_at_once() {
    let text = r#"
name = "a/b"
colour = "red"
[time]
duration_s = "90 s"
rate_hz = 99.5
[formation]
uavs = 2
[control]
law = "tenacious"
dead_reckoning = "half"
[airframe]
speed_max_m_s = 10
speed_min_km_h = 43
[leader]
start_m = [0, nan]
[[obstacles]]
name = "mast"
position_m = [900.0, 42.0]
radius_m = 10
[[obstacles]]
name = "tower"
position_m = [500.0, 42.0]
radius_m = 30
braking_distance_m = 20
"#;
    let settings = ["speed_m_s=-3", "time.real_tiem=true", "replacements=-1", "obstacles.4.radius_m=1"];
    assert_eq!(
        problems(text, &settings),
        r#"
wind.toml:2: name: the name has characters other than letters, digits, "-", "_" and ".": give a name for a folder, such as "paper-4.2"
wind.toml:3: colour: no such key; the keys here are agents, airframe, control, description, faults, formation, georeference, intruders, ipc, leader, manoeuvres, membership, name, obstacle_field, obstacles, requirements, safety, seed, sensing, sensors, start, supervision, time, wind
wind.toml:5: time.duration_s: "90 s" is text: give a number of seconds without a unit, such as 90.0
wind.toml:6: time.rate_hz: 99.5 is not a whole number: give a whole number of hertz, such as 100
wind.toml:8: formation.uavs: 2 is outside 3 to 1024: give a value in this range
wind.toml:10: control.law: "tenacious" is not known: give "paper" or "resilient"
wind.toml:11: control.dead_reckoning: "half" is not known: give one of "off", "tick", "full"
wind.toml:13: airframe.speed_max_m_s: 10 m/s is not above speed_min_m_s 12 m/s: give a larger value
wind.toml:14: airframe.speed_min_km_h: no such key; did you mean speed_min_m_s, in m/s?
wind.toml:16: leader.start_m: NaN is not finite: give two numbers of metres, such as [900.0, 42.0]
wind.toml:17: obstacles.0.braking_distance_m: missing: give a number of metres without a unit, such as 20.0
wind.toml:25: obstacles.1.braking_distance_m: 20 m is not above radius_m 30 m: give a larger value
--set speed_m_s=-3: leader.speed_m_s: -3 m/s is below airframe.speed_min_m_s 12 m/s: give a larger value
--set time.real_tiem=true: time.real_tiem: no such key; did you mean real_time?
--set replacements=-1: supervision.replacements: -1 is out of range: give a whole number, such as 10
--set obstacles.4.radius_m=1: obstacles.4.radius_m: there is no item 4 in a list of 2; the first item is 0
"#
        .trim()
    );
}

#[test]
fn a_rate_of_zero_is_one_mistake() {
    assert_eq!(
        problems("time.rate_hz = 0", &[]),
        "wind.toml:1: time.rate_hz: 0 Hz is outside 1 to 1000 Hz: give a value in this range"
    );
}

#[test]
fn an_empty_file_is_the_default_scenario() {
    assert_eq!(read("", &[]).unwrap(), Scenario::default());
    assert_eq!(read("\u{feff}formation.spacing_m = 40\r\n", &[]).unwrap(), Scenario::default());
}

#[test]
fn overrides_replace_the_values_of_the_file() {
    let settings = ["speed_max_m_s=27", "control.law=paper", "obstacles.1.name=mast", "seed=3", "seed=4"];
    let scenario = read(PRESET, &settings).unwrap();
    assert_eq!(scenario.airframe.speed_max_m_s.to_bits(), 27.0_f64.to_bits());
    assert_eq!(
        (scenario.control.law, scenario.obstacles[1].name.as_str(), scenario.seed),
        (Law::Paper, "mast", 4)
    );
    assert_eq!(read(PRESET, &["obstacles=[]"]).unwrap().obstacles, []);
    assert_eq!(read("", &["settling_max_s=20"]).unwrap().requirements.settling_max_s, Some(20.0));
    assert_eq!(read("", &["requirements={}"]).unwrap().requirements, RequirementsSection::default());
}

#[test]
fn the_law_sets_the_switches_that_the_scenario_leaves_out() {
    let control = |text: &str, settings: &[&str]| read(text, settings).unwrap().control;
    let on = |control: &ControlSection| {
        let full = control.dead_reckoning == DeadReckoning::Full;
        [full, control.trust_fades, control.gain_fades, control.force_limited, control.ring_closes]
    };
    assert_eq!(on(&control("", &[])), [false; 5]);
    assert_eq!(on(&control("control.law = 'resilient'", &[])), [true; 5]);
    let three = control("control.law = 'resilient'\ncontrol.gain_fades = false", &[]);
    assert_eq!((on(&three), three.law), ([true, true, false, true, true], Law::Resilient));
    assert_eq!(on(&control("control.trust_fades = true", &[])), [false, true, false, false, false]);
    assert_eq!(on(&control("", &["law=resilient", "ring_closes=false"])), [true, true, true, true, false]);
    let gain_m = |settings: &[&str]| control("control.obstacle_gain_m = 100.0", settings).obstacle_gain_m;
    assert_eq!(
        (gain_m(&[]), gain_m(&["law=resilient"]), control("", &[]).obstacle_gain_m),
        (100.0, 10.0, 100.0)
    );
    assert_eq!(gain_m(&["law=resilient", "obstacle_gain_m=30"]), 30.0);
}

#[test]
fn another_law_drops_the_switches_of_the_file() {
    assert_eq!(
        read(PRESET, &["law=resilient"]).unwrap(),
        read("", &["law=resilient"])
            .map(|scenario| Scenario { control: scenario.control, ..read(PRESET, &[]).unwrap() })
            .unwrap()
    );
    let kept = read("control.law = 'resilient'\ncontrol.gain_fades = false", &["law=resilient"]).unwrap();
    assert!(!kept.control.gain_fades, "the setting does not change the law");
}

#[test]
fn an_override_corrects_a_mistake_in_the_file() {
    assert!(read("time.duration_s = '90 s'", &["duration_s=90"]).is_ok());
    assert!(read("time = 3", &["duration_s=90"]).is_err());
}

#[test]
fn a_violation_of_two_values_is_blamed_on_the_one_set_last() {
    assert_eq!(
        problems(PRESET, &["speed_min_m_s=15.5"]).lines().next().unwrap(),
        "--set speed_min_m_s=15.5: airframe.speed_min_m_s: 15.5 m/s is above leader.speed_m_s 15 m/s: give a smaller value"
    );
    assert_eq!(
        problems("\n[airframe]\nspeed_min_m_s = 15.5", &[]),
        "wind.toml:3: airframe.speed_min_m_s: 15.5 m/s is above leader.speed_m_s 15 m/s: give a smaller value"
    );
}

#[test]
fn a_value_that_violates_two_bounds_is_reported_twice() {
    assert_eq!(
        problems("airframe.speed_max_m_s = 10", &[]),
        r"
wind.toml:1: airframe.speed_max_m_s: 10 m/s is below leader.speed_m_s 15 m/s: give a larger value
wind.toml:1: airframe.speed_max_m_s: 10 m/s is not above speed_min_m_s 12 m/s: give a larger value
"
        .trim()
    );
}

#[test]
fn another_number_of_uavs_drops_the_listed_starts() {
    assert_eq!(read(PRESET, &["uavs=6"]).unwrap().start.uavs.len(), 6);
    assert_eq!(read(PRESET, &["uavs=200"]).unwrap().start.uavs, []);
    let seven = PRESET.replace("uavs = 6 ", "uavs = 7 ");
    let line = 1 + seven.lines().position(|line| line == "[[start.uavs]]").unwrap();
    assert_eq!(
        problems(&seven, &[]),
        format!(
            "wind.toml:{line}: start.uavs: 6 starts are listed, but formation.uavs is 7: list 7 starts, \
             or none to draw them"
        )
    );
    let one = "start.uavs=[{position_m=[0,0], heading_deg=0, speed_m_s=15}]";
    assert!(problems(PRESET, &["uavs=3", one]).starts_with("--set start.uavs="));
}

#[test]
fn syntax_errors_are_reported_line_by_line() {
    assert_eq!(
        problems("name = wind\n[time]\nduration_s = 90 s\nrate_hz = 100\nrate_hz = 50\n[oops\n", &[]),
        r"
wind.toml:1: this is not a value: put text in quotes
wind.toml:3: this is not a value: give a number with a decimal point and without a unit, such as 90.0
wind.toml:5: this is not TOML: duplicate key
wind.toml:6: this is not TOML: unclosed table, expected `]`
"
        .trim()
    );
}

#[test]
fn a_wrong_value_is_reported_once() {
    for text in [
        "start.uavs = 5",
        "start = 5",
        "formation.uavs = 'six'",
        "[[start.uavs]]\nposition_m = [1, 2]",
        "time.rate_hz = -1",
        "time.rate_hz = 5000000000",
        "airframe.speed_min_m_s = nan",
        "obstacles = 'none'",
    ] {
        let mut whole: toml::Table = PRESET.parse().unwrap();
        let broken: toml::Table = text.parse().unwrap();
        for (section, values) in broken {
            match (whole.get_mut(&section), values) {
                (Some(toml::Value::Table(into)), toml::Value::Table(values)) => into.extend(values),
                (_, values) => drop(whole.insert(section, values)),
            }
        }
        let count = problems(&whole.to_string(), &[]).lines().count();
        assert_eq!(count, if text.starts_with("[[") { 3 } else { 1 }, "{text}");
    }
}

#[test]
fn the_largest_seed_survives_writing_and_reading() {
    let scenario = Scenario { seed: u64::MAX, ..Scenario::default() };
    assert_eq!(read_back(&scenario), scenario);
}

/// What each way to read a written scenario gives.
fn read_back(scenario: &Scenario) -> Scenario {
    let text = scenario.to_toml();
    let read = Scenario::resolved(&text).unwrap();
    assert_eq!(Scenario::of_run(&text).unwrap(), read);
    read
}

#[test]
fn a_scenario_of_a_run_that_was_changed_by_hand_is_refused_with_its_line() {
    let text = Scenario::default().to_toml().replace("uavs = 6", "uavs = 'six'");
    let error = Scenario::of_run(&text).unwrap_err().to_string();
    assert!(error.starts_with("scenario.toml:") && error.contains("formation.uavs"), "{error}");
}

#[test]
fn a_problem_has_its_place_and_its_key_as_data() {
    let error = read("time.duration_s = 0", &[]).unwrap_err();
    let [problem] = error.problems() else { panic!("one problem") };
    assert_eq!((&problem.place, problem.key.as_deref()), (&Place::Line(1), Some("time.duration_s")));
}

proptest! {
    #[test]
    fn a_written_scenario_reads_back_to_the_last_bit(
        spacing in 2.5..1e7_f64, gain in 1e-300..5e6_f64, bearing in -360.0..=360.0_f64,
        places in prop::collection::vec(prop::array::uniform2(-1e7..1e7_f64), 0..7),
        start in prop::array::uniform2(prop_oneof![Just(-0.0), Just(f64::MIN_POSITIVE / 3.0), -1e7..1e7_f64]),
        clearance in prop::option::of(0.0..1e3_f64), seed: u64, description in "[^\\p{Cc}]*",
    ) {
        let mut scenario = Scenario { description, seed, ..Scenario::default() };
        scenario.formation.spacing_m = spacing;
        scenario.formation.bearing_deg = bearing;
        scenario.control.formation_gain = gain;
        scenario.leader.start_m = start;
        scenario.requirements.clearance_min_m = clearance;
        let obstacle = |(index, position_m)| ObstacleSection {
            waypoints_m: vec![position_m; index],
            waypoint_speed_m_s: gain,
            ..ObstacleSection::standing(format!("\"{index}\\"), position_m, gain, gain * 1.5)
        };
        scenario.sensing.range_m = 1e7;
        scenario.obstacles = places.into_iter().enumerate().map(obstacle).collect();
        let read = read_back(&scenario);
        prop_assert_eq!(read.leader.start_m.map(f64::to_bits), start.map(f64::to_bits));
        prop_assert_eq!(read, scenario);
    }

    #[test]
    fn no_text_makes_the_reader_panic(
        which: Index, changes in prop::collection::vec((any::<Index>(), any::<Option<u8>>(), 0_usize..20), 1..8),
    ) {
        let mut bytes = which.get(preset::all()).text.as_bytes().to_vec();
        for (place, byte, length) in changes {
            let start = place.index(bytes.len());
            let end = (start + length).min(bytes.len());
            bytes.splice(start..end, byte);
            bytes.push(b'\n');
        }
        let text = String::from_utf8_lossy(&bytes);
        if let Err(error) = read(&text, &["uavs=7", "obstacles.0.radius_m=3"]) {
            prop_assert!(!error.problems().is_empty());
            prop_assert_eq!(error.to_string().lines().count(), error.problems().len());
        }
    }

    #[test]
    fn no_override_makes_the_reader_panic(key in "[a-z_.0-9]{0,12}|start.uavs|obstacles.0|time", value in ".{0,12}") {
        let _ = read(PRESET, &[&format!("x{key}={value}"), &format!("time.{key}={value}")]);
        let setting = Setting::of_flag("--flag", &key, value);
        let _ = Scenario::read(&Source::find("paper-4.2").unwrap(), &[setting]);
    }
}

#[test]
fn added_faults_must_be_possible_in_the_swarm() {
    let with = |sentence: &str| Scenario::default().with_faults(&[sentence.parse().unwrap()]);
    assert_eq!(with("at 30 s kill uav 3").unwrap().faults.len(), 1);
    assert_eq!(
        with("at 30 s kill uav 7").unwrap_err().to_string(),
        "--fault \"at 30 s kill uav 7\": there is no uav 7: this run has UAVs 1 to 6"
    );
    let error = with("at 1 s link all delay file \"nowhere.txt\"").unwrap_err().to_string();
    let flag = "--fault \"at 1 s link all delay file \"nowhere.txt\"\": ";
    assert!(error.starts_with(&format!("{flag}delay file \"nowhere.txt\": ")), "{error}");
    let slow = with("at 1 s slow uav 3 by 3 s").unwrap_err().to_string();
    assert!(
        slow.contains("uav 3 would answer 3 s late") && slow.contains("answer_timeout_s to 3.75 s"),
        "{slow}"
    );
    assert!(
        with("at 1 s link all gilbert loss 5 % burst 5 ms")
            .unwrap_err()
            .to_string()
            .contains("shorter than a tick")
    );
}

#[test]
fn answers_that_the_world_would_not_wait_for_are_refused_in_lockstep_only() {
    let fault = |second: &str| {
        format!("faults = [\n{{ at_s = 1.0, do = \"slow uav 3 by 1 s for 2 s\" }},\n{second}\n]")
    };
    let together = fault("{ at_s = 2.0, do = \"slow all uavs by 1 s\" }");
    let error = read(&together, &[]).unwrap_err().to_string();
    assert_eq!(
        error,
        "wind.toml:3: faults.1.do: uav 3 would answer 2 s late, and in lockstep the world gives up a \
         process after supervision.answer_timeout_s 2 s: slow it by at most 1.6 s, or set answer_timeout_s to 2.5 s"
    );
    assert!(read(&together, &["answer_timeout_s=2.5"]).is_ok());
    assert!(read(&together, &["real_time=true"]).is_ok());
    assert!(
        read(&fault("{ at_s = 3.0, do = \"slow all uavs by 1 s\" }"), &[]).is_ok(),
        "one after the other"
    );
}

#[test]
fn a_delay_file_counts_from_the_folder_of_its_scenario_and_its_errors_have_both_lines() {
    let folder = std::env::temp_dir().join(format!("ringwing-reader-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("wifi.txt"), "0.02\n1e300\n").unwrap();
    let path = folder.join("wind.toml");
    let text = "seed = 7\n[[faults]]\nat_s = 1.0\ndo = \"link 2->3 delay file \\\"wifi.txt\\\"\"\n";
    let source = Source { name: path.display().to_string(), text: text.into() };
    let error = Scenario::read(&source, &[]).unwrap_err().to_string();
    let expected = format!(
        "{0}/wind.toml:4: faults.0.do: delay file \"{0}/wifi.txt\", line 2: \"1e300\" is outside 0 to 86400 s",
        folder.display()
    );
    assert!(error.starts_with(&expected), "{error}");
    std::fs::write(folder.join("wifi.txt"), "\u{feff}0.02\r\n").unwrap();
    let scenario = Scenario::read(&source, &[]).unwrap();
    assert_eq!(scenario.faults[0].action.to_string(), "link 2->3 delay trace {20 ms}");
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn a_warning_names_the_line_or_the_flag_of_a_fault_that_can_have_no_effect() {
    let text = "[time]\nduration_s = 10.0\n[[faults]]\nat_s = 1.0\ndo = \"link 2->5 blackout\"\n";
    let source = Source { name: "wind.toml".into(), text: text.into() };
    let reading = Reading::read(&source, &[]).unwrap();
    let added = ["at 2 s kill uav 3".parse().unwrap(), "at 30 s kill uav 4".parse().unwrap()];
    let warnings = reading.with_faults(&added).unwrap().warnings();
    let lines: Vec<String> = warnings.iter().map(ToString::to_string).collect();
    assert_eq!(
        lines,
        [
            "wind.toml:5: the fault will have no effect: uav 2 and uav 5 are not ring neighbours, so \
             they do not listen to each other",
            "--fault \"at 30 s kill uav 4\": the fault will have no effect: it begins at 30 s, and the flight ends at 10 s",
        ]
    );
}

#[test]
fn a_track_file_becomes_part_of_the_scenario_and_its_errors_have_both_lines() {
    let folder = std::env::temp_dir().join(format!("ringwing-track-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let source = Source {
        name: folder.join("lead.toml").display().to_string(),
        text: "[leader.path]\nkind = \"track\"\nfile = \"track.csv\"\n".into(),
    };
    let error = |csv: &str| {
        std::fs::write(folder.join("track.csv"), csv).unwrap();
        Scenario::read(&source, &[]).unwrap_err().to_string()
    };
    let place = format!("{0}/lead.toml:3: leader.path.file: path file \"{0}/track.csv\"", folder.display());
    for (csv, problem) in [
        ("time_s,x_m,y_m\n0,0,0\n4,sixty,0\n", ", line 3: x_m \"sixty\" is not a number"),
        ("time_s,x_m,y_m\n0,0,0\n# half way\n4,60,0\n3,80,0\n", ", line 5: 3 s is not after 4 s"),
        ("time_s,x_m,y_m\n0,0,0\n", ": a track needs two points or more"),
        ("time_s,x_m,y_m\n0,0,0\n4,60,0\n8,60,60\n", ", line 2: at 3.00 s every UAV would fly at"),
    ] {
        let error = error(csv);
        assert!(error.starts_with(&format!("{place}{problem}")), "{csv}: {error}");
        assert_eq!(error.lines().count(), 1, "{error}");
    }
    std::fs::write(folder.join("track.csv"), "time_s,x_m,y_m\n0,5,0\n4,65,0\n9,140,0\n").unwrap();
    let scenario = Scenario::read(&source, &[]).unwrap();
    assert_eq!((scenario.leader.path.points.len(), &*scenario.leader.path.file), (3, ""));
    assert_eq!(scenario.leader_start().position.x, 5.0);
    assert_eq!(read_back(&scenario), scenario, "the log needs no other file");
    std::fs::remove_file(folder.join("track.csv")).unwrap();
    let gone = Scenario::read(&source, &[]).unwrap_err().to_string();
    assert!(gone.starts_with(&place) && gone.lines().count() == 1, "{gone}");
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn a_path_that_the_airframes_cannot_follow_is_blamed_on_what_was_set() {
    let error = read("[leader.path]\nkind = \"circle\"\nradius_m = 20.0\n", &[]).unwrap_err().to_string();
    assert!(
        error.starts_with("wind.toml:3: leader.path.radius_m: in a turn of 20 m at 15 m/s every UAV"),
        "{error}"
    );
    let text = "[leader.path]\nkind = \"circle\"\nradius_m = 150.0\n";
    let error = read(text, &["formation.frame=leader"]).unwrap_err().to_string();
    assert!(
        error.starts_with("--set formation.frame=leader: formation.frame: in a turn of 150 m"),
        "{error}"
    );
    assert!(error.ends_with("give a radius of at least 200 m"), "{error}");
}

#[test]
fn the_folder_of_a_program_counts_from_the_scenarios_file() {
    let program = |folder: &str| {
        let text = format!("[[agents]]\nuavs = 'all'\ncommand = ['./mine']\n{folder}");
        Scenario::read(&Source { name: "/flights/lead.toml".into(), text }, &[]).unwrap()
    };
    for (folder, placed) in
        [("", "/flights"), ("folder = 'laws/new'", "/flights/laws/new"), ("folder = '/laws'", "/laws")]
    {
        let scenario = program(folder);
        assert_eq!(scenario.agents[0].folder, placed);
        assert_eq!(read_back(&scenario), scenario, "the log means the same folder");
    }
    let here = std::env::current_dir().unwrap();
    let source = Source { name: "paper-4.1".into(), text: String::new() };
    let agent = AgentSection::parse("3=./mine").unwrap();
    let reading = Reading::read(&source, &[]).unwrap().with_agents(&[agent]).unwrap();
    assert_eq!(Path::new(&reading.scenario.agents[0].folder), here);
}
