//! The channels of the log: one for each topic, with the schema of its messages.
//!
//! Must never write a message.

use crate::schema::{
    Faults, LinkCounts, LoggedEvent, SwarmMetrics, SwarmState, Timing, TimingPercentiles, UavControl,
    UavState,
    topics::{self, UavTopic},
};
use foxglove::{
    Encode,
    messages::{FrameTransforms, GeoJson, LocationFix, Log, PoseInFrame, SceneUpdate},
};
use mcap::{McapResult, Writer};
use ringwing_flight::UavId;
use std::{
    collections::BTreeMap,
    io::{Seek, Write},
};

/// The channels' numbers in the file.
pub(super) struct Channels {
    pub(super) events: u16,
    pub(super) faults: u16,
    pub(super) leader_fix: u16,
    pub(super) map: u16,
    pub(super) leader_pose: u16,
    pub(super) links: u16,
    pub(super) log: u16,
    pub(super) formation: u16,
    pub(super) obstacles: u16,
    pub(super) path: u16,
    pub(super) ring: u16,
    pub(super) trails: u16,
    pub(super) uav_scene: u16,
    pub(super) metrics: u16,
    pub(super) state: u16,
    pub(super) transforms: u16,
    pub(super) timing: Option<u16>,
    pub(super) timing_percentiles: Option<u16>,
    pub(super) uavs: Vec<UavChannels>,
}

/// The channels of one UAV.
#[derive(Clone, Copy)]
pub(super) struct UavChannels {
    pub(super) control: u16,
    pub(super) state: u16,
}

impl Channels {
    /// Registers the channels of a swarm of `uavs` with `writer`, `timing` included if it is wanted.
    ///
    /// They have the order of their topics, and so do the messages of a tick: readers that merge by time and topic find
    /// them sorted.
    pub(super) fn register<W: Write + Seek>(
        writer: &mut Writer<W>,
        uavs: u32,
        timing: bool,
    ) -> McapResult<Self> {
        Ok(Self {
            // Rust evaluates these fields in the order written here, so their order is that of the channel numbers.
            events: channel::<LoggedEvent, W>(writer, topics::EVENTS)?,
            faults: channel::<Faults, W>(writer, topics::FAULTS)?,
            leader_fix: channel::<LocationFix, W>(writer, topics::LEADER_FIX)?,
            map: channel::<GeoJson, W>(writer, topics::MAP)?,
            leader_pose: channel::<PoseInFrame, W>(writer, topics::LEADER_POSE)?,
            links: channel::<LinkCounts, W>(writer, topics::LINKS)?,
            log: channel::<Log, W>(writer, topics::LOG)?,
            formation: channel::<SceneUpdate, W>(writer, topics::FORMATION_SCENE)?,
            obstacles: channel::<SceneUpdate, W>(writer, topics::OBSTACLE_SCENE)?,
            path: channel::<SceneUpdate, W>(writer, topics::PATH_SCENE)?,
            ring: channel::<SceneUpdate, W>(writer, topics::RING_SCENE)?,
            trails: channel::<SceneUpdate, W>(writer, topics::TRAIL_SCENE)?,
            uav_scene: channel::<SceneUpdate, W>(writer, topics::UAV_SCENE)?,
            metrics: channel::<SwarmMetrics, W>(writer, topics::SWARM_METRICS)?,
            state: channel::<SwarmState, W>(writer, topics::SWARM_STATE)?,
            transforms: channel::<FrameTransforms, W>(writer, topics::TRANSFORMS)?,
            timing: timing.then(|| channel::<Timing, W>(writer, topics::TIMING)).transpose()?,
            timing_percentiles: timing
                .then(|| channel::<TimingPercentiles, W>(writer, topics::TIMING_PERCENTILES))
                .transpose()?,
            uavs: UavId::all(uavs)
                .map(|uav| UavChannels::register(writer, uav, uavs))
                .collect::<McapResult<_>>()?,
        })
    }

    /// How many messages of each topic that a verdict needs are among these `counts`, which are by channel: metadata that
    /// shows a reader whether another program has left messages out.
    pub(super) fn judged_counts(&self, counts: &[u64]) -> BTreeMap<String, String> {
        let sums = [
            sum(counts, [self.events]),
            sum(counts, [self.links]),
            sum(counts, self.uavs.iter().map(|uav| uav.control)),
            sum(counts, self.uavs.iter().map(|uav| uav.state)),
        ];
        topics::judged_groups()
            .iter()
            .map(|group| count_key(group))
            .zip(sums.map(|sum| sum.to_string()))
            .collect()
    }
}

impl UavChannels {
    fn register<W: Write + Seek>(writer: &mut Writer<W>, uav: UavId, uavs: u32) -> McapResult<Self> {
        Ok(Self {
            control: channel::<UavControl, W>(writer, &UavTopic::Control.name(uav.0, uavs))?,
            state: channel::<UavState, W>(writer, &UavTopic::State.name(uav.0, uavs))?,
        })
    }
}

/// The sum of the `counts` of some channels. A channel without messages may have no count.
fn sum(counts: &[u64], channels: impl IntoIterator<Item = u16>) -> u64 {
    channels.into_iter().filter_map(|channel| counts.get(usize::from(channel))).sum()
}

/// The key of the metadata `result` that says how many messages of `group` were written.
pub(super) fn count_key(group: &str) -> String {
    format!("messages.{group}")
}

fn channel<T: Encode, W: Write + Seek>(writer: &mut Writer<W>, topic: &str) -> McapResult<u16> {
    let schema = T::get_schema().expect("every message of the log has a schema");
    // The writer returns the number of an equal schema that it has already, so topics of one type share a schema.
    let schema_id = writer.add_schema(&schema.name, &schema.encoding, &schema.data)?;
    writer.add_channel(schema_id, topic, &T::get_message_encoding(), &BTreeMap::new())
}
