//! Flies the flights of a sweep on several threads, and writes a row for each.
//!
//! Must never let the number of threads decide anything: a flight depends only on its cell and its seed.

use super::{
    definition::Definition,
    ledger::{FlightId, Ledger, Next},
    results::{ResultsError, RowFile},
    row::Row,
};
use crate::flight::Outcome;
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
        self.lock().flying -= 1;
        self.landed.notify_all();
    }

    fn next(&self) -> Option<FlightId> {
        let mut state = self.lock();
        loop {
            if state.is_over {
                return None;
            }
            match state.ledger.next() {
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
