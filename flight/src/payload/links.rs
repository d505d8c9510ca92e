//! What became of the samples on a link with faults.

use crate::{Tick, UavId};
use bytemuck::{Pod, Zeroable};
use std::fmt;

/// The sending end of a link.
///
/// A number instead of an `enum`, so that any bytes in shared memory are a valid value.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Pod, Zeroable)]
#[repr(transparent)]
pub struct LinkSource(u32);

impl LinkSource {
    /// The leader.
    pub const LEADER: Self = Self(0);
    /// The receiver's own airframe.
    pub const OWN: Self = Self(u32::MAX);

    /// The agent of `uav`.
    pub fn uav(uav: UavId) -> Self {
        Self(uav.0)
    }

    /// The UAV's number, 0 for the leader, and the largest number for the receiver's own airframe.
    pub fn number(self) -> u32 {
        self.0
    }
}

impl fmt::Display for LinkSource {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::LEADER => f.write_str("leader"),
            Self::OWN => f.write_str("own"),
            Self(uav) => uav.fmt(f),
        }
    }
}

/// What became of the samples of one link since its receiver started, from the receiver, once a simulated second while
/// the link has faults.
///
/// `offered + duplicated == delivered + lost + in_flight`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct LinkCounts {
    /// The tick of this count.
    pub tick: Tick,
    /// Sent early enough to be used by now.
    pub offered: u64,
    /// Used, duplicates included.
    pub delivered: u64,
    /// Delivered later than on a link without faults.
    pub late: u64,
    /// Lost on the way.
    pub lost: u64,
    /// Copies made on the way.
    pub duplicated: u64,
    /// On the way now.
    pub in_flight: u64,
    /// The sender.
    pub from: LinkSource,
    /// The receiver.
    pub to: UavId,
}

impl LinkCounts {
    /// The counts of a link before anything was sent.
    pub fn none(from: LinkSource, to: UavId) -> Self {
        let tick = Tick::APPROACH;
        Self { tick, offered: 0, delivered: 0, late: 0, lost: 0, duplicated: 0, in_flight: 0, from, to }
    }

    /// The link's name in sentences: `2->3`.
    pub fn link(&self) -> String {
        format!("{}->{}", self.from, self.to.0)
    }
}
