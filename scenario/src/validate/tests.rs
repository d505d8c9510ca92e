use super::*;
use crate::{Requirements, example};

/// A scenario with an obstacle and as many starts as it has UAVs.
fn sound() -> Scenario {
    let mut scenario = example::scenario();
    let one = scenario.start.uavs[0];
    let beside = |x| StartState { position_m: [f64::from(x), 0.0], ..one };
    scenario.start.uavs = [0, 10, 20, 30, 40, 50].map(beside).into();
    scenario
}

/// What is said of a sound scenario after `change`, as the author of the first key of each flaw is told it.
fn said(change: impl FnOnce(&mut Scenario)) -> Vec<String> {
    let mut scenario = sound();
    change(&mut scenario);
    flaws(&scenario).iter().map(|flaw| format!("{}: {}", flaw.views[0].key, flaw.views[0].message)).collect()
}

/// The keys blamed after `change`.
fn blamed(change: impl FnOnce(&mut Scenario)) -> Vec<String> {
    said(change).iter().filter_map(|line| Some(line.split_once(": ")?.0.to_owned())).collect()
}

#[test]
fn the_defaults_and_the_example_are_sound() {
    assert_eq!(flaws(&Scenario::default()), []);
    assert_eq!(said(|_| ()), [""; 0]);
}

#[test]
fn every_bound_of_a_single_quantity_is_kept() {
    type Change = fn(&mut Scenario, f64);
    // The key, how to change it, what is just possible, and what is not.
    let bounds: [(&str, Change, &[f64], &[f64]); 28] = [
        ("time.duration_s", |s, v| s.time.duration_s = v, &[0.01, 86_400.0], &[0.0, -1.0, 86_401.0]),
        ("time.rate_hz", |s, v| s.time.rate_hz = v as u32, &[2.0, 1000.0], &[0.0, 1001.0]),
        ("formation.uavs", |s, v| s.formation.uavs = v as u32, &[3.0, 1024.0], &[2.0, 1025.0]),
        ("formation.spacing_m", |s, v| s.formation.spacing_m = v, &[2.1, 1e7], &[0.0, -40.0]),
        ("formation.bearing_deg", |s, v| s.formation.bearing_deg = v, &[-360.0, 360.0], &[-361.0, 361.0]),
        ("control.formation_gain", |s, v| s.control.formation_gain = v, &[1e-9], &[0.0, -1.0]),
        ("control.slot_gain", |s, v| s.control.slot_gain = v, &[1e-9], &[0.0, -1.0]),
        ("control.obstacle_gain_m", |s, v| s.control.obstacle_gain_m = v, &[0.0], &[-1e-9]),
        ("control.heading_gain_rad_per_m", |s, v| s.control.heading_gain_rad_per_m = v, &[1e-9], &[0.0]),
        ("control.trust_time_s", |s, v| s.control.trust_time_s = v, &[1e-9, 3600.0], &[0.0, 3601.0]),
        ("control.gain_reach_spacings", |s, v| s.control.gain_reach_spacings = v, &[1e-9], &[0.0, -1.0]),
        (
            "membership.loss_timeout_s",
            |s, v| s.membership.loss_timeout_s = v,
            &[1e-9, 3600.0],
            &[0.0, 3601.0],
        ),
        ("membership.slots_move_s", |s, v| s.membership.slots_move_s = v, &[0.0, 3600.0], &[-1.0, 3601.0]),
        ("leader.heading_deg", |s, v| s.leader.heading_deg = v, &[-360.0, 360.0], &[-361.0, 361.0]),
        ("airframe.speed_min_m_s", |s, v| s.airframe.speed_min_m_s = v, &[1e-9], &[0.0, -1.0]),
        ("airframe.turn_rate_max_rad_s", |s, v| s.airframe.turn_rate_max_rad_s = v, &[1e-9], &[0.0, -1.0]),
        ("airframe.collision_distance_m", |s, v| s.airframe.collision_distance_m = v, &[0.0], &[-1.0]),
        ("georeference.latitude_deg", |s, v| s.georeference.latitude_deg = v, &[-85.0, 85.0], &[-85.1, 90.0]),
        (
            "georeference.longitude_deg",
            |s, v| s.georeference.longitude_deg = v,
            &[-180.0, 180.0],
            &[-180.1, 181.0],
        ),
        ("georeference.altitude_m", |s, v| s.georeference.altitude_m = v, &[-500.0, 1e5], &[-501.0, 1.1e5]),
        ("sensing.range_m", |s, v| s.sensing.range_m = v, &[10.0], &[9.9]),
        ("supervision.start_timeout_s", |s, v| s.supervision.start_timeout_s = v, &[3600.0], &[0.0, 3601.0]),
        ("supervision.answer_timeout_s", |s, v| s.supervision.answer_timeout_s = v, &[1e-3], &[-1.0, 3601.0]),
        ("start.draw.length_radii", |s, v| s.start.draw.length_radii = v, &[1e-9], &[0.0, -1.0]),
        ("start.draw.width_radii", |s, v| s.start.draw.width_radii = v, &[1e-9], &[0.0, -1.0]),
        ("start.draw.separation_m", |s, v| s.start.draw.separation_m = v, &[0.0], &[-1.0]),
        (
            "start.draw.heading_spread_deg",
            |s, v| s.start.draw.heading_spread_deg = v,
            &[0.0, 180.0],
            &[-1.0, 181.0],
        ),
        ("start.uavs.2.heading_deg", |s, v| s.start.uavs[2].heading_deg = v, &[-360.0, 360.0], &[-361.0]),
    ];
    for (key, change, possible, impossible) in bounds {
        for &value in possible {
            assert!(!blamed(|s| change(s, value)).contains(&key.into()), "{key} = {value}");
        }
        for &value in impossible {
            assert!(blamed(|s| change(s, value)).contains(&key.into()), "{key} = {value}");
        }
    }
}

