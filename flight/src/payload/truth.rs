//! What only the world knows of a UAV.

use bytemuck::{Pod, Zeroable};

/// How a UAV truly flies, and the air there, once a tick: for the log. No agent is told.
#[derive(Debug, Clone, Copy, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Truth {
    /// Position in the local frame (x east, y north), metres.
    pub position_m: [f64; 2],
    /// Heading from the x axis, counterclockwise, in (-pi, pi].
    pub heading_rad: f64,
    /// Speed flown through the air over the last tick.
    pub speed_m_s: f64,
    /// Turn rate flown over the last tick.
    pub turn_rate_rad_s: f64,
    /// Velocity of the air over the last tick; zero in still air.
    pub wind_m_s: [f64; 2],
}
