//! Flies the flights of a sweep on several threads, and writes a row for each.
//!
//! Must never let the number of threads decide anything: a flight depends only on its cell and its seed.

use super::{
    definition::Definition,
    ledger::{FlightId, Ledger, Next},
    results::RowFile,
    row::Row,
};
use crate::{files::ResultsError, flight::Outcome};
use ringwing_scenario::Scenario;
use std::{
    sync::{
        Condvar, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicU64, Ordering::Relaxed},
    },
    thread,
    time::Duration,
};

/// How often somebody looks whether the sweep should stop, and progress is shown. Longer delays the end after Ctrl-C;
/// shorter flickers.
const LOOK_PERIOD: Duration = Duration::from_millis(100);

/// What flies a scenario, and when to stop.
pub struct Crew<F, S> {
    /// Number of flights at the same time.
    pub jobs: usize,
    /// Flies a scenario, or says why it cannot.
    pub fly: F,
    /// Whether to stop: flights in the air still land.
    pub stops: S,
}

/// How far a sweep is.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Tally {
    /// Flights that this run of the sweep has flown.
    pub flown: u64,
    /// Those of them that did not pass.
    pub not_passed: u64,
}

/// What the threads share.
struct Shared<'a> {
    definition: &'a Definition,
    state: Mutex<State>,
    landed: Condvar,
    flown: AtomicU64,
    not_passed: AtomicU64,
}

struct State {
    ledger: Ledger,
    rows: RowFile,
    /// Why rows can no longer be written; ends the sweep.
    error: Option<ResultsError>,
    is_over: bool,
    /// Threads that still fly.
    flying: usize,
}

/// Flies everything that `ledger` has left, appends each flight to `rows`, and shows how far it is now and then.
///
/// # Errors
/// A row cannot be written.
pub fn run<F, S>(
    definition: &Definition,
    ledger: Ledger,
    rows: RowFile,
    crew: &Crew<F, S>,
    mut show: impl FnMut(Tally),
) -> Result<(RowFile, Tally), ResultsError>
where
    F: Fn(&Scenario) -> Result<Outcome, String> + Sync,
    S: Fn() -> bool + Sync,
{
    let state = State { ledger, rows, error: None, is_over: false, flying: crew.jobs };
    let shared = Shared {
        definition,
        state: Mutex::new(state),
        landed: Condvar::new(),
        flown: AtomicU64::new(0),
        not_passed: AtomicU64::new(0),
    };
    thread::scope(|scope| {
        for _ in 0..crew.jobs {
            scope.spawn(|| shared.fly_until_over(&crew.fly));
        }
        let mut state = shared.lock();
        while state.flying > 0 {
            state.is_over |= (crew.stops)();
            show(shared.tally());
            state = shared.wait(state);
        }
    });
    let tally = shared.tally();
    show(tally);
    let state = shared.state.into_inner().unwrap_or_else(PoisonError::into_inner);
    match state.error {
        Some(error) => Err(error),
        None => Ok((state.rows, tally)),
    }
}

impl Shared<'_> {
    /// Flies one flight after the other until there are no more.
    fn fly_until_over(&self, fly: impl Fn(&Scenario) -> Result<Outcome, String>) {
        let _seat = Seat(self);
        // A cell's flights differ only in their seeds, and they mostly follow one another.
        let mut prepared: Option<(u64, Result<Scenario, String>)> = None;
        while let Some(flight) = self.next() {
            let cell = match prepared.take() {
                Some((cell, scenario)) if cell == flight.cell => scenario,
                _ => self.definition.cell(flight.cell).map_err(|problem| problem.to_string()),
            };
            let outcome = cell.clone().and_then(|mut scenario| {
                scenario.seed = self.definition.seeds.first + flight.index;
                fly(&scenario)
            });
            prepared = Some((flight.cell, cell));
            self.land(flight, &Row::new(self.definition, flight, &outcome));
        }
    }

    fn next(&self) -> Option<FlightId> {
        let mut state = self.lock();
        loop {
            if state.is_over {
                return None;
            }
            match state.ledger.hand_out() {
                Next::Fly(flight) => return Some(flight),
                Next::Wait => state = self.wait(state),
                Next::Done => return None,
            }
        }
    }

    fn land(&self, flight: FlightId, row: &Row) {
        let mut state = self.lock();
        match state.rows.append(row) {
            Ok(()) => state.ledger.finish(flight, row.passed()),
            Err(error) => {
                state.is_over = true;
                // Threads still in the air can fail as well; the first error is the one to report.
                state.error.get_or_insert(error);
            }
        }
        self.flown.fetch_add(1, Relaxed);
        self.not_passed.fetch_add(u64::from(!row.passed()), Relaxed);
        drop(state);
        self.landed.notify_all();
    }

    fn tally(&self) -> Tally {
        Tally { flown: self.flown.load(Relaxed), not_passed: self.not_passed.load(Relaxed) }
    }

    // A thread that panics has not changed the state halfway: it panics while it flies, without the lock.

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn wait<'s>(&self, state: MutexGuard<'s, State>) -> MutexGuard<'s, State> {
        self.landed.wait_timeout(state, LOOK_PERIOD).unwrap_or_else(PoisonError::into_inner).0
    }
}