#[test]
fn requirements_are_not_below_zero() {
    let flaws = blamed(|s| {
        s.requirements.clearance_min_m = Some(-1.0);
        s.requirements.separation_min_m = Some(-1.0);
        s.requirements.settling_max_s = Some(-1.0);
        s.requirements.slot_error_max_m = Some(-1.0);
    });
    assert_eq!(flaws.len(), 4);
    assert_eq!(said(|s| s.requirements = Requirements::default()), [""; 0]);
}

#[test]
fn the_leader_flies_as_fast_as_the_airframes_can() {
    assert_eq!(
        said(|s| s.leader.speed_m_s = 11.5),
        ["leader.speed_m_s: 11.5 m/s is below airframe.speed_min_m_s 12 m/s: give a larger one"]
    );
    assert_eq!(
        said(|s| s.airframe.speed_max_m_s = 14.0)[0],
        "airframe.speed_max_m_s: 14 m/s is below leader.speed_m_s 15 m/s: give a larger one"
    );
    assert_eq!(blamed(|s| s.airframe.speed_max_m_s = 15.0), [""; 0]);
    assert_eq!(blamed(|s| s.airframe.speed_min_m_s = 15.0), [""; 0]);
    assert!(blamed(|s| s.airframe.speed_max_m_s = 12.0).contains(&"airframe.speed_max_m_s".into()));
}

#[test]
fn a_flight_has_a_tick_and_a_command_lasts_one() {
    assert_eq!(
        said(|s| s.time.duration_s = 0.004),
        [
            "time.duration_s: 0.004 s is less than one tick at 100 Hz: give a longer duration_s or a larger rate_hz"
        ]
    );
    assert_eq!(
        said(|s| s.airframe.command_timeout_s = 0.009),
        [
            "airframe.command_timeout_s: 0.009 s is shorter than one tick at time.rate_hz 100 Hz: give a longer one"
        ]
    );
    assert_eq!(said(|s| s.airframe.command_timeout_s = 0.01), [""; 0]);
}

