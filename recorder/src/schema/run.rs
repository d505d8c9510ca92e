//! The messages about the run as a whole: `/faults`, `/links`, `/timing` and `/timing/percentiles`.

use crate::metrics::LinkTotals;
use ringwing_flight::TickTiming;

/// The faults in force, on change and each second: `/faults`.
#[derive(Clone, PartialEq, foxglove::Encode, prost::Message)]
pub struct Faults {
    /// The tick from which these faults are in force.
    #[prost(sint64, tag = "1")]
    pub tick: i64,
    /// Number of processes that have ended and are not replaced.
    #[prost(uint32, tag = "2")]
    pub lost: u32,
    /// Number of processes that are frozen.
    #[prost(uint32, tag = "3")]
    pub frozen: u32,
    /// Number of airframes that fly, or have vanished, by their failsafe.
    #[prost(uint32, tag = "4")]
    pub failsafe: u32,
    /// Number of UAVs that have collided at any time.
    #[prost(uint32, tag = "5")]
    pub collided: u32,
    /// All faults in one line; `none` if nothing is wrong.
    #[prost(string, tag = "6")]
    pub summary: String,
    /// The lost processes.
    #[prost(string, repeated, tag = "7")]
    pub lost_names: Vec<String>,
    /// The frozen processes.
    #[prost(string, repeated, tag = "8")]
    pub frozen_names: Vec<String>,
    /// The UAVs in their failsafe.
    #[prost(string, repeated, tag = "9")]
    pub failsafe_names: Vec<String>,
    /// The UAVs that have collided.
    #[prost(string, repeated, tag = "10")]
    pub collided_names: Vec<String>,
    /// Number of link faults and delayed answers in force.
    #[prost(uint32, tag = "11")]
    pub asked: u32,
    /// The sentences that asked for these.
    #[prost(string, repeated, tag = "12")]
    pub asked_sentences: Vec<String>,
}

/// Counts of the samples of one link since its receiver started, once a second while the link has faults and when a fault
/// first alters a sample: `/links`.
///
/// `offered + duplicated = delivered + lost + corrupted + in_flight`.
#[derive(Clone, PartialEq, foxglove::Encode, prost::Message)]
pub struct LinkCounts {
    /// The tick of this count.
    #[prost(sint64, tag = "1")]
    pub tick: i64,
    /// The link, as fault sentences name it: `2->3`.
    #[prost(string, tag = "2")]
    pub link: String,
    /// Sent early enough to be used by now.
    #[prost(uint64, tag = "3")]
    pub offered: u64,
    /// Used, duplicates included.
    #[prost(uint64, tag = "4")]
    pub delivered: u64,
    /// Delivered later than on a link without faults.
    #[prost(uint64, tag = "5")]
    pub late: u64,
    /// Lost on the way.
    #[prost(uint64, tag = "6")]
    pub lost: u64,
    /// Copies made on the way.
    #[prost(uint64, tag = "7")]
    pub duplicated: u64,
    /// On the way now.
    #[prost(uint64, tag = "8")]
    pub in_flight: u64,
    /// Damaged on the way, and dropped by their receiver.
    #[prost(uint64, tag = "9")]
    pub corrupted: u64,
    /// The number of the fault that has altered a sample on this link, counted from 1 in the order of the scenario, with
    /// those added during the flight at the end; 0 in the count of each second.
    #[prost(uint32, tag = "10")]
    pub acted: u32,
}

impl LinkCounts {
    /// The message about `counts` of `tick`.
    pub(crate) fn of(tick: i64, counts: &LinkTotals) -> Self {
        Self {
            tick,
            link: counts.link.clone(),
            offered: counts.offered,
            delivered: counts.delivered,
            late: counts.late,
            lost: counts.lost,
            duplicated: counts.duplicated,
            in_flight: counts.in_flight,
            corrupted: counts.corrupted,
            acted: counts.acted,
        }
    }

    /// The counts in this message.
    pub(crate) fn counts(self) -> LinkTotals {
        // Naming every field makes the compiler refuse a new count that is forgotten here.
        let Self { tick: _, link, offered, delivered, late, lost, duplicated, in_flight, corrupted, acted } =
            self;
        LinkTotals { link, offered, delivered, late, lost, corrupted, duplicated, in_flight, acted }
    }
}

/// How long each step of a tick took, by the wall clock, every tick: `/timing`.
#[derive(Clone, PartialEq, foxglove::Encode, prost::Message)]
pub struct Timing {
    /// The tick.
    #[prost(sint64, tag = "1")]
    pub tick: i64,
    /// From the opening of the tick to the last answer.
    #[prost(double, tag = "2")]
    pub round_trip_us: f64,
    /// From the opening to the moment the last agent saw it.
    #[prost(double, tag = "3")]
    pub wake_us: f64,
    /// The longest time that an agent took to read its inputs.
    #[prost(double, tag = "4")]
    pub read_us: f64,
    /// The longest time that an agent took to compute and publish.
    #[prost(double, tag = "5")]
    pub compute_us: f64,
    /// The longest time from an agent's answer until the world read it.
    #[prost(double, tag = "6")]
    pub return_us: f64,
    /// How long after its deadline the tick was opened.
    #[prost(double, tag = "7")]
    pub late_us: f64,
    /// Number of airframes whose command of this tick arrived in time.
    #[prost(uint32, tag = "8")]
    pub answered: u32,
    /// Number of airframes that flew on an older command.
    #[prost(uint32, tag = "9")]
    pub reused: u32,
    /// Number of deadlines missed by a whole period or more.
    #[prost(uint32, tag = "10")]
    pub missed_deadlines: u32,
}

/// The round trips of the ticks since the last message, once per simulated second: `/timing/percentiles`.
#[derive(Clone, PartialEq, foxglove::Encode, prost::Message)]
pub struct TimingPercentiles {
    /// The last of these ticks.
    #[prost(sint64, tag = "1")]
    pub tick: i64,
    /// Number of these ticks.
    #[prost(uint32, tag = "2")]
    pub ticks: u32,
    /// The median.
    #[prost(double, tag = "3")]
    pub p50_us: f64,
    /// The 90th percentile.
    #[prost(double, tag = "4")]
    pub p90_us: f64,
    /// The 99th percentile.
    #[prost(double, tag = "5")]
    pub p99_us: f64,
    /// The longest.
    #[prost(double, tag = "6")]
    pub max_us: f64,
}

impl From<&TickTiming> for Timing {
    fn from(timing: &TickTiming) -> Self {
        let us = |ns: u64| ns as f64 / 1e3;
        Self {
            tick: timing.tick,
            round_trip_us: us(timing.round_trip_ns),
            wake_us: us(timing.wake_ns),
            read_us: us(timing.read_ns),
            compute_us: us(timing.compute_ns),
            return_us: us(timing.return_ns),
            late_us: us(timing.late_ns),
            answered: timing.answered,
            reused: timing.reused,
            missed_deadlines: timing.missed_deadlines,
        }
    }
}
