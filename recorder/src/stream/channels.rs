//! The channels of a flight: one for each topic, with the schema of its messages.
//!
//! Must never make a message.

use super::MessageSink;
use crate::schema::{
    Faults, LinkCounts, LoggedEvent, SwarmMetrics, SwarmState, Timing, TimingPercentiles, UavControl,
    UavNotes, UavState,
    topics::{self, UavTopic},
};
use foxglove::{
    Encode,
    messages::{FrameTransforms, GeoJson, LocationFix, Log, PoseInFrame, SceneUpdate},
};
use ringwing_flight::UavId;
use std::collections::BTreeMap;

/// The numbers of the channels.
pub(super) struct Channels {
    pub(super) events: u16,
    pub(super) faults: u16,
    pub(super) leader_fix: u16,
    pub(super) map: u16,
    pub(super) leader_pose: u16,
    pub(super) links: u16,
    pub(super) log: u16,
    pub(super) estimates: u16,
    pub(super) formation: u16,
    pub(super) obstacles: u16,
    pub(super) path: u16,
    pub(super) ring: u16,
    pub(super) trails: u16,
    pub(super) uav_scene: u16,
    pub(super) wind: u16,
    pub(super) metrics: u16,
    pub(super) state: u16,
    pub(super) transforms: u16,
    pub(super) timing: Option<u16>,
    pub(super) timing_percentiles: Option<u16>,
    pub(super) uavs: Vec<UavChannels>,
    /// Those of UAVs whose controllers have noted something.
    notes: BTreeMap<UavId, u16>,
}

/// The channels of one UAV.
#[derive(Clone, Copy)]
pub(super) struct UavChannels {
    pub(super) control: u16,
    pub(super) state: u16,
}

impl Channels {
    /// Registers the channels of a swarm of `uavs` with `sink`, `timing` included if it is wanted.
    ///
    /// They have the order of their topics, and so do the messages of a tick: readers that merge by time and topic find
    /// them sorted.
    pub(super) fn register<S: MessageSink>(sink: &mut S, uavs: u32, timing: bool) -> Result<Self, S::Error> {
        Ok(Self {
            // Rust evaluates these fields in the order written here, so their order is that of the channel numbers.
            events: channel::<LoggedEvent, S>(sink, topics::EVENTS)?,
            faults: channel::<Faults, S>(sink, topics::FAULTS)?,
            leader_fix: channel::<LocationFix, S>(sink, topics::LEADER_FIX)?,
            map: channel::<GeoJson, S>(sink, topics::MAP)?,
            leader_pose: channel::<PoseInFrame, S>(sink, topics::LEADER_POSE)?,
            links: channel::<LinkCounts, S>(sink, topics::LINKS)?,
            log: channel::<Log, S>(sink, topics::LOG)?,
            estimates: channel::<SceneUpdate, S>(sink, topics::ESTIMATE_SCENE)?,
            formation: channel::<SceneUpdate, S>(sink, topics::FORMATION_SCENE)?,
            obstacles: channel::<SceneUpdate, S>(sink, topics::OBSTACLE_SCENE)?,
            path: channel::<SceneUpdate, S>(sink, topics::PATH_SCENE)?,
            ring: channel::<SceneUpdate, S>(sink, topics::RING_SCENE)?,
            trails: channel::<SceneUpdate, S>(sink, topics::TRAIL_SCENE)?,
            uav_scene: channel::<SceneUpdate, S>(sink, topics::UAV_SCENE)?,
            wind: channel::<SceneUpdate, S>(sink, topics::WIND_SCENE)?,
            metrics: channel::<SwarmMetrics, S>(sink, topics::SWARM_METRICS)?,
            state: channel::<SwarmState, S>(sink, topics::SWARM_STATE)?,
            transforms: channel::<FrameTransforms, S>(sink, topics::TRANSFORMS)?,
            timing: timing.then(|| channel::<Timing, S>(sink, topics::TIMING)).transpose()?,
            timing_percentiles: timing
                .then(|| channel::<TimingPercentiles, S>(sink, topics::TIMING_PERCENTILES))
                .transpose()?,
            uavs: UavId::all(uavs)
                .map(|uav| UavChannels::register(sink, uav, uavs))
                .collect::<Result<_, S::Error>>()?,
            notes: BTreeMap::new(),
        })
    }

    /// The channel for the notes of `uav`. Registered with the first notes, so that a flight without notes has the same log,
    /// byte for byte, as before there were any.
    pub(super) fn notes_of<S: MessageSink>(&mut self, sink: &mut S, uav: UavId) -> Result<u16, S::Error> {
        if let Some(channel) = self.notes.get(&uav) {
            return Ok(*channel);
        }
        let topic = UavTopic::Notes.name(uav.0, self.uavs.len() as u32);
        let channel = channel::<UavNotes, S>(sink, &topic)?;
        self.notes.insert(uav, channel);
        Ok(channel)
    }

    /// How many messages of each topic that a verdict needs are among these `counts`, which are by channel: metadata that
    /// shows a reader whether another program has left messages out.
    pub(super) fn judged_counts(&self, counts: &[u64]) -> BTreeMap<String, String> {
        // In the order of `judged_groups`, to which they are matched by place.
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
    fn register<S: MessageSink>(sink: &mut S, uav: UavId, uavs: u32) -> Result<Self, S::Error> {
        Ok(Self {
            // `control` before `state`, as the topics sort.
            control: channel::<UavControl, S>(sink, &UavTopic::Control.name(uav.0, uavs))?,
            state: channel::<UavState, S>(sink, &UavTopic::State.name(uav.0, uavs))?,
        })
    }
}

/// The sum of the `counts` of some channels. A channel without messages may have no count.
fn sum(counts: &[u64], channels: impl IntoIterator<Item = u16>) -> u64 {
    channels.into_iter().filter_map(|channel| counts.get(usize::from(channel))).sum()
}

/// The key of the metadata `result` that says how many messages of `group` were written.
pub(crate) fn count_key(group: &str) -> String {
    format!("messages.{group}")
}

fn channel<T: Encode, S: MessageSink>(sink: &mut S, topic: &str) -> Result<u16, S::Error> {
    let schema = T::get_schema().expect("every message of the log has a schema");
    sink.add_channel(topic, &schema, &T::get_message_encoding())
}
