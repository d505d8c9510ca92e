//! The topics of the log, each named once: for the writer, the replay, the panels and every reader of a log.

use std::borrow::Cow;

/// Events with their fields, for programs.
pub const EVENTS: &str = "/events";
/// What is wrong at the moment.
pub const FAULTS: &str = "/faults";
/// Where on the earth the leader is.
pub const LEADER_FIX: &str = "/geo/leader";
/// The UAVs on the map.
pub const MAP: &str = "/geo/uavs";
/// The leader's position and heading.
pub const LEADER_POSE: &str = "/leader/pose";
/// Counts of the samples on links with faults.
pub const LINKS: &str = "/links";
/// Events as sentences, for viewers.
pub const LOG: &str = "/log";
/// Where agents believe that their UAVs are, in 3D.
pub const ESTIMATE_SCENE: &str = "/scene/estimates";
/// The slots and the circle of the formation, in 3D.
pub const FORMATION_SCENE: &str = "/scene/formation";
/// The obstacles, in 3D.
pub const OBSTACLE_SCENE: &str = "/scene/obstacles";
/// The leader's path, in 3D.
pub const PATH_SCENE: &str = "/scene/path";
/// The links of the ring, in 3D.
pub const RING_SCENE: &str = "/scene/ring";
/// The trails of the UAVs, in 3D.
pub const TRAIL_SCENE: &str = "/scene/trails";
/// The UAVs, in 3D.
pub const UAV_SCENE: &str = "/scene/uavs";
/// The wind, in 3D.
pub const WIND_SCENE: &str = "/scene/wind";
/// The metrics of the moment.
pub const SWARM_METRICS: &str = "/swarm/metrics";
/// Every UAV in one message.
pub const SWARM_STATE: &str = "/swarm/state";
/// The coordinate frames.
pub const TRANSFORMS: &str = "/tf";
/// How long each tick took, by the wall clock.
pub const TIMING: &str = "/timing";
/// How long the ticks of each second took.
pub const TIMING_PERCENTILES: &str = "/timing/percentiles";

/// All topics but those of single UAVs, in the order in which the log has its channels.
pub const ALL: [&str; 20] = [
    EVENTS,
    FAULTS,
    LEADER_FIX,
    MAP,
    LEADER_POSE,
    LINKS,
    LOG,
    ESTIMATE_SCENE,
    FORMATION_SCENE,
    OBSTACLE_SCENE,
    PATH_SCENE,
    RING_SCENE,
    TRAIL_SCENE,
    UAV_SCENE,
    WIND_SCENE,
    SWARM_METRICS,
    SWARM_STATE,
    TRANSFORMS,
    TIMING,
    TIMING_PERCENTILES,
];

/// What the topic of a single UAV is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum UavTopic {
    /// What its agent commanded: `/uav/001/control`.
    Control,
    /// What its controller noted: `/uav/001/notes`.
    Notes,
    /// Where it is: `/uav/001/state`.
    State,
}

impl UavTopic {
    /// The topic of UAV number `uav` in a swarm of `uavs`.
    pub fn name(self, uav: u32, uavs: u32) -> String {
        format!("/uav/{}/{}", padded(uav, uavs), self.suffix())
    }

    /// What `topic` is about, if it is one of a single UAV.
    pub fn parse(topic: &str) -> Option<Self> {
        let (_number, suffix) = topic.strip_prefix("/uav/")?.split_once('/')?;
        // The number is not checked: a log may be of a larger swarm, whose numbers have more digits.
        [Self::Control, Self::Notes, Self::State].into_iter().find(|kind| kind.suffix() == suffix)
    }

    /// The name under which the messages about all UAVs are counted together: `/uav/*/state`.
    pub(crate) fn group(self) -> String {
        format!("/uav/*/{}", self.suffix())
    }

    fn suffix(self) -> &'static str {
        match self {
            Self::Control => "control",
            Self::Notes => "notes",
            Self::State => "state",
        }
    }
}

/// The topics that a verdict needs, those of UAVs together. Others only show what these hold.
pub(crate) fn judged_groups() -> [String; 4] {
    let [control, state] = [UavTopic::Control, UavTopic::State].map(UavTopic::group);
    [EVENTS.into(), LINKS.into(), control, state]
}

/// Whether a verdict needs `topic`.
pub fn is_judged(topic: &str) -> bool {
    judged_groups().contains(&group(topic).into_owned())
}

/// Whether ringwing writes `topic`; other programs may add theirs to a log.
pub fn is_known(topic: &str) -> bool {
    // `ALL` cannot list the topics of single UAVs: how many there are depends on the scenario.
    ALL.contains(&topic) || UavTopic::parse(topic).is_some()
}

/// The name under which the messages of `topic` are counted.
pub(crate) fn group(topic: &str) -> Cow<'_, str> {
    UavTopic::parse(topic).map_or(Cow::Borrowed(topic), |kind| Cow::Owned(kind.group()))
}

/// The number of a UAV with leading zeros, so that names in a swarm of `uavs` sort by number.
pub(crate) fn padded(uav: u32, uavs: u32) -> String {
    // At least three digits, so that the topics of a UAV have the same names in all swarms of up to 999.
    let width = uavs.to_string().len().max(3);
    format!("{uav:0width$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn topics_sort_in_the_order_of_their_channels() {
        assert!(ALL.is_sorted() && ALL[17] < UavTopic::Control.name(1, 6).as_str());
        assert!(UavTopic::State.name(9, 1000) < UavTopic::Control.name(10, 1000));
    }

    #[test]
    fn a_uav_topic_says_what_it_is_about() {
        assert_eq!(UavTopic::State.name(7, 999), "/uav/007/state");
        assert_eq!(UavTopic::Control.name(7, 1000), "/uav/0007/control");
        assert_eq!(UavTopic::parse("/uav/0007/control"), Some(UavTopic::Control));
        assert_eq!((UavTopic::parse("/uav/007/trail"), UavTopic::parse("/tf")), (None, None));
        assert_eq!((group("/uav/007/state"), group("/tf")), ("/uav/*/state".into(), "/tf".into()));
        for (topic, judged, known) in [
            ("/uav/7/state", true, true),
            ("/uav/007/notes", false, true),
            (EVENTS, true, true),
            (TRANSFORMS, false, true),
            ("/camera", false, false),
        ] {
            assert_eq!((is_judged(topic), is_known(topic)), (judged, known), "{topic}");
        }
    }
}