/// A thread's place among those that fly. A thread that panics gives it up too, so that nobody waits for it forever.
struct Seat<'s, 'a>(&'s Shared<'a>);

impl Drop for Seat<'_, '_> {
    fn drop(&mut self) {
        let mut state = self.0.lock();
        state.flying -= 1;
        // Otherwise the other threads fly the whole rest of the sweep before the scope passes the panic on.
        state.is_over |= thread::panicking();
        drop(state);
        self.0.landed.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sweep::{Columns, Draft, Shard, read_rows};
    use std::{
        panic::{AssertUnwindSafe, catch_unwind},
        path::Path,
        sync::atomic::AtomicBool,
    };

    fn sweep() -> Definition {
        let text = "scenario = \"paper-4.1\"\nseeds = 5\n[axes]\nleader.speed_m_s = [15, 16]";
        Draft::parse("x", text).unwrap().finish().unwrap()
    }

    fn fly(
        path: &Path,
        fly: impl Fn(&Scenario) -> Result<Outcome, String> + Sync,
        stops: impl Fn() -> bool + Sync,
    ) -> Tally {
        let sweep = sweep();
        let rows = RowFile::open(path, Columns::of(&sweep), |_| {}).unwrap();
        let ledger = Ledger::new(2, &sweep.seeds, Shard::WHOLE);
        run(&sweep, ledger, rows, &Crew { jobs: 3, fly, stops }, |_| {}).unwrap().1
    }

    #[test]
    fn every_flight_has_its_cell_and_its_seed_and_one_that_cannot_be_flown_says_why() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("flights.csv");
        let why = |scenario: &Scenario| Err(format!("{} {}", scenario.leader.speed_m_s, scenario.seed));
        assert_eq!(fly(&path, why, || false), Tally { flown: 10, not_passed: 10 });
        let mut rows = Vec::new();
        let read = |row: &Row| rows.push((row.values[0].clone(), row.seed, row.failure.clone().unwrap()));
        read_rows(&path, &Columns::of(&sweep()), read).unwrap();
        rows.sort();
        let expected = |speed: &str| {
            (1..=5).map(|seed| (speed.to_owned(), seed, format!("{speed} {seed}"))).collect::<Vec<_>>()
        };
        assert_eq!(rows, [expected("15"), expected("16")].concat());
    }

    #[test]
    fn a_sweep_that_is_stopped_lands_what_is_in_the_air_and_flies_no_more() {
        let folder = tempfile::tempdir().unwrap();
        let is_asked = AtomicBool::new(false);
        // A flight of each of the three threads is in the air when the sweep is stopped.
        let in_the_air = |_: &Scenario| {
            while !is_asked.load(Relaxed) {
                thread::yield_now();
            }
            Err("no".into())
        };
        let stops = || {
            is_asked.store(true, Relaxed);
            true
        };
        let tally = fly(&folder.path().join("flights.csv"), in_the_air, stops);
        assert!(tally.flown <= 3, "{tally:?}");
    }

    #[test]
    fn a_flight_that_panics_ends_the_sweep_instead_of_leaving_it_waiting() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("flights.csv");
        let flown =
            catch_unwind(AssertUnwindSafe(|| fly(&path, |_| panic!("a mistake in the law"), || false)));
        assert!(flown.is_err());
    }
}
