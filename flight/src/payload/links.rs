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

/// What has happened to the samples on one link since its receiver started. While the link has faults, the receiver sends
/// this once per simulated second, and when a fault alters its first sample.
///
/// `offered + duplicated == delivered + lost + corrupted + in_flight`.
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
    /// Damaged by a fault: the receiver noticed that and dropped them.
    pub corrupted: u64,
    /// Copies made by a fault.
    pub duplicated: u64,
    /// Held back by a fault, to be delivered later.
    pub in_flight: u64,
    /// The sender.
    pub from: LinkSource,
    /// The receiver.
    pub to: UavId,
    /// The fault that has altered a sample, counted from 1 in the order of the run's faults; 0 in the count of each second.
    pub acted: u32,
    /// Always 0: it fills the payload up to a multiple of eight bytes.
    pub reserved: u32,
}

impl LinkCounts {
    /// The counts of a link before anything was sent.
    pub fn none(from: LinkSource, to: UavId) -> Self {
        Self {
            tick: Tick::APPROACH,
            offered: 0,
            delivered: 0,
            late: 0,
            lost: 0,
            corrupted: 0,
            duplicated: 0,
            in_flight: 0,
            from,
            to,
            acted: 0,
            reserved: 0,
        }
    }

    /// The link's name in the fault grammar: `2->3`.
    pub fn link(&self) -> String {
        format!("{}->{}", self.from, self.to.0)
    }
}
