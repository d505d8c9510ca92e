//! The flight in numbers, for tables, scripts and the verdict.

use super::{ChanceEvent, FaultEffects, FaultRecovery, LinkTotals, TrueState, UnplannedLoss};
use serde::{Deserialize, Serialize};

/// A flight in numbers. A value that does not exist is absent, never 0.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct FlightSummary {
    /// The first time from which every slot error stays within 1 m for 5 s.
    pub settling_s: Option<f64>,
    /// Since when every slot error has been within 1 m, if the flight ended before the formation could count as settled.
    pub whole_since_s: Option<f64>,
    /// Number of UAVs that fly on command at the end.
    pub commanded: u32,
    /// The largest slot error at the end.
    pub slot_error_max_m: Option<f64>,
    /// The root of the mean of the squared slot errors at the end.
    pub slot_error_rms_m: Option<f64>,
    /// The root of the mean of the squared slot errors over the second half of the flight.
    #[serde(default)]
    pub keeping_error_rms_m: Option<f64>,
    /// The root of the mean of the squared distances between where agents believe that their UAVs are and where they are, over the second half
    /// of the flight; absent if every agent knew that exactly.
    #[serde(default)]
    pub estimate_error_rms_m: Option<f64>,
    /// The largest `| |p_i - p_j| - L |` of ring neighbours at the end.
    pub neighbour_error_max_m: Option<f64>,
    /// The largest `| |p_i - p_c| - R |` at the end.
    pub radius_error_max_m: Option<f64>,
    /// The closest approach of any two UAVs.
    pub closest_pair: Option<ClosestPair>,
    /// The closest approach of ring neighbours.
    pub closest_adjacent: Option<ClosestPair>,
    /// The closest approach of two UAVs that are not ring neighbours.
    pub closest_other: Option<ClosestPair>,
    /// The closest approach to each obstacle, in the scenario's order.
    pub obstacles: Vec<ObstacleSummary>,
    /// The closest approach to each intruder, in the scenario's order.
    #[serde(default)]
    pub intruders: Vec<IntruderSummary>,
    /// Number of times that a UAV passed another aircraft nearer than the scenario's distance of a near miss, and did not
    /// hit it.
    #[serde(default)]
    pub near_misses: u64,
    /// Share of commands that a collision filter changed; absent without filters.
    #[serde(default)]
    pub filter_share: Option<f64>,
    /// How many times a filter began to act.
    #[serde(default)]
    pub filter_episodes: u64,
    /// The longest time for which a filter acted without a break.
    #[serde(default)]
    pub filter_longest_s: Option<f64>,
    /// Mean angle between the heading that a filter took and that of the law's course, while it acted.
    #[serde(default)]
    pub filter_turn_mean_deg: Option<f64>,
    /// The largest such angle.
    #[serde(default)]
    pub filter_turn_max_deg: Option<f64>,
    /// Mean difference between a commanded speed and the one that the law asked for, while a filter acted.
    #[serde(default)]
    pub filter_speed_mean_m_s: Option<f64>,
    /// The largest such difference.
    #[serde(default)]
    pub filter_speed_max_m_s: Option<f64>,
    /// Share of commands whose speed Eq. (12) cut.
    pub speed_saturated_share: Option<f64>,
    /// Share of commands whose turn rate Eq. (12) cut.
    pub turn_rate_saturated_share: Option<f64>,
    /// The lowest speed flown.
    pub speed_min_m_s: Option<f64>,
    /// The highest speed flown.
    pub speed_max_m_s: Option<f64>,
    /// The largest turn rate flown, in either direction.
    pub turn_rate_max_rad_s: Option<f64>,
    /// Number of different views of who is alive at the end: 1 where all agents agree.
    pub views: u32,
    /// The last time at which there was more than one view.
    pub disagreed_until_s: Option<f64>,
    /// Number of faults: requested ones, the return of a UAV included, and processes that were lost or frozen by chance.
    pub faults: u64,
    /// Number of moments at which there were faults.
    pub fault_moments: u64,
    /// How long the formation took to recover at each moment. Of more than a hundred moments: the first ones, the one with
    /// the longest recovery, and the last one.
    pub recoveries: Vec<FaultRecovery>,
    /// How many faults were asked for, how many acted, and which had no effect.
    #[serde(default)]
    pub fault_effects: FaultEffects,
    /// Number of recoveries that the next fault cut short.
    pub recoveries_cut_short: u64,
    /// The longest recovery; absent unless the formation was seen to recover from every fault.
    pub recovery_max_s: Option<f64>,
    /// Number of processes that were lost, or frozen to the end, although no fault of the run asked for it.
    pub unplanned_losses: u64,
    /// Those processes; only the first hundred.
    pub unplanned_loss_list: Vec<UnplannedLoss>,
    /// Number of events by which the flight depends on chance: flying it again may give another flight.
    pub chance_events: u64,
    /// Those events; only the first hundred.
    pub chance_event_list: Vec<ChanceEvent>,
    /// The first event by which a flight in lockstep went on without something that it should have waited for.
    pub broke_lockstep: Option<ChanceEvent>,
    /// Number of ticks measured.
    pub ticks: u64,
    /// Number of ticks that are missing.
    pub ticks_lost: u64,
    /// The last tick measured.
    pub last_tick: Option<i64>,
    /// What became of the samples on links with faults.
    #[serde(default)]
    pub links: Vec<LinkTotals>,
    /// Each UAV in the sky at the end.
    pub uavs: Vec<UavSummary>,
}

/// The closest approach of two UAVs.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ClosestPair {
    /// Their distance.
    pub distance_m: f64,
    /// The lower number.
    pub uav: u32,
    /// The higher number.
    pub other: u32,
    /// When it happened, in simulated time.
    pub time_s: f64,
}

/// The closest approach to an obstacle.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ObstacleSummary {
    /// The obstacle.
    pub name: String,
    /// Distance to its edge; negative inside.
    pub clearance_m: f64,
    /// The UAV that came closest.
    pub uav: u32,
    /// When it happened, in simulated time.
    pub time_s: f64,
    /// The UAVs that came within its braking distance, the nearest first: it repelled that one hardest.
    pub repelled: Vec<u32>,
}

/// The closest approach to an intruder.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct IntruderSummary {
    /// Its number, from 1 in the order of the scenario.
    pub intruder: u32,
    /// The smallest distance of a UAV.
    pub distance_m: f64,
    /// The UAV that came closest.
    pub uav: u32,
    /// When it happened, in simulated time.
    pub time_s: f64,
}

/// A UAV at the end of the flight.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct UavSummary {
    /// Its number.
    pub uav: u32,
    /// Whether it flies on command, and not in its failsafe.
    pub commanded: bool,
    /// Distance from its slot.
    pub slot_error_m: Option<f64>,
    /// Distance to the previous ring neighbour.
    pub previous_distance_m: Option<f64>,
    /// Distance to the next ring neighbour.
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
        // JSON writes an infinity as null. Leave it out here, so that a summary is read back as it was written.
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
