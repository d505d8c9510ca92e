//! What became of samples on links with faults: as the log tells it, `/links`, and in all.

use ringwing_flight::LinkCounts as Counts;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// What has become of the samples of one link since its receiver began, once a second while it has faults: `/links`.
///
/// `offered + duplicated = delivered + lost + in_flight`.
#[derive(Clone, PartialEq, foxglove::Encode, prost::Message)]
pub struct LinkCounts {
    /// The tick of this count.
    #[prost(sint64, tag = "1")]
    pub tick: i64,
    /// The link, as sentences call it: `2->3`.
    #[prost(string, tag = "2")]
    pub link: String,
    /// Sent, and early enough to be used by now.
    #[prost(uint64, tag = "3")]
    pub offered: u64,
    /// Used, duplicates too.
    #[prost(uint64, tag = "4")]
    pub delivered: u64,
    /// Of those delivered, how many came later than on a sound link.
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

impl From<&Counts> for LinkCounts {
    fn from(counts: &Counts) -> Self {
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

/// What became of the samples of one link in all; what was on its way to a receiver that died died with it.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct LinkTotals {
    /// The link, as sentences call it: `2->3`.
    pub link: String,
    /// Sent.
    pub offered: u64,
    /// Used, duplicates too.
    pub delivered: u64,
    /// Of those delivered, how many came later than on a sound link.
    pub late: u64,
    /// Lost on the way.
    pub lost: u64,
    /// Copies made on the way.
    pub duplicated: u64,
    /// On the way at the end, or as their receiver died.
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

/// Adds up the counts of every link over all its receivers, one after the other.
#[derive(Debug, Clone, Default)]
pub(crate) struct LinkTally {
    links: BTreeMap<String, (LinkTotals, LinkCounts)>,
}

impl LinkTally {
    /// Takes a count.
    pub(crate) fn observe(&mut self, counts: &LinkCounts) {
        let (before, now) = self.links.entry(counts.link.clone()).or_default();
        before.link.clone_from(&counts.link);
        // Counts only grow, unless another receiver has begun anew.
        if counts.offered < now.offered {
            before.add(now);
        }
        now.clone_from(counts);
    }

    /// All links that had faults.
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
    fn receivers_one_after_the_other_add_up() {
        let mut tally = LinkTally::default();
        for one in [counts(100, 10), counts(200, 30), counts(50, 5), counts(150, 10)] {
            tally.observe(&one);
        }
        let totals = tally.totals();
        assert_eq!((totals.len(), totals[0].offered, totals[0].lost, totals[0].delivered), (1, 350, 40, 310));
    }
}
