//! Which other aircraft the world lets a UAV sense.

use crate::{IntruderId, Tick, UavId};
use bytemuck::{Pod, Zeroable};

/// How many aircraft one [`Traffic`] has room for. More let a UAV see all of a dense swarm, and make each report larger and
/// each decision slower; fewer hide the farther aircraft from it.
pub const MAX_SENSED_AIRCRAFT: usize = 8;

/// The bit of an [`AircraftId`] that marks an intruder. UAVs have numbers up to 1024, so none of them has it.
const INTRUDER: u32 = 1 << 30;

/// Who a sensed aircraft is.
///
/// A number instead of an `enum`, so that any bytes in shared memory are a valid value.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Pod, Zeroable)]
#[repr(transparent)]
pub struct AircraftId(u32);

/// Who an [`AircraftId`] names; UAVs come before intruders.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Aircraft {
    /// A UAV of the swarm.
    Uav(UavId),
    /// An aircraft that nobody controls.
    Intruder(IntruderId),
}

impl AircraftId {
    /// The UAV.
    pub const fn uav(uav: UavId) -> Self {
        Self(uav.0)
    }

    /// The intruder.
    pub const fn intruder(intruder: IntruderId) -> Self {
        Self(INTRUDER | intruder.0)
    }

    /// The number as it travels: that of a UAV, or that of an intruder with a bit of its own.
    pub(super) fn number(self) -> u32 {
        self.0
    }

    /// What [`number`](Self::number) gave.
    pub(super) fn of_number(number: u32) -> Self {
        Self(number)
    }

    /// Who it is.
    pub fn who(self) -> Aircraft {
        // The bytes come from shared memory, so any number has to name somebody: there is no error to return.
        if self.0 & INTRUDER == 0 {
            Aircraft::Uav(UavId(self.0))
        } else {
            Aircraft::Intruder(IntruderId(self.0 & !INTRUDER))
        }
    }
}

/// Another aircraft, as a radar or a transponder reports it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct SensedAircraft {
    /// Position in the local frame (x east, y north), metres.
    pub position_m: [f64; 2],
    /// Heading from the x axis, counterclockwise, in (-pi, pi].
    pub heading_rad: f64,
    /// Speed along the heading: of a UAV through the air, of an intruder over the ground.
    pub speed_m_s: f64,
    /// Rate of the heading of a UAV that does not answer its agent. Zero for one that does: its turns last for a moment
    /// only, and to extend one over seconds would mislead. Zero for an intruder, whose turns nobody reports.
    pub turn_rate_rad_s: f64,
    /// Who it is.
    pub who: AircraftId,
    /// 1 if its agent flies it, 0 if nobody does: it flies on the last command of a silent agent or in its failsafe, or it is
    /// an intruder.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_id_names_a_uav_or_an_intruder() {
        assert_eq!(AircraftId::uav(UavId(1024)).who(), Aircraft::Uav(UavId(1024)));
        let intruder = AircraftId::intruder(IntruderId(3));
        assert_eq!(intruder.who(), Aircraft::Intruder(IntruderId(3)));
        assert_eq!(AircraftId::of_number(intruder.number()), intruder);
    }
}
