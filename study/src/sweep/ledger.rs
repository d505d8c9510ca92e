//! Which flights of a sweep are done, and which is next.
//!
//! A cell with a precision gets flights in batches, and whether it needs another batch depends only on its own flights in
//! the order of their seeds. So the number of flights does not depend on how many fly at once.
//!
//! Never flies and never waits.

use super::{definition::Seeds, shard::Shard};
use crate::statistics::wilson;
use std::collections::{HashMap, VecDeque};

/// One flight of a sweep.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct FlightId {
    /// Number of its cell.
    pub cell: u64,
    /// Its place among the seeds of the cell, from 0.
    pub index: u64,
}

/// A set of numbers below a limit, one bit each: a sweep of a hundred thousand flights takes 12 KiB.
#[derive(Debug, Clone, Default)]
struct Bits(Vec<u64>);

impl Bits {
    fn has(&self, number: u64) -> bool {
        self.0.get((number / 64) as usize).is_some_and(|word| word >> (number % 64) & 1 == 1)
    }

    fn add(&mut self, number: u64) {
        let place = (number / 64) as usize;
        if self.0.len() <= place {
            self.0.resize(place + 1, 0);
        }
        self.0[place] |= 1 << (number % 64);
    }
}

/// The flights of a sweep, or of a shard of it.
#[derive(Debug)]
pub struct Ledger {
    cells: u64,
    seeds: Seeds,
    shard: Shard,
    /// Flights that are done, by cell and index.
    done: Bits,
    /// Flights that passed.
    passed: Bits,
    /// Flights that were handed out; those that are done count as handed out.
    issued: Bits,
    /// The next cell that has not been looked at.
    cursor: u64,
    /// The cell that is being handed out, and its next flight.
    current: Option<FlightId>,
    /// Cells that need another batch.
    again: VecDeque<u64>,
    /// For cells with unfinished batches: the number of flights that they need for now.
    targets: HashMap<u64, u64>,
    in_flight: u64,
}

/// What to do next.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Next {
    /// Fly this one.
    Fly(FlightId),
    /// Wait for a flight in the air: whether there are more depends on how it goes.
    Wait,
    /// All is done.
    Done,
}

impl Ledger {
    /// The flights of `cells` cells that belong to `shard`.
    pub fn new(cells: u64, seeds: &Seeds, shard: Shard) -> Self {
        Self {
            cells,
            seeds: seeds.clone(),
            shard,
            done: Bits::default(),
            passed: Bits::default(),
            issued: Bits::default(),
            cursor: 0,
            current: None,
            again: VecDeque::new(),
            targets: HashMap::new(),
            in_flight: 0,
        }
    }

    fn number(&self, flight: FlightId) -> u64 {
        // Multiply by `max`, not `count`: a cell with a precision can grow, and must not reach the next one's numbers.
        flight.cell * self.seeds.max + flight.index
    }

    /// Notes a flight that an earlier run of the sweep has flown; call it before the first [`Self::hand_out`]. Returns whether
    /// it belongs to the sweep and is new.
    pub fn note_flown(&mut self, flight: FlightId, passed: bool) -> bool {
        let is_mine = flight.cell < self.cells && flight.index < self.seeds.max;
        if !is_mine || self.done.has(self.number(flight)) {
            return false;
        }
        self.enter(flight, passed);
        true
    }

    fn enter(&mut self, flight: FlightId, passed: bool) {
        let number = self.number(flight);
        // Flights of an earlier run were never handed out by this ledger, and must not be.
        self.issued.add(number);
        self.done.add(number);
        if passed {
            self.passed.add(number);
        }
    }

