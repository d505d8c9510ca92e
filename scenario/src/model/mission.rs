//! The mission of the swarm: time, formation, leader and requirements.

use nalgebra::Vector2;
use ringwing_flight::{Formation, FormationFrame, Shape, TrackPoint, Turn};
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

/// `[formation]`: the standard formation of Definition 1, or another shape.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct FormationSection {
    /// n, the number of UAVs.
    pub uavs: u32,
    /// The shape.
    pub shape: ShapeName,
    /// L, the distance between neighbouring slots.
    pub spacing_m: f64,
    /// alpha, the bearing of slot 1 of a ring from the centre, in [`FormationSection::frame`]. The others follow
    /// clockwise. Every shape points the opposite way.
    pub bearing_deg: f64,
    /// Whether the formation keeps its bearing, or turns with the leader's heading.
    pub frame: FormationFrame,
    /// Of a vee or an echelon: the angle by which an arm lies behind the line across.
    pub sweep_deg: f64,
    /// Of an ellipse: its width divided by its length.
    pub aspect: f64,
    /// Of a star: the distance of its inner slots from the centre as a share of that of its outer ones.
    pub inner_ratio: f64,
    /// Of a grid: the number of slots in a row; 0 for as many columns as rows, or one more.
    pub columns: u32,
    /// Which UAV gets which slot.
    pub assignment: Assignment,
    /// The slots of the shape `offsets`, one entry per UAV.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub offsets: Vec<OffsetSection>,
}

/// The shape of a formation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ShapeName {
    /// Evenly on a circle, as in the paper.
    Ring,
    /// Two arms behind a tip.
    Vee,
    /// A slanting line.
    Echelon,
    /// The ring, stretched.
    Ellipse,
    /// Rows and columns.
    Grid,
    /// The ring with every second slot nearer to the centre.
    Star,
    /// The places that `[[formation.offsets]]` lists.
    Offsets,
}

/// `[[formation.offsets]]`: the place of one slot, seen from the leader in the direction of the formation.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OffsetSection {
    /// Distance ahead of the leader; negative is behind.
    pub ahead_m: f64,
    /// Distance to the left; negative is to the right.
    pub left_m: f64,
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

impl FormationSection {
    /// The slots.
    pub(crate) fn geometry(&self) -> Formation {
        Formation::shaped(self.shape(), self.uavs, self.spacing_m, self.bearing_deg.to_radians())
    }

    fn shape(&self) -> Shape {
        let sweep_rad = self.sweep_deg.to_radians();
        match self.shape {
            ShapeName::Ring => Shape::Ring,
            ShapeName::Vee => Shape::Vee { sweep_rad },
            ShapeName::Echelon => Shape::Echelon { sweep_rad },
            ShapeName::Ellipse => Shape::Ellipse { aspect: self.aspect },
            ShapeName::Grid => Shape::Grid { columns: self.columns() },
            ShapeName::Star => Shape::Star { inner_ratio: self.inner_ratio },
            ShapeName::Offsets => {
                let offset = |offset: &OffsetSection| Vector2::new(offset.ahead_m, offset.left_m);
                Shape::Offsets(self.offsets.iter().map(offset).collect())
            }
        }
    }

    fn columns(&self) -> u32 {
        match self.columns {
            0 => f64::from(self.uavs).sqrt().ceil() as u32,
            columns => columns,
        }
    }
}

impl ShapeName {
    /// Its name in scenarios and messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ring => "ring",
            Self::Vee => "vee",
            Self::Echelon => "echelon",
            Self::Ellipse => "ellipse",
            Self::Grid => "grid",
            Self::Star => "star",
            Self::Offsets => "offsets",
        }
    }
}

impl Default for FormationSection {
    fn default() -> Self {
        // The formation of Section 4. Only with UAV 1 at the rear do the obstacles of Section 4.2 meet the UAVs that
        // its figures show.
        Self {
            uavs: 6,
            shape: ShapeName::Ring,
            spacing_m: 40.0,
            bearing_deg: 180.0,
            frame: FormationFrame::Fixed,
            // With less, the formation is wider and with more it is longer: both take longer to form from drawn starts.
            sweep_deg: 45.0,
            aspect: 1.5,
            inner_ratio: 0.45,
            columns: 0,
            assignment: Assignment::Number,
            offsets: Vec::new(),
        }
    }
}

/// `[leader]`: the virtual leader. Assumption 1 lets it fly straight at constant speed; other paths are beyond the paper.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct LeaderSection {
    /// Its position at time 0. A track says that itself.
    pub start_m: [f64; 2],
    /// `theta_d` at time 0. Waypoints and tracks say that themselves.
    pub heading_deg: f64,
    /// `v_d`. A track says that itself.
    pub speed_m_s: f64,
    /// Where it flies.
    pub path: PathSection,
}

impl Default for LeaderSection {
    fn default() -> Self {
        // The speed and heading of Section 4, which gives no start.
        Self { start_m: [0.0, 0.0], heading_deg: 0.0, speed_m_s: 15.0, path: PathSection::default() }
    }
}

/// `[leader.path]`: where the leader flies from its start on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PathSection {
    /// Which of the paths it is. The other keys have an effect only for the kinds that they name.
    pub kind: PathKind,
    /// rho, the radius of every turn: of a circle, figure eight, racetrack, or of the arcs at waypoints.
    pub radius_m: f64,
    /// The side of the first turn of a circle, figure eight or racetrack.
    pub turn: Turn,
    /// Length of each straight of a racetrack.
    pub length_m: f64,
    /// The file of a track: CSV with a time and a place on each line. Empty if the points are listed.
    pub file: String,
    /// The waypoints, in order.
    pub waypoints: Vec<WaypointSection>,
    /// The points of a track, in order of time; those of the file, if there is one.
    pub points: Vec<TrackPoint>,
}

impl Default for PathSection {
    fn default() -> Self {
        Self {
            kind: PathKind::Straight,
            // At 15 m/s a turn of 0.05 rad/s, a tenth of what the paper's airframes can do. A ring of six that turns with
            // its leader is between 13 and 17 m/s fast on it.
            radius_m: 300.0,
            turn: Turn::Left,
            length_m: 600.0,
            file: String::new(),
            waypoints: Vec::new(),
            points: Vec::new(),
        }
    }
}

/// The paths of a leader.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PathKind {
    /// Straight on for ever (Assumption 1).
    Straight,
    /// Round one circle.
    Circle,
    /// Round two circles that touch at the start.
    FigureEight,
    /// Round two straights that half circles join.
    Racetrack,
    /// Past waypoints, with an arc at each corner, and straight on after the last one.
    Waypoints,
    /// Through places at given times, and straight on after the last one.
    Track,
}

/// `[[leader.path.waypoints]]`: a corner of the path.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WaypointSection {
    /// Its place.
    pub position_m: [f64; 2],
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
    /// Smallest distance of a UAV from an intruder.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub intruder_distance_min_m: Option<f64>,
    /// Latest time at which the formation has settled: from then on every slot error stays within 1 m for 5 s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub settling_max_s: Option<f64>,
    /// Longest time after a fault or the start of a manoeuvre in which the formation has settled again.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub recovery_max_s: Option<f64>,
    /// Largest distance of a UAV from its slot at the end.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub slot_error_max_m: Option<f64>,
    /// Largest root mean square of the slot errors of all UAVs over the second half of the flight.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub keeping_error_rms_max_m: Option<f64>,
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
