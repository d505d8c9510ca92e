//! Where the UAVs start.

use serde::{Deserialize, Serialize};

/// `[start]`: listed start states, or a draw of them.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct StartSection {
    /// How to draw start states; used when `uavs` is empty.
    pub draw: DrawSection,
    /// One entry per UAV, or empty.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub uavs: Vec<StartState>,
}

/// `[start.draw]`: a seeded draw of start states from a box around the leader, with its size in radii of the
/// ring that has as many UAVs, whatever the shape. Around an echelon, the box leans along the line, and is at least as
/// long as the line.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct DrawSection {
    /// Length of the box along the leader's heading.
    pub length_radii: f64,
    /// Width of the box across the heading.
    pub width_radii: f64,
    /// Distance of the box's middle ahead of the leader; negative is behind.
    pub ahead_radii: f64,
    /// Smallest distance between two start positions.
    pub separation_m: f64,
    /// Largest deviation of a heading from the leader's.
    pub heading_spread_deg: f64,
}

impl Default for DrawSection {
    fn default() -> Self {
        Self {
            length_radii: 3.0,
            width_radii: 2.0,
            ahead_radii: 0.0,
            separation_m: 10.0,
            // 0.5 rad. The paper gives no start states.
            heading_spread_deg: 28.6,
        }
    }
}

/// `[[start.uavs]]`: the start state of one UAV.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StartState {
    /// Position in the local frame.
    pub position_m: [f64; 2],
    /// Heading.
    pub heading_deg: f64,
    /// Speed along the heading.
    pub speed_m_s: f64,
}
