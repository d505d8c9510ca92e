//! Groups what has come by tick, in whatever order it came.
//!
//! Must never wait and never guess: what did not come is absent.

use crate::metrics::{AirframeSample, TickSamples};
use ringwing_flight::{JournalEntry, JournalHeader, LinkCounts, Notes, TickTiming};
use std::collections::BTreeMap;

/// One tick, put together.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Assembled {
    /// The payloads of the tick.
    pub(crate) samples: TickSamples,
    /// How long the tick took, by the wall clock.
    pub(crate) timing: Option<TickTiming>,
    /// Whether the journal of the tick came. Without it nothing is known of the UAVs.
    has_journal: bool,
}

/// Sorts what comes into its ticks, and hands the ticks out in order.
#[derive(Debug)]
pub(crate) struct Assembly {
    uavs: usize,
    ticks: BTreeMap<i64, Assembled>,
    /// Ticks before this one are handed out already, or are in the log of a predecessor.
    next: i64,
    /// The newest tick of the journal.
    newest: Option<i64>,
    /// Handed out before and returned, to reuse their memory.
    spare: Vec<Assembled>,
}

impl Assembly {
    /// An assembly for a swarm of `uavs`, from tick `first` on.
    pub(crate) fn new(uavs: u32, first: i64) -> Self {
        Self { uavs: uavs as usize, ticks: BTreeMap::new(), next: first, newest: None, spare: Vec::new() }
    }

    /// Takes one tick of the journal, and how long the tick took if that is wanted.
    pub(crate) fn put_journal<'e>(
        &mut self,
        header: &JournalHeader,
        entries: impl Iterator<Item = &'e JournalEntry> + Clone,
        timing: bool,
    ) {
        let now = header.tick().0;
        self.newest = self.newest.max(Some(now));
        if let Some(tick) = self.at(now) {
            tick.has_journal = true;
            tick.timing = timing.then_some(header.timing);
            for (airframe, entry) in tick.samples.airframes.iter_mut().zip(entries.clone()) {
                let known = entry.sensed().zip(entry.truth());
                *airframe = known.map(|(sensed, truth)| AirframeSample::new(sensed, truth));
            }
        }
        // Leader and accounts carry their own ticks: in real time the world may get them late.
        if let Some(leader) = header.leader()
            && let Some(tick) = self.at(leader.tick.0)
        {
            tick.samples.leader = Some(*leader);
        }
        for (index, account) in entries.map(JournalEntry::account).enumerate() {
            if let Some(account) = account
                && let Some(tick) = self.at(account.tick.0)
                && let Some(place) = tick.samples.accounts.get_mut(index)
            {
                *place = Some(*account);
            }
        }
    }

    /// Takes what became of samples on a link with faults.
    pub(crate) fn put_link(&mut self, counts: &LinkCounts) {
        if let Some(tick) = self.at(counts.tick.0) {
            tick.samples.links.push(*counts);
        }
    }

    /// Takes what a controller has noted.
    pub(crate) fn put_notes(&mut self, notes: &Notes) {
        if let Some(tick) = self.at(notes.tick.0) {
            tick.samples.notes.push(*notes);
        }
    }

    /// The newest tick of the journal.
    pub(crate) fn newest(&self) -> Option<i64> {
        self.newest
    }

    /// Hands out the oldest tick, if it is before `end`. Leaves out ticks whose journal is lost.
    pub(crate) fn take_before(&mut self, end: i64) -> Option<Assembled> {
        loop {
            let oldest = self.ticks.first_entry().filter(|entry| *entry.key() < end)?;
            let assembled = oldest.remove();
            // Also for a tick that is left out: data that still come for it must not bring it back after a later one.
            self.next = assembled.samples.tick + 1;
            if assembled.has_journal {
                return Some(assembled);
            }
        }
    }

    /// Takes back what [`Self::take_before`] handed out, to use its memory again.
    pub(crate) fn recycle(&mut self, assembled: Assembled) {
        self.spare.push(assembled);
    }

    fn at(&mut self, tick: i64) -> Option<&mut Assembled> {
        // The frame of such a tick is written already, so what comes for it now is too late.
        if tick < self.next {
            return None;
        }
        let (uavs, ticks, spare) = (self.uavs, &mut self.ticks, &mut self.spare);
        Some(ticks.entry(tick).or_insert_with(|| {
            let mut fresh = spare.pop().unwrap_or_else(|| Assembled {
                samples: TickSamples::new(uavs),
                timing: None,
                has_journal: false,
            });
            // A recycled tick still holds the payloads of the tick that it was before.
            fresh.samples.restart(tick);
            (fresh.timing, fresh.has_journal) = (None, false);
            fresh
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing;
    use ringwing_flight::{Tick, UavId};

    /// The journal of `tick`: all `uavs` of three are in the sky.
    fn put(assembly: &mut Assembly, tick: i64, uavs: &[u32], accounts: &[i64]) {
        let mut entries = [JournalEntry::empty(); 3];
        for uav in uavs {
            let sensed = testing::sensed(tick, *uav, [0.0, 0.0]);
            entries[UavId(*uav).index()].set_sensed(&sensed, &testing::truth(&sensed));
        }
        for (entry, tick) in entries.iter_mut().zip(accounts) {
            entry.set_account(&testing::account(*tick, 1));
        }
        assembly.put_journal(&JournalHeader::of(Tick(tick)), entries.iter(), true);
    }

    fn ticks_before(assembly: &mut Assembly, end: i64) -> Vec<i64> {
        std::iter::from_fn(|| assembly.take_before(end)).map(|tick| tick.samples.tick).collect()
    }

    #[test]
    fn ticks_come_out_in_order_whatever_order_they_came_in() {
        let mut assembly = Assembly::new(3, 0);
        for tick in [-1, 2, 0, 1] {
            put(&mut assembly, tick, &[1, 2, 3], &[]);
        }
        assert_eq!(ticks_before(&mut assembly, 2), [0, 1]);
        assert_eq!(ticks_before(&mut assembly, 3), [2]);
        assert_eq!(assembly.newest(), Some(2));
    }

    #[test]
    fn a_uav_that_has_left_the_sky_has_no_airframe() {
        let mut assembly = Assembly::new(3, 0);
        put(&mut assembly, 0, &[1, 3], &[]);
        let airframes = assembly.take_before(1).unwrap().samples.airframes;
        let in_sky: Vec<bool> = airframes.iter().map(Option::is_some).collect();
        assert_eq!(in_sky, [true, false, true]);
    }

    #[test]
    fn a_late_account_belongs_to_its_own_tick_until_that_is_handed_out() {
        let mut assembly = Assembly::new(3, 0);
        put(&mut assembly, 4, &[1], &[]);
        put(&mut assembly, 5, &[1], &[4]);
        let tick = assembly.take_before(5).unwrap();
        assert!(tick.samples.accounts[0].is_some());
        assembly.recycle(tick);
        put(&mut assembly, 6, &[1], &[4]);
        assert_eq!(ticks_before(&mut assembly, 9), [5, 6]);
    }

    #[test]
    fn a_tick_whose_journal_is_lost_is_left_out() {
        let mut assembly = Assembly::new(3, 0);
        put(&mut assembly, 4, &[1], &[3]);
        assert_eq!(ticks_before(&mut assembly, 9), [4], "of tick 3 only an account came");
    }
}
