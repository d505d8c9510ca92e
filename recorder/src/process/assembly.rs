//! Groups samples by tick, in whatever order they arrive.
//!
//! Must never wait and never guess: a sample that did not arrive is absent.

use crate::metrics::{AirframeSample, TickSamples};
use ringwing_flight::{Account, LeaderState, LinkCounts, Sensed, TickTiming, UavId};
use std::collections::BTreeMap;

/// One tick, put together.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Assembled {
    /// The payloads of the tick.
    pub(crate) samples: TickSamples,
    /// How long the tick took, by the wall clock.
    pub(crate) timing: Option<TickTiming>,
}

/// Sorts samples into their ticks, and hands the ticks out in order.
#[derive(Debug)]
pub(crate) struct Assembly {
    ticks: BTreeMap<i64, Assembled>,
    /// Ticks before this one are handed out already, or are in the log of a predecessor.
    next: i64,
    /// The newest tick of any sample from the world or the leader.
    newest: Option<i64>,
    /// The newest tick of each airframe.
    newest_airframes: Vec<Option<i64>>,
    /// Handed out before and returned, to reuse their memory.
    spare: Vec<Assembled>,
}

impl Assembly {
    /// An assembly for a swarm of `uavs`, from tick `first` on.
    pub(crate) fn new(uavs: u32, first: i64) -> Self {
        let newest_airframes = vec![None; uavs as usize];
        Self { ticks: BTreeMap::new(), next: first, newest: None, newest_airframes, spare: Vec::new() }
    }

    /// Takes what `uav` sensed.
    pub(crate) fn put_sensed(&mut self, uav: UavId, sensed: &Sensed) {
        self.note(sensed.tick.0);
        self.newest_airframes[uav.index()] = Some(sensed.tick.0);
        if let Some(tick) = self.at(sensed.tick.0) {
            tick.samples.airframes[uav.index()] = Some(sensed.into());
        }
    }

    /// Takes what the agent of `uav` commanded and why.
    pub(crate) fn put_account(&mut self, uav: UavId, account: &Account) {
        if let Some(tick) = self.at(account.tick.0) {
            tick.samples.accounts[uav.index()] = Some(*account);
        }
    }

    /// Takes the leader's state.
    pub(crate) fn put_leader(&mut self, leader: &LeaderState) {
        self.note(leader.tick.0);
        if let Some(tick) = self.at(leader.tick.0) {
            tick.samples.leader = Some(*leader);
        }
    }

    /// Takes how long a tick took.
    pub(crate) fn put_timing(&mut self, timing: &TickTiming) {
        self.note(timing.tick);
        if let Some(tick) = self.at(timing.tick) {
            tick.timing = Some(*timing);
        }
    }

    /// Takes what became of samples on a link with faults.
    pub(crate) fn put_link(&mut self, counts: &LinkCounts) {
        if let Some(tick) = self.at(counts.tick.0) {
            tick.samples.links.push(*counts);
        }
    }

    /// The newest tick of the flight. Agents do not count: an agent with a wrong tick must not end the tick for all.
    pub(crate) fn newest(&self) -> Option<i64> {
        self.newest
    }

    /// Hands out the oldest tick, if it is before `end`.
    pub(crate) fn take_before(&mut self, end: i64) -> Option<Assembled> {
        let oldest = self.ticks.first_entry().filter(|entry| *entry.key() < end)?;
        let mut assembled = oldest.remove();
        let samples = &mut assembled.samples;
        let tick = samples.tick;
        self.next = tick + 1;
        // If an airframe has no sample of this tick but a newer one, its sample was overwritten. If it has neither, it
        // has left the sky.
        let is_overwritten = |(airframe, newest): (&Option<AirframeSample>, &Option<i64>)| {
            airframe.is_none() && *newest > Some(tick)
        };
        samples.torn = samples.airframes.iter().zip(&self.newest_airframes).any(is_overwritten);
        Some(assembled)
    }

    /// Takes back what [`Self::take_before`] handed out, to use its memory again.
    pub(crate) fn recycle(&mut self, assembled: Assembled) {
        self.spare.push(assembled);
    }

    fn note(&mut self, tick: i64) {
        self.newest = self.newest.max(Some(tick));
    }

    fn at(&mut self, tick: i64) -> Option<&mut Assembled> {
        if tick < self.next {
            return None;
        }
        let uavs = self.newest_airframes.len();
        let (ticks, spare) = (&mut self.ticks, &mut self.spare);
        Some(ticks.entry(tick).or_insert_with(|| {
            let mut fresh =
                spare.pop().unwrap_or_else(|| Assembled { samples: TickSamples::new(uavs), timing: None });
            fresh.samples.restart(tick);
            fresh.timing = None;
            fresh
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing;

    fn ticks_before(assembly: &mut Assembly, end: i64) -> Vec<(i64, bool)> {
        std::iter::from_fn(|| assembly.take_before(end))
            .map(|tick| (tick.samples.tick, tick.samples.torn))
            .collect()
    }

    #[test]
    fn ticks_come_out_in_order_whatever_order_they_came_in() {
        let mut assembly = Assembly::new(3, 0);
        for tick in [-1, 2, 0, 1] {
            for uav in UavId::all(3) {
                assembly.put_sensed(uav, &testing::sensed(tick, uav.0, [0.0, 0.0]));
            }
        }
        assert_eq!(ticks_before(&mut assembly, 2), [(0, false), (1, false)]);
        assert_eq!(ticks_before(&mut assembly, 3), [(2, false)]);
        assert_eq!(assembly.newest(), Some(2));
    }

    #[test]
    fn a_tick_is_torn_if_it_lacks_a_uav_that_flies_on() {
        let mut assembly = Assembly::new(3, 0);
        let flights: [&[i64]; 3] = [&[0, 1, 2, 3], &[0, 2, 3], &[0, 1]];
        for (uav, ticks) in UavId::all(3).zip(flights) {
            for tick in ticks {
                assembly.put_sensed(uav, &testing::sensed(*tick, uav.0, [0.0, 0.0]));
            }
        }
        // UAV 2 was overwritten in tick 1; UAV 3 has left the sky after it.
        assert_eq!(ticks_before(&mut assembly, 9), [(0, false), (1, true), (2, false), (3, false)]);
    }

    #[test]
    fn an_account_is_too_late_once_its_tick_is_handed_out() {
        let mut assembly = Assembly::new(3, 0);
        assembly.put_sensed(UavId(1), &testing::sensed(4, 1, [0.0, 0.0]));
        let tick = assembly.take_before(5).unwrap();
        assembly.recycle(tick);
        assembly.put_account(UavId(1), &testing::account(4, 1));
        assert_eq!(assembly.take_before(9), None);
    }
}
