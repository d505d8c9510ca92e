//! What the flight was like, for tables, scripts and the verdict.

use super::{FaultRecovery, LinkTotals, TrueState};
use serde::{Deserialize, Serialize};

/// A flight in numbers; what does not exist is absent, never 0.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct FlightSummary {
    /// The first time from which every slot error stays within 1 m, and for 5 s on end or to the end of the flight.
    pub settling_s: Option<f64>,
    /// The largest slot error at the end.
    pub slot_error_max_m: Option<f64>,
    /// The root of the mean of the squared slot errors at the end.
    pub slot_error_rms_m: Option<f64>,
    /// The largest `| |p_i - p_j| - L |` of ring neighbours at the end.
    pub neighbour_error_max_m: Option<f64>,
    /// The largest `| |p_i - p_c| - R |` at the end.
    pub radius_error_max_m: Option<f64>,
    /// The closest that any two came.
    pub closest_pair: Option<ClosestPair>,
    /// The closest that ring neighbours came.
    pub closest_adjacent: Option<ClosestPair>,
    /// The closest that two came which are not ring neighbours.
    pub closest_other: Option<ClosestPair>,
    /// The closest that anybody came to each obstacle, in the scenario's order.
    pub obstacles: Vec<ObstacleSummary>,
    /// Share of commands whose speed Eq. (12) cut.
    pub speed_saturated_share: Option<f64>,
    /// Share of commands whose turn rate Eq. (12) cut.
    pub turn_rate_saturated_share: Option<f64>,
    /// The slowest anybody flew.
    pub speed_min_m_s: Option<f64>,
    /// The fastest anybody flew.
    pub speed_max_m_s: Option<f64>,
    /// The tightest anybody turned.
    pub turn_rate_max_rad_s: Option<f64>,
    /// Views of who lives at the end: 1 where all that fly on command agree.
    pub views: u32,
    /// The last moment at which there was more than one.
    pub disagreed_until_s: Option<f64>,
    /// Faults in all: what was asked for, the return of a UAV included, and processes that were lost or frozen.
    pub faults: u64,
    /// How long each was felt; only the first hundred.
    pub recoveries: Vec<FaultRecovery>,
    /// Ticks measured.
    pub ticks: u64,
    /// Ticks lost, or not had whole.
    pub ticks_lost: u64,
    /// The last tick measured.
    pub last_tick: Option<i64>,
    /// What became of samples on links with faults.
    #[serde(default)]
    pub links: Vec<LinkTotals>,
    /// Each UAV at the end, without those that have left the sky.
    pub uavs: Vec<UavSummary>,
}

/// Two UAVs at the moment they were closest.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ClosestPair {
    /// Their distance.
    pub distance_m: f64,
    /// The lower number.
    pub uav: u32,
    /// The higher number.
    pub other: u32,
    /// When.
    pub time_s: f64,
}

/// The moment somebody was closest to an obstacle.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ObstacleSummary {
    /// The obstacle.
    pub name: String,
    /// Distance to its edge; negative inside.
    pub clearance_m: f64,
    /// Who.
    pub uav: u32,
    /// When.
    pub time_s: f64,
    /// Everybody who came within its braking distance, the nearest, whom it repelled hardest, first.
    pub repelled: Vec<u32>,
}

/// A UAV at the end of the flight.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct UavSummary {
    /// Its number.
    pub uav: u32,
    /// Whether its agent flies it, and not its failsafe.
    pub commanded: bool,
    /// Distance from its slot.
    pub slot_error_m: Option<f64>,
    /// Distance to the ring neighbour before.
    pub previous_distance_m: Option<f64>,
    /// Distance to the ring neighbour after.
    pub next_distance_m: Option<f64>,
    /// Distance to the leader.
    pub leader_distance_m: Option<f64>,
    /// Its speed.
    pub speed_m_s: f64,
    /// Its heading, from the x axis, counterclockwise.
    pub heading_rad: f64,
}

impl UavSummary {
    pub(super) fn of(state: &TrueState) -> Self {
        let finite = |value: Option<f64>| value.filter(|value| value.is_finite());
        Self {
            uav: state.uav,
            commanded: state.is_commanded(),
            slot_error_m: finite(state.slot_error_m),
            previous_distance_m: finite(state.previous_distance_m),
            next_distance_m: finite(state.next_distance_m),
            leader_distance_m: finite(state.leader_distance_m),
            speed_m_s: state.speed_m_s,
            heading_rad: state.heading_rad,
        }
    }
}
