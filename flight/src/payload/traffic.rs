//! Which other aircraft the world lets a UAV sense.

use crate::{Tick, UavId};
use bytemuck::{Pod, Zeroable};

/// How many aircraft one [`Traffic`] has room for. More let a UAV see all of a dense swarm, and make each report larger and
/// each decision slower; fewer hide the farther aircraft from it.
pub const MAX_SENSED_AIRCRAFT: usize = 8;

/// Another aircraft, as a radar or a transponder reports it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct SensedAircraft {
    /// Position in the local frame (x east, y north), metres.
    pub position_m: [f64; 2],
    /// Heading from the x axis, counterclockwise, in (-pi, pi].
    pub heading_rad: f64,
    /// Speed along the heading.
    pub speed_m_s: f64,
    /// Rate of the heading of an aircraft that does not answer its agent. Zero for one that does: its turns last for a
    /// moment only, and to extend one over seconds would mislead.
    pub turn_rate_rad_s: f64,
    /// The UAV's number.
    pub uav: u32,
    /// 1 if its agent flies it, 0 if it flies on the last command of a silent agent or in its failsafe.
    pub is_answering: u32,
}

/// The other aircraft near one UAV, once a tick, while its collision filter is on.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Traffic {
    /// The tick at which the aircraft are as described.
    pub tick: Tick,
    /// The UAV that senses them.
    pub uav: UavId,
    /// How many entries of `aircraft` are filled.
    pub aircraft_count: u32,
    /// How many more aircraft in range did not fit; the farthest are left out.
    pub aircraft_omitted: u32,
    /// Zero; keeps the layout free of padding.
    pub reserved: u32,
    /// Aircraft in range, nearest first; the entries after `aircraft_count` are zero.
    pub aircraft: [SensedAircraft; MAX_SENSED_AIRCRAFT],
}

impl Traffic {
    /// The aircraft in range, nearest first.
    pub fn aircraft(&self) -> &[SensedAircraft] {
        &self.aircraft[..self.filled()]
    }

    /// The aircraft in range, to be changed.
    pub fn aircraft_mut(&mut self) -> &mut [SensedAircraft] {
        let filled = self.filled();
        &mut self.aircraft[..filled]
    }

    fn filled(&self) -> usize {
        // The count comes from shared memory and may be any number.
        (self.aircraft_count as usize).min(MAX_SENSED_AIRCRAFT)
    }
}
