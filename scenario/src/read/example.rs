//! The example: a scenario in which every key has a value. It tells which keys exist and which type each has.

use crate::{
    AgentSection, Fault, FormationSection, IntruderSection, LeaderSection, ManoeuvreSection,
    ObstacleFieldSection, ObstacleSection, OffsetSection, PathSection, RequirementsSection, Scenario,
    ShapeName, SlotOrder, StartSection, StartState, WaypointSection, key,
};
use ringwing_flight::TrackPoint;
use std::sync::LazyLock;
use toml::{
    Spanned,
    de::{DeTable, DeValue},
};

static TEXT: LazyLock<String> = LazyLock::new(|| scenario().to_toml());

static TREE: LazyLock<DeValue<'static>> = LazyLock::new(|| {
    let table = DeTable::parse(&TEXT).expect("`to_toml` writes TOML");
    DeValue::Table(table.into_inner())
});

/// Keys of lists of sections that may be left out; see [`is_optional`].
const OPTIONAL: [&str; 16] = [
    "obstacles.velocity_m_s",
    "obstacles.waypoints_m",
    "obstacles.waypoint_speed_m_s",
    "obstacles.repeat",
    "intruders.turn_rate_rad_s",
    "intruders.waypoints_m",
    "intruders.repeat",
    "manoeuvres.shape",
    "manoeuvres.spacing_m",
    "manoeuvres.bearing_deg",
    "manoeuvres.sweep_deg",
    "manoeuvres.aspect",
    "manoeuvres.inner_ratio",
    "manoeuvres.columns",
    "manoeuvres.order",
    "agents.folder",
];

/// The example itself: every key has a value, and every list of sections an item.
///
/// # Panics
/// Never: the sentence of its fault is right.
pub fn scenario() -> Scenario {
    Scenario {
        description: "two rings, one sky".into(),
        formation: FormationSection {
            offsets: vec![OffsetSection { ahead_m: -20.0, left_m: 35.0 }],
            ..FormationSection::default()
        },
        requirements: RequirementsSection {
            collisions_max: Some(0),
            clearance_min_m: Some(2.0),
            separation_min_m: Some(10.0),
            intruder_distance_min_m: Some(10.0),
            settling_max_s: Some(20.0),
            recovery_max_s: Some(20.0),
            slot_error_max_m: Some(0.05),
            keeping_error_rms_max_m: Some(2.0),
            faults_act: true,
            turn_rate_saturated_share_max: Some(0.5),
            ..RequirementsSection::default()
        },
        start: StartSection {
            uavs: vec![StartState { position_m: [-60.0, 20.0], heading_deg: 0.0, speed_m_s: 15.0 }],
            ..StartSection::default()
        },
        obstacle_field: ObstacleFieldSection {
            circles: 3,
            braking_m: 10.0,
            ..ObstacleFieldSection::default()
        },
        obstacles: vec![obstacle()],
        intruders: vec![intruder()],
        agents: vec![agents()],
        leader: LeaderSection {
            path: PathSection {
                waypoints: vec![WaypointSection { position_m: [600.0, 0.0] }],
                points: vec![TrackPoint { time_s: 0.0, position_m: [0.0, 0.0] }],
                ..PathSection::default()
            },
            ..LeaderSection::default()
        },
        manoeuvres: vec![manoeuvre()],
        faults: vec!["at 30 s kill uav 3".parse::<Fault>().expect("the example of a fault parses")],
        ..Scenario::default()
    }
}

fn obstacle() -> ObstacleSection {
    ObstacleSection {
        name: "Obstacle 1".into(),
        position_m: [900.0, 42.0],
        radius_m: 10.0,
        braking_distance_m: 20.0,
        velocity_m_s: [-2.0, 0.5],
        waypoints_m: vec![[860.0, 60.0], [820.0, 20.0]],
        waypoint_speed_m_s: 3.0,
        repeat: true,
    }
}

fn intruder() -> IntruderSection {
    IntruderSection {
        position_m: [400.0, -300.0],
        heading_deg: 90.0,
        speed_m_s: 20.0,
        cooperative: true,
        turn_rate_rad_s: 0.1,
        waypoints_m: vec![[400.0, 0.0], [600.0, 100.0]],
        repeat: true,
    }
}

fn agents() -> AgentSection {
    AgentSection {
        uavs: "3".into(),
        command: vec!["python3".into(), "mine.py".into()],
        folder: "controllers".into(),
    }
}

fn manoeuvre() -> ManoeuvreSection {
    ManoeuvreSection {
        at_s: 30.0,
        over_s: 12.0,
        shape: Some(ShapeName::Vee),
        spacing_m: Some(30.0),
        bearing_deg: Some(180.0),
        sweep_deg: Some(30.0),
        aspect: Some(1.5),
        inner_ratio: Some(0.45),
        columns: Some(0),
        order: SlotOrder::Nearest,
    }
}

