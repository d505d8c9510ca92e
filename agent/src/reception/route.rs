//! Names a link: its two ends, and how long it takes without faults.
//!
//! Never knows the faults of the link.

use ringwing_flight::{LinkSource, UavId};

/// A link in one direction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Route {
    /// The sender.
    pub source: LinkSource,
    /// The receiver.
    pub to: UavId,
    /// Ticks from the sending of a sample until it can be used, without faults: 0 for a UAV's own senses, 1 for the
    /// leader's and the other UAVs' states.
    pub latency_ticks: i64,
}
