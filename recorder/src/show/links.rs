//! Counts of samples on links with faults: the message `/links`, and the totals of a flight.
//!
//! Never knows the faults; the receivers count.

use ringwing_flight as flight;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Counts of the samples of one link since its receiver started, once a second while the link has faults: `/links`.
///
/// `offered + duplicated = delivered + lost + in_flight`.
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
}

impl From<&flight::LinkCounts> for LinkCounts {
    fn from(counts: &flight::LinkCounts) -> Self {
        Self {
            tick: counts.tick.0,
            link: counts.link(),
            offered: counts.offered,
            delivered: counts.delivered,
            late: counts.late,
            lost: counts.lost,
            duplicated: counts.duplicated,
            in_flight: counts.in_flight,
        }
    }
}

/// Counts of the samples of one link over the whole flight, summed over its successive receivers.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct LinkTotals {
    /// The link, as fault sentences name it: `2->3`.
    pub link: String,
    /// Sent.
    pub offered: u64,
    /// Used, duplicates included.
    pub delivered: u64,
    /// Delivered later than on a link without faults.
    pub late: u64,
    /// Lost on the way.
    pub lost: u64,
    /// Copies made on the way.
    pub duplicated: u64,
    /// Still on the way at the end of the flight, or when their receiver died.
    pub in_flight: u64,
}

impl LinkTotals {
    fn add(&mut self, counts: &LinkCounts) {
        self.offered += counts.offered;
        self.delivered += counts.delivered;
        self.late += counts.late;
        self.lost += counts.lost;
        self.duplicated += counts.duplicated;
        self.in_flight += counts.in_flight;
    }
}

/// Sums the counts of every link over its successive receivers.
#[derive(Debug, Clone, Default)]
pub(crate) struct LinkTally {
    /// By link: the totals of its former receivers and the last count of the current one.
    links: BTreeMap<String, (LinkTotals, LinkCounts)>,
}

impl LinkTally {
    /// Takes the newest count of a link.
    pub(crate) fn observe(&mut self, counts: &LinkCounts) {
        let (before, now) = self.links.entry(counts.link.clone()).or_default();
        before.link.clone_from(&counts.link);
        // Counts only grow, so a smaller one comes from a new receiver that started at 0.
        if counts.offered < now.offered {
            before.add(now);
        }
        now.clone_from(counts);
    }

    /// The totals of all links that had faults.
    pub(crate) fn totals(&self) -> Vec<LinkTotals> {
        let total = |(before, now): &(LinkTotals, LinkCounts)| {
            let mut total = before.clone();
            total.add(now);
            total
        };
        self.links.values().map(total).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn counts(offered: u64, lost: u64) -> LinkCounts {
        LinkCounts { link: "2->3".into(), offered, lost, delivered: offered - lost, ..LinkCounts::default() }
    }

    #[test]
    fn counts_of_successive_receivers_add_up() {
        let mut tally = LinkTally::default();
        for one in [counts(100, 10), counts(200, 30), counts(50, 5), counts(150, 10)] {
            tally.observe(&one);
        }
        let totals = tally.totals();
        assert_eq!((totals.len(), totals[0].offered, totals[0].lost, totals[0].delivered), (1, 350, 40, 310));
    }
}
