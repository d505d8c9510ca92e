use super::*;
use crate::{
    schema::{Faults, SwarmMetrics, SwarmState, Timing, TimingPercentiles, UavControl, UavState, topics},
    testing,
};
use foxglove::{
    Encode,
    prost_types::{DescriptorProto, FileDescriptorSet},
};
use prost::Message;
use serde_json::Value;

fn rendered(uavs: u32, obstacles: u32, timing: bool) -> Value {
    let mut scenario = testing::ring_of(uavs, 40.0);
    let obstacle = |number: u32| testing::obstacle([f64::from(number) * 300.0, 0.0]);
    scenario.obstacles = (0..obstacles).map(obstacle).collect();
    serde_json::from_str(&render(&scenario, timing)).unwrap()
}

/// Every text in `value` that viewers take for a topic or a path to its field.
fn paths(value: &Value) -> Vec<String> {
    match value {
        Value::Object(members) => members
            .iter()
            .flat_map(|(name, value)| match value {
                Value::String(text) if text.starts_with('/') => vec![text.clone()],
                _ if name.starts_with('/') => vec![name.clone()],
                _ => paths(value),
            })
            .collect(),
        Value::Array(values) => values.iter().flat_map(paths).collect(),
        _ => Vec::new(),
    }
}

fn fields<T: Encode>() -> Vec<String> {
    let schema = T::get_schema().unwrap();
    let files = FileDescriptorSet::decode(&*schema.data).unwrap();
    let name = schema.name.rsplit('.').next().unwrap();
    let is_it = |message: &&DescriptorProto| message.name.as_deref() == Some(name);
    let message = files.file.iter().flat_map(|file| &file.message_type).find(is_it).unwrap();
    message.field.iter().map(|field| field.name.clone().unwrap()).collect()
}

fn fields_of(topic: &str) -> Vec<String> {
    match topic {
        topics::FAULTS => fields::<Faults>(),
        topics::SWARM_METRICS => fields::<SwarmMetrics>(),
        topics::SWARM_STATE => fields::<SwarmState>(),
        topics::TIMING => fields::<Timing>(),
        topics::TIMING_PERCENTILES => fields::<TimingPercentiles>(),
        uav if UavTopic::parse(uav) == Some(UavTopic::State) => fields::<UavState>(),
        uav if UavTopic::parse(uav) == Some(UavTopic::Control) => fields::<UavControl>(),
        _ => Vec::new(),
    }
}

fn recorded_topics(uavs: u32) -> Vec<String> {
    let scenario = testing::ring_of(uavs, 40.0);
    let (_folder, path) = testing::place();
    let opening = crate::log::Opening { timing: true, ..testing::opening(&scenario) };
    crate::log::LogWriter::create(&path, &opening)
        .unwrap()
        .finish(std::collections::BTreeMap::default())
        .unwrap();
    let summary = mcap::Summary::read(&std::fs::read(&path).unwrap()).unwrap().unwrap();
    summary.channels.values().map(|channel| channel.topic.clone()).collect()
}

#[test]
fn every_path_names_a_field_of_a_recorded_topic() {
    for uavs in [3, 6, 33, 1024] {
        let known = recorded_topics(uavs);
        for path in paths(&rendered(uavs, 3, true)) {
            let (topic, field) = path.split_once('.').unwrap_or((&path, ""));
            assert!(known.contains(&topic.to_owned()), "{path}");
            assert!(field.is_empty() || fields_of(topic).contains(&field.to_owned()), "{path}");
        }
    }
}

#[test]
fn the_layout_shows_only_what_is_recorded() {
    let titles = |layout: &Value| -> Vec<String> {
        let root = layout["configById"][layout["layout"].as_str().unwrap()].clone();
        root["tabs"].as_array().unwrap().iter().map(|tab| tab["title"].as_str().unwrap().to_owned()).collect()
    };
    let all = titles(&rendered(6, 2, true));
    assert_eq!(all, ["Flight", "Obstacles", "Faults and ages", "Timing", "Table", "Map"]);
    let bare = rendered(6, 0, false);
    assert_eq!(titles(&bare), ["Flight", "Faults and ages", "Table", "Map"]);
    assert!(!paths(&bare).iter().any(|path| path.starts_with(topics::TIMING)));
}

#[test]
fn a_large_swarm_is_shown_by_a_selection_of_uavs() {
    let uavs = |count| {
        let scenario = testing::ring_of(count, 40.0);
        ShownLog::of(&scenario, false).uavs
    };
    assert_eq!(uavs(32).len(), 32);
    assert_eq!(uavs(33), [1, 5, 9, 13, 17, 21, 25, 29]);
    assert_eq!(uavs(200), [1, 26, 51, 76, 101, 126, 151, 176]);
}

#[test]
fn the_same_scenario_gives_the_same_layout() {
    let scenario = testing::ring_of(6, 40.0);
    assert_eq!(render(&scenario, true), render(&scenario, true));
}
