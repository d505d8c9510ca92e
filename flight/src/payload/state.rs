//! What a UAV tells its ring neighbours.

use crate::{Tick, UavId};
use bytemuck::{Pod, Zeroable};

/// How many rumours one [`UavState`] has room for. More spread the news of many losses at once faster, and make every
/// state larger.
pub const RUMOURS: usize = 8;

/// News of one UAV of the swarm: whether it is alive, suspected or lost.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Rumour {
    /// The number of the UAV; 0 for an empty entry.
    pub uav: u32,
    /// Three times its incarnation, plus 0 for alive, 1 for suspected, 2 for lost. Of two rumours about one UAV, the
    /// one with the higher standing is newer.
    pub standing: u32,
}

/// What a UAV tells its ring neighbours, once a tick.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct UavState {
    /// The tick this state belongs to; grows by one, so a gap is a lost sample.
    pub tick: Tick,
    /// Position in the local frame (x east, y north), metres.
    pub position_m: [f64; 2],
    /// Heading from the x axis, counterclockwise, in (-pi, pi].
    pub heading_rad: f64,
    /// Speed through the air, along the heading, from this tick on.
    pub speed_m_s: f64,
    /// Rate of the heading, from this tick on.
    pub turn_rate_rad_s: f64,
    /// The sender.
    pub uav: UavId,
    /// Zero; keeps the layout free of padding.
    pub reserved: u32,
    /// Losses and returns that the sender passes on; all empty in an undisturbed flight.
    pub rumours: [Rumour; RUMOURS],
}
