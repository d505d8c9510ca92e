//! What became of the samples on links with faults.

use ringwing_flight::LinkCounts;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// What became of the samples of one link: in a frame, since its receiver started; in a summary, in the whole flight.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct LinkTotals {
    /// The link, as fault sentences name it: `2->3`.
    pub link: String,
    /// Sent early enough to be used by now.
    pub offered: u64,
    /// Used, duplicates included.
    pub delivered: u64,
    /// Delivered later than on a link without faults.
    pub late: u64,
    /// Lost on the way.
    pub lost: u64,
    /// Damaged on the way, and dropped by their receiver.
    #[serde(default)]
    pub corrupted: u64,
    /// Copies made on the way.
    pub duplicated: u64,
    /// On the way at the end, or when their receiver died.
    pub in_flight: u64,
    /// In a frame: the number of the fault that has altered a sample, counted from 1, or 0 in the count of each second. A
    /// summary has the effects of faults elsewhere.
    #[serde(skip)]
    pub acted: u32,
}

impl From<&LinkCounts> for LinkTotals {
    fn from(counts: &LinkCounts) -> Self {
        Self {
            link: counts.link(),
            offered: counts.offered,
            delivered: counts.delivered,
            late: counts.late,
            lost: counts.lost,
            corrupted: counts.corrupted,
            duplicated: counts.duplicated,
            in_flight: counts.in_flight,
            acted: counts.acted,
        }
    }
}

impl LinkTotals {
    /// Whether a count that only grows is smaller than in `earlier`.
    fn any_below(&self, earlier: &Self) -> bool {
        self.offered < earlier.offered
            || self.delivered < earlier.delivered
            || self.late < earlier.late
            || self.lost < earlier.lost
            || self.corrupted < earlier.corrupted
            || self.duplicated < earlier.duplicated
    }

    fn add(&mut self, counts: &Self) {
        // Without `acted`: it is the number of a fault and not a count.
        self.offered += counts.offered;
        self.delivered += counts.delivered;
        self.late += counts.late;
        self.lost += counts.lost;
        self.corrupted += counts.corrupted;
        self.duplicated += counts.duplicated;
        self.in_flight += counts.in_flight;
    }
}

/// Adds up the counts of every link over all its receivers: a restarted agent counts from 0 again.
#[derive(Debug, Clone, Default)]
pub(super) struct LinkTally {
    links: BTreeMap<String, Receivers>,
}

/// The receivers of one link, one after the other.
#[derive(Debug, Clone, Default)]
struct Receivers {
    /// The last counts of each receiver that has died, added up.
    before: LinkTotals,
    /// The last counts of the current one.
    now: LinkTotals,
}

impl LinkTally {
    /// Takes a count.
    pub(super) fn observe(&mut self, counts: &LinkTotals) {
        let Receivers { before, now } = self.links.entry(counts.link.clone()).or_default();
        // The totals start from `before`, which is created without a name.
        before.link.clone_from(&counts.link);
        // The counts of one receiver only grow, so smaller ones come from its successor. The first counts of a successor may be
        // late, and then some of them are larger.
        if counts.any_below(now) {
            before.add(now);
        }
        now.clone_from(counts);
    }

    /// Every link that had faults, in the order of their names.
    pub(super) fn totals(&self) -> Vec<LinkTotals> {
        let total = |receivers: &Receivers| {
            let mut total = receivers.before.clone();
            total.add(&receivers.now);
            total
        };
        self.links.values().map(total).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ringwing_flight::{LinkSource, UavId};

    fn counts(offered: u64, lost: u64) -> LinkTotals {
        LinkTotals { link: "2->3".into(), offered, lost, delivered: offered - lost, ..LinkTotals::default() }
    }

    /// The counts that only grow while a receiver lives.
    const GROWING: [fn(&mut LinkTotals) -> &mut u64; 6] = [
        |totals| &mut totals.offered,
        |totals| &mut totals.delivered,
        |totals| &mut totals.late,
        |totals| &mut totals.lost,
        |totals| &mut totals.corrupted,
        |totals| &mut totals.duplicated,
    ];

    /// Counts that all have the same value.
    fn all(value: u64) -> LinkTotals {
        let mut totals = LinkTotals { link: "2->3".into(), in_flight: value, ..LinkTotals::default() };
        for count in GROWING {
            *count(&mut totals) = value;
        }
        totals
    }

    #[test]
    fn a_frame_has_the_counts_of_a_link_by_its_name() {
        let counts = LinkCounts {
            offered: 7,
            delivered: 6,
            late: 5,
            lost: 4,
            corrupted: 3,
            duplicated: 2,
            in_flight: 1,
            acted: 8,
            ..LinkCounts::none(LinkSource::uav(UavId(2)), UavId(3))
        };
        let expected = LinkTotals {
            link: "2->3".into(),
            offered: 7,
            delivered: 6,
            late: 5,
            lost: 4,
            corrupted: 3,
            duplicated: 2,
            in_flight: 1,
            acted: 8,
        };
        assert_eq!(LinkTotals::from(&counts), expected);
    }

    #[test]
    fn one_smaller_count_is_enough_to_tell_the_next_receiver() {
        for smaller in GROWING {
            let (mut tally, mut next) = (LinkTally::default(), all(20));
            *smaller(&mut next) = 5;
            tally.observe(&all(10));
            tally.observe(&next);
            let mut expected = all(30);
            *smaller(&mut expected) = 15;
            assert_eq!(tally.totals(), [expected]);
        }
    }

    #[test]
    fn a_receiver_that_gets_nothing_new_or_has_less_on_the_way_is_still_the_same() {
        let mut tally = LinkTally::default();
        tally.observe(&all(10));
        tally.observe(&all(10));
        let arrived = LinkTotals { in_flight: 0, ..all(10) };
        tally.observe(&arrived);
        assert_eq!(tally.totals(), [arrived]);
    }

    #[test]
    fn the_counts_of_successive_receivers_add_up() {
        let mut tally = LinkTally::default();
        for one in [counts(100, 10), counts(200, 30), counts(50, 5), counts(150, 10)] {
            tally.observe(&one);
        }
        let totals = tally.totals();
        assert_eq!((totals.len(), totals[0].offered, totals[0].lost, totals[0].delivered), (1, 350, 40, 310));
        // The next receiver is first seen when it has got more than the one before, but lost less.
        tally.observe(&counts(160, 2));
        assert_eq!((tally.totals()[0].offered, tally.totals()[0].lost), (510, 42));
    }
}
