mod formations;

use super::*;
use crate::{
    AgentSection, ManoeuvreSection, ObstacleSection, OffsetSection, PathKind, RequirementsSection, ShapeName,
    SlotOrder, StartState, read,
};
use ringwing_flight::{FormationFrame, OnLoss, UavId};

/// A valid scenario with an obstacle and a listed start for each UAV.
fn valid() -> Scenario {
    let mut scenario = read::example_scenario();
    let one = scenario.start.uavs[0];
    let beside = |x| StartState { position_m: [f64::from(x), 0.0], ..one };
    scenario.start.uavs = [0, 10, 20, 30, 40, 50].map(beside).into();
    scenario.formation.offsets.clear();
    scenario.manoeuvres.clear();
    scenario
}

/// The preferred message of each violation of a valid scenario after `change`.
fn messages(change: impl FnOnce(&mut Scenario)) -> Vec<String> {
    let mut scenario = valid();
    change(&mut scenario);
    let line = |violation: &Violation| {
        let blame = &violation.blames[0];
        format!("{}: {}", blame.key, blame.message)
    };
    violations(&scenario).iter().map(line).collect()
}

/// The keys in those messages.
fn blamed(change: impl FnOnce(&mut Scenario)) -> Vec<String> {
    messages(change).iter().filter_map(|line| Some(line.split_once(": ")?.0.to_owned())).collect()
}

#[test]
fn the_defaults_and_the_example_are_valid() {
    assert_eq!(violations(&Scenario::default()), []);
    assert_eq!(messages(|_| ()), [""; 0]);
}

/// Sets a quantity of a scenario.
type Change = fn(&mut Scenario, f64);