/// The example as a tree.
pub(super) fn tree() -> &'static DeValue<'static> {
    &TREE
}

/// The example's value of `key`. The first item of a list of sections or of positions stands for every index.
pub(super) fn at(key: &str) -> Option<&'static DeValue<'static>> {
    key.split('.').try_fold(tree(), |value, part| match value {
        DeValue::Table(table) => table.get(part).map(Spanned::get_ref),
        DeValue::Array(list) => {
            let index: usize = part.parse().ok()?;
            let has_any_length = is_section_list(value) || is_position_list(value) || is_text_list(value);
            list.get(if has_any_length { 0 } else { index }).map(Spanned::get_ref)
        }
        _ => None,
    })
}

/// Every key outside lists of sections, as `--set` takes it: `airframe.speed_max_m_s`.
pub fn keys() -> Vec<String> {
    let mut keys = Vec::new();
    collect_keys(tree(), "", &mut keys);
    keys
}

fn collect_keys(value: &DeValue<'_>, key: &str, keys: &mut Vec<String>) {
    match value {
        DeValue::Table(table) => {
            for (name, value) in table {
                collect_keys(value.get_ref(), &key::join(key, name.get_ref()), keys);
            }
        }
        // The keys of such a list contain an index, so no shorter form can stand for them.
        list if is_section_list(list) => {}
        _ => keys.push(key.to_owned()),
    }
}

/// Whether `value` is a list of sections, such as the obstacles.
pub(super) fn is_section_list(value: &DeValue<'_>) -> bool {
    value.as_array().is_some_and(|list| list.first().is_some_and(|first| first.get_ref().is_table()))
}

/// Whether `value` is a list of positions, such as waypoints.
pub(super) fn is_position_list(value: &DeValue<'_>) -> bool {
    value.as_array().is_some_and(|list| list.first().is_some_and(|first| first.get_ref().is_array()))
}

/// Whether `value` is a list of texts, such as a command.
pub(super) fn is_text_list(value: &DeValue<'_>) -> bool {
    value.as_array().is_some_and(|list| list.first().is_some_and(|first| first.get_ref().is_str()))
}

/// Whether the section of a list may leave out `key`, as `obstacles.3.repeat`.
pub(super) fn is_optional(key: &str) -> bool {
    let names: Vec<&str> = key.split('.').filter(|part| part.parse::<usize>().is_err()).collect();
    OPTIONAL.contains(&&*names.join("."))
}

/// What to write for `key`, whose value in the example is `wanted`.
pub(super) fn remedy(key: &str, wanted: &DeValue<'_>) -> String {
    let of_unit = key::unit(key).map_or(String::new(), |unit| format!(" of {}", unit.plural));
    match wanted {
        DeValue::Float(value) => {
            let bare = if of_unit.is_empty() { "" } else { " without a unit" };
            format!("give a number{of_unit}{bare}, such as {}", value.as_str())
        }
        DeValue::Integer(value) => format!("give a whole number{of_unit}, such as {value}"),
        DeValue::String(text) => format!("give text in quotes, such as \"{text}\""),
        DeValue::Boolean(_) => "give true or false, without quotes".into(),
        DeValue::Array(_) if is_section_list(wanted) => format!("give one [[{key}]] section for each, or []"),
        DeValue::Array(_) if is_position_list(wanted) => {
            format!("give positions{of_unit}, such as [[900.0, 42.0], [950.0, 0.0]]")
        }
        DeValue::Array(_) if is_text_list(wanted) => {
            "give texts in quotes, such as [\"python3\", \"mine.py\"]".into()
        }
        // The only other lists of a scenario are positions and velocities.
        DeValue::Array(_) => format!("give two numbers{of_unit}, such as [900.0, 42.0]"),
        DeValue::Table(_) | DeValue::Datetime(_) => "give a section with its keys".into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_leads_to_its_value() {
        assert_eq!(at("time.rate_hz").unwrap().as_integer().unwrap().as_str(), "100");
        assert!(at("obstacles.7.radius_m").unwrap().is_float());
        assert!(at("start.uavs.0.position_m.1").unwrap().is_float());
        assert!(at("leader.start_m.2").is_none() && at("time.rate").is_none() && at("").is_none());
    }

    #[test]
    fn keys_outside_lists_of_sections_are_listed() {
        let keys = keys();
        for key in ["name", "leader.start_m", "start.draw.separation_m", "requirements.settling_max_s"] {
            assert!(keys.contains(&key.to_owned()), "{key}");
        }
        assert!(keys.iter().all(|key| at(key).is_some() && !key.starts_with("obstacles")));
    }
}