    /// The next flight.
    pub fn hand_out(&mut self) -> Next {
        loop {
            if let Some(flight) = self.next_of_current() {
                self.issued.add(self.number(flight));
                self.in_flight += 1;
                return Next::Fly(flight);
            }
            // Cells already begun come first, so that few of them are open at the same time.
            let cell = self.again.pop_front().or_else(|| self.next_cell());
            match cell {
                // A later batch begins at 0 as well: `issued` skips what somebody already has.
                Some(cell) => self.current = Some(FlightId { cell, index: 0 }),
                None if self.in_flight > 0 => return Next::Wait,
                None => return Next::Done,
            }
        }
    }

    /// The next flight of the current cell that nobody has, if there is one.
    fn next_of_current(&mut self) -> Option<FlightId> {
        let FlightId { cell, mut index } = self.current?;
        loop {
            let Some(target) = self.target(cell) else {
                self.current = None;
                return None;
            };
            while index < target {
                let flight = FlightId { cell, index };
                index += 1;
                if self.is_mine(flight) && !self.issued.has(self.number(flight)) {
                    self.current = Some(FlightId { cell, index });
                    return Some(flight);
                }
            }
            // With everything of the batch done already, by an earlier run, the next batch may begin.
            if !self.raise_target(cell) {
                self.current = None;
                return None;
            }
        }
    }

    fn next_cell(&mut self) -> Option<u64> {
        let cell = self.cursor;
        (cell < self.cells).then(|| self.cursor += 1)?;
        // Without a precision, a shard can have single flights of any cell.
        if self.seeds.precision.is_none() || self.shard.has(cell) {
            self.targets.insert(cell, self.seeds.count);
        }
        Some(cell)
    }

    /// The number of flights that `cell` needs for now; `None` if it needs no more.
    fn target(&self, cell: u64) -> Option<u64> {
        self.targets.get(&cell).copied()
    }

    /// With a precision, a cell belongs to one shard as a whole: only a shard that has all its flights can tell whether
    /// they suffice.
    fn is_mine(&self, flight: FlightId) -> bool {
        self.seeds.precision.is_some() || self.shard.has(self.number(flight))
    }

    /// If all flights up to the target are done, asks for another batch, or forgets the cell if it needs none. Returns
    /// whether there is another batch.
    fn raise_target(&mut self, cell: u64) -> bool {
        let Some(target) = self.target(cell) else { return false };
        if self.seeds.precision.is_none() {
            // All of the cell is handed out, and nothing depends on how it goes.
            self.targets.remove(&cell);
            return false;
        }
        let numbers = || (0..target).map(|index| self.number(FlightId { cell, index }));
        // Judge complete batches only: otherwise the number of flights depends on which of them land first.
        if !numbers().all(|number| self.done.has(number)) {
            return false;
        }
        let passed = numbers().filter(|number| self.passed.has(*number)).count() as u64;
        if target >= self.seeds.max || self.is_narrow(passed, target) {
            self.targets.remove(&cell);
            return false;
        }
        self.targets.insert(cell, (target + self.seeds.count).min(self.seeds.max));
        true
    }

    fn is_narrow(&self, passed: u64, flights: u64) -> bool {
        let interval = wilson(passed, flights);
        self.seeds.precision.is_none_or(|width| interval.high - interval.low <= width)
    }

