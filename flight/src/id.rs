//! The identities of UAVs, intruders, processes and moments.

use bytemuck::{Pod, Zeroable};
use serde::{Deserialize, Serialize};
use std::fmt;

/// The number of a UAV, from 1 to n as in the paper. Its ring neighbours are those of its [`RingOrder`](crate::RingOrder).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Pod, Zeroable, Serialize, Deserialize)]
#[repr(transparent)]
pub struct UavId(pub u32);

impl UavId {
    /// All UAVs of a swarm of `count`, in order.
    pub fn all(count: u32) -> impl ExactSizeIterator<Item = Self> + Clone {
        (0..count).map(|index| Self(index + 1))
    }

    /// The UAV's place, from 0, in arrays that hold one entry for each UAV.
    pub fn index(self) -> usize {
        self.0 as usize - 1
    }
}

impl fmt::Display for UavId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "uav {}", self.0)
    }
}

/// The number of an intruder, from 1 in the order of the scenario.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct IntruderId(pub u32);

impl fmt::Display for IntruderId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "intruder {}", self.0)
    }
}

/// One process of a run other than the launcher.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Part {
    /// Integrates the airframes and keeps time.
    World,
    /// Flies the virtual leader.
    Leader,
    /// Writes the log and measures the flight.
    Recorder,
    /// Flies one UAV.
    Agent(UavId),
}

impl Part {
    /// Every process that a swarm of `count` UAVs needs.
    pub fn all(count: u32) -> impl Iterator<Item = Self> {
        [Self::World, Self::Leader, Self::Recorder].into_iter().chain(UavId::all(count).map(Self::Agent))
    }

    /// The part's place, from 0, in arrays that hold one entry for each part.
    pub fn index(self) -> usize {
        match self {
            // These three come first, so that a UAV's place does not depend on the size of the swarm.
            Self::World => 0,
            Self::Leader => 1,
            Self::Recorder => 2,
            Self::Agent(uav) => 3 + uav.index(),
        }
    }

    /// The name under which the process joins the run, and which `top` shows: `world`, `agent-3`.
    pub fn node_name(self) -> String {
        match self {
            Self::World => "world".into(),
            Self::Leader => "leader".into(),
            Self::Recorder => "recorder".into(),
            Self::Agent(uav) => format!("agent-{}", uav.0),
        }
    }
}

impl fmt::Display for Part {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Agent(uav) => uav.fmt(f),
            other => f.write_str(&other.node_name()),
        }
    }
}

/// A moment of simulated time: tick k is at k times the period.
///
/// The flight begins at tick 0. One tick earlier, at [`Tick::APPROACH`], every process publishes its first state, so
/// that the law has the states of the neighbours from tick 0 on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Pod, Zeroable, Serialize, Deserialize)]
#[repr(transparent)]
pub struct Tick(pub i64);

impl Tick {
    /// The tick before the flight begins.
    pub const APPROACH: Self = Self(-1);

    /// The tick after this one.
    pub fn next(self) -> Self {
        Self(self.0 + 1)
    }

    /// Ticks from `earlier` to this one; negative when `earlier` is later.
    pub fn since(self, earlier: Self) -> i64 {
        self.0 - earlier.0
    }

    /// Simulated time in seconds at `rate_hz` ticks a second.
    pub fn seconds(self, rate_hz: u32) -> f64 {
        // Not times the period: 1 / rate is rounded, and the error would grow with the tick.
        self.0 as f64 / f64::from(rate_hz)
    }
}

impl fmt::Display for Tick {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "tick {}", self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_part_has_a_place_of_its_own() {
        let mut places: Vec<_> = Part::all(200).map(Part::index).collect();
        places.dedup();
        assert_eq!(places, (0..203).collect::<Vec<_>>());
    }
}
