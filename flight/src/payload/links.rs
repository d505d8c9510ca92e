//! Counts of what happened to the samples on a link with faults.

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
    /// The leader's process.
    pub const LEADER: Self = Self(0);
    /// The receiver's own airframe: what it senses of itself.
    pub const OWN: Self = Self(u32::MAX);
    /// The receiver's own airframe: which other aircraft it senses.
    pub const TRAFFIC: Self = Self(u32::MAX - 1);

    /// The agent of `uav`.
    pub fn uav(uav: UavId) -> Self {
        // UAVs have numbers from 1 to 1024, so neither 0 nor one of the two largest numbers is a UAV.
        Self(uav.0)
    }

    /// The UAV's number, 0 for the leader, the largest number for the receiver's own airframe, and the one below for
    /// the traffic.
    pub fn number(self) -> u32 {
        self.0
    }
}

impl fmt::Display for LinkSource {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::LEADER => f.write_str("leader"),
            Self::OWN => f.write_str("own"),
            Self::TRAFFIC => f.write_str("traffic"),
            Self(uav) => uav.fmt(f),
        }
    }
}

/// What has happened to the samples on one link since its receiver started. The receiver sends this once per simulated
/// second while the link has faults.
///
/// `offered + duplicated == delivered + lost + in_flight`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct LinkCounts {
    /// The tick of this count.
    pub tick: Tick,
    /// Sent early enough that a link without faults would have delivered them by now.
    pub offered: u64,
    /// Delivered to the receiver, duplicates included.
    pub delivered: u64,
    /// Delivered later than on a link without faults.
    pub late: u64,
    /// Dropped by a fault.
    pub lost: u64,
    /// Copies made by a fault.
    pub duplicated: u64,
    /// Held back by a fault, to be delivered later.
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

    /// The link's name in the fault grammar: `2->3`.
    pub fn link(&self) -> String {
        format!("{}->{}", self.from, self.to.0)
    }
}