    /// Notes a flight that [`Self::hand_out`] has handed out.
    pub fn finish(&mut self, flight: FlightId, passed: bool) {
        self.in_flight -= 1;
        self.enter(flight, passed);
        // The cell that is being handed out raises its own target when it gets there.
        let is_current = self.current.is_some_and(|current| current.cell == flight.cell);
        if self.seeds.precision.is_some() && !is_current && self.raise_target(flight.cell) {
            self.again.push_back(flight.cell);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn seeds(count: u64, precision: Option<f64>, max: u64) -> Seeds {
        Seeds { first: 1, count, precision, max }
    }

    /// Flies everything with up to `jobs` at once, which land out of order; returns the flights in order.
    fn flown(ledger: &mut Ledger, jobs: usize, passes: impl Fn(FlightId) -> bool) -> Vec<FlightId> {
        let (mut air, mut all) = (Vec::new(), Vec::new());
        loop {
            let next = ledger.hand_out();
            if let Next::Fly(flight) = next {
                assert!(!all.contains(&flight), "{flight:?} twice");
                all.push(flight);
                air.push(flight);
            }
            if next == Next::Wait || air.len() >= jobs {
                let landed = air.remove(all.len() % air.len());
                ledger.finish(landed, passes(landed));
            } else if next == Next::Done {
                break;
            }
        }
        all.sort_unstable();
        all
    }

    #[test]
    fn every_flight_is_handed_out_once() {
        let all = flown(&mut Ledger::new(3, &seeds(4, None, 4), Shard::WHOLE), 1, |_| true);
        assert_eq!(all.len(), 12);
        assert_eq!(all[5], FlightId { cell: 1, index: 1 });
    }

    #[test]
    fn what_was_flown_before_is_not_flown_again() {
        let mut ledger = Ledger::new(2, &seeds(3, None, 3), Shard::WHOLE);
        assert!(ledger.note_flown(FlightId { cell: 0, index: 1 }, true));
        assert!(!ledger.note_flown(FlightId { cell: 0, index: 1 }, true), "twice");
        assert!(!ledger.note_flown(FlightId { cell: 2, index: 0 }, true), "of another sweep");
        let all = flown(&mut ledger, 2, |_| true);
        assert_eq!(all.len(), 5);
        assert!(!all.contains(&FlightId { cell: 0, index: 1 }));
    }

    #[test]
    fn shards_share_the_flights_without_overlap_and_without_gap() {
        for seeds in [seeds(5, None, 5), seeds(5, Some(0.4), 40)] {
            let passes = |flight: FlightId| !(flight.cell + flight.index).is_multiple_of(3);
            let whole = flown(&mut Ledger::new(7, &seeds, Shard::WHOLE), 3, passes);
            let shard = |number| flown(&mut Ledger::new(7, &seeds, Shard { number, count: 4 }), 3, passes);
            let mut parts: Vec<_> = (1..=4).flat_map(shard).collect();
            parts.sort_unstable();
            assert_eq!(parts, whole);
        }
    }

    #[test]
    fn a_cell_gets_flights_until_its_interval_is_narrow_whatever_the_number_of_jobs() {
        // Cell 0 always passes, so few flights suffice; cell 1 passes half of the time.
        let passes = |flight: FlightId| flight.cell == 0 || flight.index.is_multiple_of(2);
        let seeds = seeds(10, Some(0.25), 60);
        let alone = flown(&mut Ledger::new(2, &seeds, Shard::WHOLE), 1, passes);
        let of = |cell: u64| alone.iter().filter(|flight| flight.cell == cell).count() as u64;
        let width = |passed, flights| {
            let interval = wilson(passed, flights);
            interval.high - interval.low
        };
        assert!(width(of(0), of(0)) <= 0.25 && width(of(0) - 10, of(0) - 10) > 0.25, "{}", of(0));
        assert_eq!(of(1), 60, "half and half needs as many as it may have");
        for jobs in [2, 7, 25] {
            assert_eq!(flown(&mut Ledger::new(2, &seeds, Shard::WHOLE), jobs, passes), alone, "{jobs} jobs");
        }
    }

    #[test]
    fn a_resumed_cell_gets_the_same_flights() {
        let passes = |flight: FlightId| flight.index.is_multiple_of(2);
        let seeds = seeds(10, Some(0.3), 500);
        let whole = flown(&mut Ledger::new(1, &seeds, Shard::WHOLE), 3, passes);
        for before in [1, 9, 10, 11, 25] {
            let mut ledger = Ledger::new(1, &seeds, Shard::WHOLE);
            for flight in &whole[..before] {
                ledger.note_flown(*flight, passes(*flight));
            }
            assert_eq!(flown(&mut ledger, 3, passes), whole[before..], "after {before}");
        }
    }
}
