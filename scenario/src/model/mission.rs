//! The mission of the swarm: time, formation, leader, obstacles and requirements.

use serde::{Deserialize, Serialize};

/// `[time]`: length and time step of the flight.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct TimeSection {
    /// Length of the flight in simulated seconds.
    pub duration_s: f64,
    /// Control ticks per second.
    pub rate_hz: u32,
    /// Keep to the wall clock; otherwise fly as fast as the machine allows.
    pub real_time: bool,
}

impl Default for TimeSection {
    fn default() -> Self {
        // Long enough to pass both obstacles of Section 4.2. Below 10 Hz the law no longer flies like the continuous
        // one.
        Self { duration_s: 90.0, rate_hz: 100, real_time: false }
    }
}

/// `[formation]`: the standard formation, Definition 1.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct FormationSection {
    /// n, the number of UAVs.
    pub uavs: u32,
    /// L, the distance between neighbouring slots.
    pub spacing_m: f64,
    /// alpha, the bearing of slot 1 from the centre. The others follow clockwise.
    pub bearing_deg: f64,
    /// Which UAV gets which slot.
    pub assignment: Assignment,
}

/// How slots are given to UAVs before the flight. Each UAV keeps its slot for the whole flight.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Assignment {
    /// UAV i gets slot i, as in the paper.
    Number,
    /// As the start places suggest: the sum of the squared distances from start to slot is smallest.
    Nearest,
}

impl Default for FormationSection {
    fn default() -> Self {
        // The formation of Section 4. Only with UAV 1 at the rear do the obstacles of Section 4.2 meet the UAVs that
        // its figures show.
        Self { uavs: 6, spacing_m: 40.0, bearing_deg: 180.0, assignment: Assignment::Number }
    }
}

/// `[leader]`: the virtual leader, which flies in a straight line at constant speed (Assumption 1).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct LeaderSection {
    /// Position at time 0.
    pub start_m: [f64; 2],
    /// `theta_d`.
    pub heading_deg: f64,
    /// `v_d`.
    pub speed_m_s: f64,
}

impl Default for LeaderSection {
    fn default() -> Self {
        // The speed and heading of Section 4, which gives no start.
        Self { start_m: [0.0, 0.0], heading_deg: 0.0, speed_m_s: 15.0 }
    }
}

/// `[[obstacles]]`: a circle that no UAV may enter.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ObstacleSection {
    /// Name in tables and pictures.
    pub name: String,
    /// The centre.
    pub position_m: [f64; 2],
    /// `R_obs`.
    pub radius_m: f64,
    /// `L_obs`: the distance from the centre within which the obstacle repels, Eq. (13).
    pub braking_distance_m: f64,
}

/// `[requirements]`: what the flight must achieve. A key that is left out requires nothing, except that no process may be
/// lost unplanned.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RequirementsSection {
    /// Largest number of collisions.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub collisions_max: Option<u32>,
    /// Smallest distance of a UAV from the edge of an obstacle.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub clearance_min_m: Option<f64>,
    /// Smallest distance between two UAVs.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub separation_min_m: Option<f64>,
    /// Latest time at which the formation has settled: from then on every slot error stays within 1 m for 5 s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub settling_max_s: Option<f64>,
    /// Largest distance of a UAV from its slot at the end.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub slot_error_max_m: Option<f64>,
    /// Largest share of commands whose turn rate Eq. (12) cuts: a swarm that is thrown about turns as hard as it can.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub turn_rate_saturated_share_max: Option<f64>,
    /// Largest number of processes that end, or freeze for good, although no fault of the run asked for it.
    pub unplanned_losses_max: u32,
    /// Whether chance may have no part in the flight: neither real time, nor faults asked for during the flight, nor
    /// anything from outside the run.
    pub repeatable: bool,
    /// Every fault must have had an effect.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub faults_act: bool,
}