/// The key, how to set it, values that are just valid, and values that are not.
const BOUNDS: [(&str, Change, &[f64], &[f64]); 60] = [
    ("time.duration_s", |s, v| s.time.duration_s = v, &[0.01, 86_400.0], &[0.0, -1.0, 86_401.0]),
    ("time.rate_hz", |s, v| s.time.rate_hz = v as u32, &[2.0, 1000.0], &[0.0, 1001.0]),
    ("formation.uavs", |s, v| s.formation.uavs = v as u32, &[3.0, 1024.0], &[2.0, 1025.0]),
    ("formation.spacing_m", |s, v| s.formation.spacing_m = v, &[10.1, 1e7], &[0.0, -40.0]),
    ("formation.bearing_deg", |s, v| s.formation.bearing_deg = v, &[-360.0, 360.0], &[-361.0, 361.0]),
    ("formation.sweep_deg", |s, v| s.formation.sweep_deg = v, &[-90.0, 90.0], &[-91.0, 91.0]),
    ("formation.aspect", |s, v| s.formation.aspect = v, &[0.2, 5.0], &[0.19, 5.1]),
    ("formation.inner_ratio", |s, v| s.formation.inner_ratio = v, &[0.1, 1.0], &[0.09, 1.1]),
    ("formation.columns", |s, v| s.formation.columns = v as u32, &[0.0, 1024.0], &[1025.0]),
    ("control.formation_gain", |s, v| s.control.formation_gain = v, &[1e-9], &[0.0, -1.0]),
    ("control.slot_gain", |s, v| s.control.slot_gain = v, &[1e-9], &[0.0, -1.0]),
    ("sensors.position_rate_hz", |s, v| s.sensors.position_rate_hz = v, &[0.0, 100.0], &[-1.0]),
    ("sensors.position_noise_m", |s, v| s.sensors.position_noise_m = v, &[0.0, 1000.0], &[-0.1, 1001.0]),
    ("sensors.position_bias_time_s", |s, v| s.sensors.position_bias_time_s = v, &[0.1], &[0.0]),
    ("sensors.position_dropout", |s, v| s.sensors.position_dropout = v, &[0.0, 0.99], &[-0.1, 1.0]),
    ("sensors.heading_noise_deg", |s, v| s.sensors.heading_noise_deg = v, &[0.0, 180.0], &[-1.0, 181.0]),
    ("sensors.airspeed_bias_m_s", |s, v| s.sensors.airspeed_bias_m_s = v, &[0.0, 100.0], &[-1.0, 101.0]),
    ("control.obstacle_gain_m", |s, v| s.control.obstacle_gain_m = v, &[0.0], &[-1e-9]),
    ("control.heading_gain_rad_per_m", |s, v| s.control.heading_gain_rad_per_m = v, &[1e-9], &[0.0]),
    ("control.trust_time_s", |s, v| s.control.trust_time_s = v, &[1e-9, 3600.0], &[0.0, 3601.0]),
    ("control.gain_reach_spacings", |s, v| s.control.gain_reach_spacings = v, &[1e-9], &[0.0, -1.0]),
    ("membership.loss_timeout_s", |s, v| s.membership.loss_timeout_s = v, &[1e-9, 3600.0], &[0.0, 3601.0]),
    ("membership.slots_move_s", |s, v| s.membership.slots_move_s = v, &[0.0, 3600.0], &[-1.0, 3601.0]),
    ("leader.heading_deg", |s, v| s.leader.heading_deg = v, &[-360.0, 360.0], &[-361.0, 361.0]),
    ("airframe.speed_min_m_s", |s, v| s.airframe.speed_min_m_s = v, &[1e-9], &[0.0, -1.0]),
    ("airframe.turn_rate_max_rad_s", |s, v| s.airframe.turn_rate_max_rad_s = v, &[1e-9], &[0.0, -1.0]),
    ("airframe.collision_distance_m", |s, v| s.airframe.collision_distance_m = v, &[0.0], &[-1.0]),
    ("airframe.near_miss_distance_m", |s, v| s.airframe.near_miss_distance_m = v, &[0.0], &[-1.0]),
    ("georeference.latitude_deg", |s, v| s.georeference.latitude_deg = v, &[-85.0, 85.0], &[-85.1, 90.0]),
    (
        "georeference.longitude_deg",
        |s, v| s.georeference.longitude_deg = v,
        &[-180.0, 180.0],
        &[-180.1, 181.0],
    ),
    ("georeference.altitude_m", |s, v| s.georeference.altitude_m = v, &[-500.0, 1e5], &[-501.0, 1.1e5]),
    ("sensing.range_m", |s, v| s.sensing.range_m = v, &[10.0], &[9.9]),
    ("sensing.traffic_range_m", |s, v| s.sensing.traffic_range_m = v, &[1e-9], &[0.0, -1.0]),
    ("sensing.traffic_delay_s", |s, v| s.sensing.traffic_delay_s = v, &[0.0, 3600.0], &[-1.0, 3601.0]),
    ("sensing.traffic_loss", |s, v| s.sensing.traffic_loss = v, &[0.0, 1.0], &[-0.1, 1.1]),
    ("sensing.traffic_noise_m", |s, v| s.sensing.traffic_noise_m = v, &[0.0], &[-1.0]),
    ("sensing.traffic_noise_deg", |s, v| s.sensing.traffic_noise_deg = v, &[0.0, 180.0], &[-1.0, 181.0]),
    ("sensing.radar_range_m", |s, v| s.sensing.radar_range_m = v, &[1e-9], &[0.0, -1.0]),
    ("sensing.radar_noise_m", |s, v| s.sensing.radar_noise_m = v, &[0.0], &[-1.0]),
    ("sensing.radar_track_s", |s, v| s.sensing.radar_track_s = v, &[0.01, 3600.0], &[0.0, 3601.0]),
    ("obstacle_field.length_m", |s, v| s.obstacle_field.length_m = v, &[1e-9], &[0.0, -1.0]),
    ("obstacle_field.width_m", |s, v| s.obstacle_field.width_m = v, &[1e-9], &[0.0, -1.0]),
    ("obstacle_field.radius_min_m", |s, v| s.obstacle_field.radius_min_m = v, &[1e-9, 20.0], &[0.0, -1.0]),
    ("obstacle_field.radius_max_m", |s, v| s.obstacle_field.radius_max_m = v, &[5.0], &[4.9]),
    ("obstacle_field.braking_m", |s, v| s.obstacle_field.braking_m = v, &[1e-9, 150.0], &[0.0, -1.0]),
    ("intruders.0.speed_m_s", |s, v| s.intruders[0].speed_m_s = v, &[1e-9], &[0.0, -1.0]),
    ("intruders.0.heading_deg", |s, v| s.intruders[0].heading_deg = v, &[-360.0, 360.0], &[-361.0]),
    ("safety.separation_m", |s, v| s.safety.separation_m = v, &[2.1, 39.9], &[2.0, -1.0]),
    ("safety.clearance_m", |s, v| s.safety.clearance_m = v, &[0.0], &[-1.0]),
    ("safety.horizon_s", |s, v| s.safety.horizon_s = v, &[0.01, 60.0], &[0.0, 61.0]),
    ("safety.acting_interval_s", |s, v| s.safety.acting_interval_s = v, &[0.01, 60.0], &[0.0, 61.0]),
    ("safety.interval_s", |s, v| s.safety.interval_s = v, &[0.01, 60.0], &[0.0, 61.0]),
    ("safety.heading_step_deg", |s, v| s.safety.heading_step_deg = v, &[1.0, 90.0], &[0.9, 91.0]),
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

#[test]
fn every_quantity_is_checked_at_its_bounds() {
    for (key, set, valid, invalid) in BOUNDS {
        // The keys of the collision filter count only while it is on.
        let change = |s: &mut Scenario, value| {
            s.control.collision_filter = true;
            set(s, value);
        };
        for &value in valid {
            assert!(!blamed(|s| change(s, value)).contains(&key.into()), "{key} = {value}");
        }
        for &value in invalid {
            assert!(blamed(|s| change(s, value)).contains(&key.into()), "{key} = {value}");
        }
    }
}

#[test]
fn without_a_collision_filter_its_keys_do_not_matter() {
    assert_eq!(messages(|s| s.safety.separation_m = 50.0), [""; 0]);
}

#[test]
fn requirements_are_not_below_zero_and_a_share_is_at_most_1() {
    let keys = blamed(|s| {
        s.requirements.clearance_min_m = Some(-1.0);
        s.requirements.separation_min_m = Some(-1.0);
        s.requirements.intruder_distance_min_m = Some(-1.0);
        s.requirements.settling_max_s = Some(-1.0);
        s.requirements.slot_error_max_m = Some(-1.0);
        s.requirements.turn_rate_saturated_share_max = Some(1.1);
    });
    assert_eq!(keys.len(), 6);
    assert_eq!(messages(|s| s.requirements = RequirementsSection::default()), [""; 0]);
}

#[test]
fn the_airframes_can_fly_as_fast_as_the_leader() {
    assert_eq!(
        messages(|s| s.leader.speed_m_s = 11.5),
        ["leader.speed_m_s: 11.5 m/s is below airframe.speed_min_m_s 12 m/s: give a larger value"]
    );
    assert_eq!(
        messages(|s| s.airframe.speed_max_m_s = 14.0)[0],
        "airframe.speed_max_m_s: 14 m/s is below leader.speed_m_s 15 m/s: give a larger value"
    );
    assert_eq!(blamed(|s| s.airframe.speed_max_m_s = 15.0), [""; 0]);
    assert_eq!(blamed(|s| s.airframe.speed_min_m_s = 15.0), [""; 0]);
    assert!(blamed(|s| s.airframe.speed_max_m_s = 12.0).contains(&"airframe.speed_max_m_s".into()));
}

#[test]
fn a_flight_and_a_command_last_at_least_a_tick() {
    assert_eq!(
        messages(|s| s.time.duration_s = 0.004),
        [
            "time.duration_s: 0.004 s is less than one tick at 100 Hz: give a longer duration_s or a larger rate_hz"
        ]
    );
    assert_eq!(
        messages(|s| s.airframe.command_timeout_s = 0.009),
        [
            "airframe.command_timeout_s: 0.009 s is shorter than 1 tick at time.rate_hz 100 Hz: give a longer time"
        ]
    );
    assert_eq!(messages(|s| s.airframe.command_timeout_s = 0.01), [""; 0]);
}

#[test]
fn a_loss_takes_at_least_four_ticks_where_the_ring_closes() {
    assert_eq!(
        messages(|s| (s.control.ring_closes, s.membership.loss_timeout_s) = (true, 0.03)),
        [
            "membership.loss_timeout_s: 0.03 s is shorter than 4 ticks at time.rate_hz 100 Hz: give a longer time"
        ]
    );
    assert_eq!(messages(|s| s.membership.loss_timeout_s = 0.03), [""; 0]);
}

#[test]
fn slots_are_farther_apart_than_the_collision_distance() {
    assert_eq!(
        messages(|s| s.formation.spacing_m = 2.0),
        ["formation.spacing_m: 2 m is not above airframe.collision_distance_m 2 m: give a larger value"]
    );
}

#[test]
fn an_obstacle_has_a_size_and_a_name_and_is_sensed_in_time() {
    assert_eq!(
        messages(|s| s.obstacles[0].braking_distance_m = 10.0),
        ["obstacles.0.braking_distance_m: 10 m is not above radius_m 10 m: give a larger value"]
    );
    assert_eq!(blamed(|s| s.obstacles[0].radius_m = 0.0), ["obstacles.0.radius_m"]);
    assert_eq!(
        messages(|s| s.obstacles[0].braking_distance_m = 161.0),
        [
            "sensing.range_m: 150 m is less than 151 m, the distance from its edge at which \"Obstacle 1\" begins to repel: give a larger range"
        ]
    );
    assert_eq!(blamed(|s| s.obstacles[0].braking_distance_m = 160.0), [""; 0]);
    for name in ["", "  ", "Türme", "a\nb", &"x".repeat(41)] {
        assert_eq!(blamed(|s| s.obstacles[0].name = name.into()), ["obstacles.0.name"], "{name}");
    }
    assert_eq!(
        messages(|s| s.obstacles.push(s.obstacles[0].clone())),
        ["obstacles.1.name: \"Obstacle 1\" is also the name of obstacles.0: give each obstacle its own name"]
    );
    let many = |s: &mut Scenario, count: usize| {
        s.obstacle_field.circles = 0;
        s.obstacles =
            (0..count).map(|i| ObstacleSection { name: i.to_string(), ..s.obstacles[0].clone() }).collect();
    };
    assert_eq!(blamed(|s| many(s, 1000)), [""; 0]);
    assert_eq!(messages(|s| many(s, 1001)), ["obstacles: 1001 obstacles are more than 1000: remove some"]);
}

#[test]
fn drawn_obstacles_count_and_have_names_of_their_own() {
    assert_eq!(
        messages(|s| s.obstacle_field.circles = u32::MAX),
        ["obstacles: 4294967296 obstacles are more than 1000: remove some"]
    );
    assert_eq!(
        messages(|s| s.obstacles[0].name = "Circle 3".into()),
        ["obstacles.0.name: \"Circle 3\" is also the name of a circle of obstacle_field: give another name"]
    );
    assert_eq!(messages(|s| s.obstacles[0].name = "Circle 4".into()), [""; 0], "the field has three");
    let onto_the_starts = |s: &mut Scenario| {
        (s.obstacle_field.ahead_m, s.obstacle_field.length_m, s.obstacle_field.width_m) = (0.0, 1e-3, 1e-3);
    };
    assert_eq!(
        messages(onto_the_starts)[0],
        "start.uavs.0.position_m: UAV 1 starts inside \"Circle 1\": move one of them"
    );
    let without = |s: &mut Scenario| (s.obstacle_field.circles, s.obstacle_field.width_m) = (0, -1.0);
    assert_eq!(messages(without), [""; 0], "without circles the other keys do not matter");
}

#[test]
fn waypoints_need_a_speed() {
    assert_eq!(
        messages(|s| s.obstacles[0].waypoint_speed_m_s = 0.0),
        ["obstacles.0.waypoint_speed_m_s: 0 m/s is not above 0: give a larger value"]
    );
    let still = |s: &mut Scenario| s.obstacles[0].waypoints_m.clear();
    assert_eq!(messages(|s| (still(s), s.obstacles[0].waypoint_speed_m_s = 0.0).1), [""; 0]);
    assert_eq!(
        blamed(|s| (still(s), s.obstacles[0].waypoint_speed_m_s = -1.0).1),
        ["obstacles.0.waypoint_speed_m_s"]
    );
    assert_eq!(
        messages(|s| s.obstacles[0].waypoints_m = vec![[0.0; 2]; 1001]),
        ["obstacles.0.waypoints_m: 1001 waypoints are more than 1000: remove some"]
    );
}

#[test]
fn an_intruder_flies_and_starts_away_from_every_uav() {
    let straight = |s: &mut Scenario| s.intruders[0].waypoints_m.clear();
    let message = "intruders.0.speed_m_s: 0 m/s is not above 0: give a larger value";
    assert_eq!(messages(|s| s.intruders[0].speed_m_s = 0.0), [message]);
    assert_eq!(messages(|s| (straight(s), s.intruders[0].speed_m_s = 0.0).1), [message]);
    assert_eq!(
        messages(|s| s.intruders[0].position_m = [30.0, 1.0]),
        [
            "intruders.0.position_m: UAV 4 starts 1.00 m from intruder 1, within airframe.collision_distance_m 2 m: move one of them away"
        ]
    );
    assert_eq!(
        messages(|s| s.intruders = vec![s.intruders[0].clone(); 101]),
        ["intruders: 101 intruders are more than 100: remove some"]
    );
}

#[test]
fn every_uav_or_none_has_a_listed_start() {
    assert_eq!(
        messages(|s| s.start.uavs.truncate(5)),
        ["start.uavs: 5 starts are listed, but formation.uavs is 6: list 6 starts, or none to draw them"]
    );
    assert_eq!(messages(|s| s.start.uavs.clear()), [""; 0]);
}

#[test]
fn no_uav_starts_too_slowly_in_collision_or_inside_an_obstacle() {
    assert_eq!(
        messages(|s| s.start.uavs[1].speed_m_s = 11.0),
        ["start.uavs.1.speed_m_s: 11 m/s is below airframe.speed_min_m_s 12 m/s: give a larger value"]
    );
    assert_eq!(blamed(|s| s.start.uavs[1].speed_m_s = 26.0), ["airframe.speed_max_m_s"]);
    assert_eq!(
        messages(|s| s.start.uavs[2].position_m = [11.0, 1.0]),
        [
            "start.uavs.2.position_m: UAV 3 starts 1.41 m from UAV 2, within airframe.collision_distance_m 2 m: move one of them away"
        ]
    );
    assert_eq!(
        messages(|s| s.start.uavs[2].position_m = [895.0, 42.0]),
        ["start.uavs.2.position_m: UAV 3 starts inside \"Obstacle 1\": move one of them"]
    );
}

#[test]
fn a_name_is_safe_for_a_folder() {
    for name in ["a", "paper-4.2", "A_1", &"x".repeat(60)] {
        assert_eq!(blamed(|s| s.name = name.into()), [""; 0], "{name}");
    }
    for name in ["", ".", "..", ".a", "a/b", "a b", "ä", &"x".repeat(61)] {
        assert_eq!(blamed(|s| s.name = name.into()), ["name"], "{name}");
    }
    assert_eq!(blamed(|s| s.description = "two\nlines".into()), ["description"]);
}

#[test]
fn a_fault_must_be_possible_and_not_before_the_flight() {
    let with = |s: &mut Scenario, at_s: f64, action: &str| {
        s.faults = vec![crate::Fault { at_s, action: action.parse().unwrap() }];
    };
    assert_eq!(messages(|s| with(s, 1e6, "kill uav 6")), [""; 0], "a fault after the end never happens");
    assert_eq!(messages(|s| with(s, -1.0, "kill uav 6")), ["faults.0.at_s: -1 s is below 0: give 0 or more"]);
    assert_eq!(
        messages(|s| with(s, 1.0, "kill uav 7")),
        ["faults.0.do: there is no uav 7: this run has UAVs 1 to 6"]
    );
}

#[test]
fn fewer_than_three_uavs_fly_for_benchmarks_alone() {
    let two = |s: &mut Scenario, few_uavs| {
        (s.formation.uavs, s.ipc.few_uavs) = (2, few_uavs);
        s.start.uavs.clear();
        s.faults.clear();
        s.agents.clear();
    };
    assert_eq!(blamed(|s| two(s, false)), ["formation.uavs"]);
    assert_eq!(blamed(|s| two(s, true)), [""; 0]);
}

#[test]
fn programs_fly_uavs_that_exist_and_have_a_name() {
    let agent = |uavs: &str, command: &[&str]| {
        let command = command.iter().map(ToString::to_string).collect();
        let section = AgentSection { uavs: uavs.into(), command, folder: String::new() };
        messages(|scenario| scenario.agents = vec![section])
    };
    for uavs in ["all", "6", " 1, 2 ,3"] {
        assert_eq!(agent(uavs, &["./mine"]), [""; 0], "{uavs}");
    }
    let remedy = "write \"all\", or numbers such as \"3\" or \"1, 4\"";
    for uavs in ["", "some", "3,", "-1", "2.5"] {
        assert_eq!(agent(uavs, &["./mine"]), [format!("agents.0.uavs: {uavs:?} names no UAVs: {remedy}")]);
    }
    for uav in [0, 7] {
        let message = format!("agents.0.uavs: there is no UAV {uav}: this swarm has UAVs 1 to 6");
        assert_eq!(agent(&format!("2, {uav}"), &["./mine"]), [message]);
    }
    for command in [&[][..], &[""]] {
        assert!(agent("3", command)[0].starts_with("agents.0.command: there is no program"));
    }
    assert!(agent("3", &["./mine", "a\0b"])[0].contains("a zero byte"));
}

#[test]
fn of_two_programs_for_a_uav_the_later_one_counts() {
    let mut scenario = valid();
    scenario.agents = ["all=./one", "2, 3=./other"].map(|text| AgentSection::parse(text).unwrap()).into();
    let program = |uav| scenario.agent_of(UavId(uav)).unwrap().command[0].clone();
    assert_eq!([1, 2, 3, 4].map(program), ["./one", "./other", "./other", "./one"]);
}
