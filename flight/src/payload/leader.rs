//! What the leader tells all agents.

use crate::Tick;
use bytemuck::{Pod, Zeroable};

/// Where the virtual leader is and how it moves, once a tick. Its position is the centre of the formation.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct LeaderState {
    /// The tick this state belongs to; grows by one, so a gap is a lost sample.
    pub tick: Tick,
    /// Position in the local frame (x east, y north), metres.
    pub position_m: [f64; 2],
    /// Heading from the x axis, counterclockwise, in (-pi, pi].
    pub heading_rad: f64,
    /// Speed along the heading, from this tick on.
    pub speed_m_s: f64,
    /// Rate of the heading, from this tick on.
    pub turn_rate_rad_s: f64,
}