#[test]
fn a_loss_takes_more_than_a_few_ticks_where_the_ring_closes() {
    assert_eq!(
        said(|s| (s.control.ring_closes, s.membership.loss_timeout_s) = (true, 0.03)),
        [
            "membership.loss_timeout_s: 0.03 s is shorter than 4 ticks at time.rate_hz 100 Hz: give a longer one"
        ]
    );
    assert_eq!(said(|s| s.membership.loss_timeout_s = 0.03), [""; 0]);
}

#[test]
fn slots_are_not_in_collision() {
    assert_eq!(
        said(|s| s.formation.spacing_m = 2.0),
        ["formation.spacing_m: 2 m is not above airframe.collision_distance_m 2 m: give a larger one"]
    );
}

#[test]
fn an_obstacle_has_a_size_and_a_name_and_is_sensed_in_time() {
    assert_eq!(
        said(|s| s.obstacles[0].braking_distance_m = 10.0),
        ["obstacles.0.braking_distance_m: 10 m is not above radius_m 10 m: give a larger one"]
    );
    assert_eq!(blamed(|s| s.obstacles[0].radius_m = 0.0), ["obstacles.0.radius_m"]);
    assert_eq!(
        said(|s| s.obstacles[0].braking_distance_m = 161.0),
        [
            "sensing.range_m: 150 m is less than the 151 m from its edge at which \"Obstacle 1\" repels: give a larger one"
        ]
    );
    assert_eq!(blamed(|s| s.obstacles[0].braking_distance_m = 160.0), [""; 0]);
    for name in ["", "  ", "Türme", "a\nb", &"x".repeat(41)] {
        assert_eq!(blamed(|s| s.obstacles[0].name = name.into()), ["obstacles.0.name"], "{name}");
    }
    assert_eq!(
        said(|s| s.obstacles.push(s.obstacles[0].clone())),
        ["obstacles.1.name: \"Obstacle 1\" is also the name of obstacles.0: give each its own"]
    );
    let many = |s: &mut Scenario, count: usize| {
        s.obstacles =
            (0..count).map(|i| Obstacle { name: i.to_string(), ..s.obstacles[0].clone() }).collect();
    };
    assert_eq!(blamed(|s| many(s, 1000)), [""; 0]);
    assert_eq!(said(|s| many(s, 1001)), ["obstacles: 1001 obstacles are more than 1000: leave some out"]);
}

#[test]
fn as_many_starts_are_listed_as_there_are_uavs() {
    assert_eq!(
        said(|s| s.start.uavs.truncate(5)),
        ["start.uavs: 5 starts are listed, but formation.uavs is 6: list 6, or none to have them drawn"]
    );
    assert_eq!(said(|s| s.start.uavs.clear()), [""; 0]);
}

#[test]
fn nobody_begins_too_slowly_in_collision_or_inside_an_obstacle() {
    assert_eq!(
        said(|s| s.start.uavs[1].speed_m_s = 11.0),
        ["start.uavs.1.speed_m_s: 11 m/s is below airframe.speed_min_m_s 12 m/s: give a larger one"]
    );
    assert_eq!(blamed(|s| s.start.uavs[1].speed_m_s = 26.0), ["airframe.speed_max_m_s"]);
    assert_eq!(
        said(|s| s.start.uavs[2].position_m = [11.0, 1.0]),
        [
            "start.uavs.2.position_m: UAV 3 begins 1.41 m from UAV 2, within airframe.collision_distance_m 2 m: move it away"
        ]
    );
    assert_eq!(
        said(|s| s.start.uavs[2].position_m = [895.0, 42.0]),
        ["start.uavs.2.position_m: UAV 3 begins inside \"Obstacle 1\": move it out"]
    );
}

#[test]
fn a_name_can_be_a_folders() {
    for name in ["a", "paper-4.2", "A_1", &"x".repeat(60)] {
        assert_eq!(blamed(|s| s.name = name.into()), [""; 0], "{name}");
    }
    for name in ["", ".", "..", ".a", "a/b", "a b", "ä", &"x".repeat(61)] {
        assert_eq!(blamed(|s| s.name = name.into()), ["name"], "{name}");
    }
    assert_eq!(blamed(|s| s.description = "two\nlines".into()), ["description"]);
}
