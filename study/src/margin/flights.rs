//! Flies one scenario with one seed after the other, on several threads, until a trial is decided.
//!
//! Must never let the number of threads decide anything: flights count in the order of their seeds, and those that come
//! after the deciding one do not count.

use super::trial::{Decision, Trial};
use ringwing_scenario::Scenario;
use std::{
    sync::{Condvar, Mutex, MutexGuard, PoisonError},
    thread,
    time::Duration,
};

/// How often somebody looks whether to stop, and progress is shown. Longer delays the end after Ctrl-C.
const LOOK_PERIOD: Duration = Duration::from_millis(100);

/// What flies, and when to stop.
pub struct Pilots<'a> {
    /// Number of flights at the same time.
    pub jobs: usize,
    /// Flies a scenario: whether it passed, or why it cannot fly.
    pub fly: &'a (dyn Fn(&Scenario) -> Result<bool, String> + Sync),
    /// Whether to stop: flights in the air still land.
    pub stops: &'a (dyn Fn() -> bool + Sync),
}

struct State {
    trial: Trial,
    /// Flights that have begun, and those that count already.
    begun: u64,
    counted: u64,
    /// Results that wait for those of smaller seeds.
    landed: Vec<(u64, bool)>,
    error: Option<String>,
    is_over: bool,
    flying: usize,
}

/// Flies `scenario` with `seed`, `seed` + 1 and so on until `trial` is decided or has `most` flights; then returns it.
/// `None` if it was stopped.
///
/// # Errors
/// A scenario cannot fly.
pub(super) fn fly_trial(
    scenario: &Scenario,
    seed: u64,
    most: u64,
    trial: Trial,
    pilots: &Pilots,
    mut show: impl FnMut(&Trial),
) -> Result<Option<Trial>, String> {
    // At least one thread: without any, nothing would be flown, and the trial would look as if it was stopped.
    let jobs = pilots.jobs.min(most as usize).max(1);
    let state =
        State { trial, begun: 0, counted: 0, landed: Vec::new(), error: None, is_over: false, flying: jobs };
    let (state, landed) = (Mutex::new(state), Condvar::new());
    thread::scope(|scope| {
        for _ in 0..jobs {
            scope.spawn(|| {
                let _seat = Seat { state: &state, landed: &landed };
                while let Some(number) = begin(&state, most) {
                    let result = (pilots.fly)(&Scenario { seed: seed + number, ..scenario.clone() });
                    lock(&state).land(number, result, most);
                    landed.notify_all();
                }
            });
        }
        let mut guard = lock(&state);
        while guard.flying > 0 {
            show(&guard.trial);
            if (pilots.stops)() {
                guard.is_over = true;
            }
            guard = landed.wait_timeout(guard, LOOK_PERIOD).unwrap_or_else(PoisonError::into_inner).0;
        }
    });
    let state = state.into_inner().unwrap_or_else(PoisonError::into_inner);
    match state.error {
        Some(error) => Err(error),
        None => Ok(state.is_done(most).then_some(state.trial)),
    }
}

impl State {
    fn land(&mut self, number: u64, result: Result<bool, String>, most: u64) {
        match result {
            Ok(passed) => self.landed.push((number, passed)),
            Err(error) => {
                self.is_over = true;
                self.error.get_or_insert(error);
            }
        }
        while let Some(place) = self.landed.iter().position(|(number, _)| *number == self.counted)
            && !self.is_done(most)
        {
            self.trial.note(self.landed.swap_remove(place).1);
            self.counted += 1;
        }
        self.is_over |= self.is_done(most);
    }

    fn is_done(&self, most: u64) -> bool {
        self.counted == most || self.trial.decision() != Decision::Undecided
    }
}

/// The number of the next flight; `None` after the last.
fn begin(state: &Mutex<State>, most: u64) -> Option<u64> {
    let mut state = lock(state);
    if state.is_over || state.begun == most {
        return None;
    }
    state.begun += 1;
    Some(state.begun - 1)
}

fn lock(state: &Mutex<State>) -> MutexGuard<'_, State> {
    // A thread that panics while it flies has not changed the state halfway.
    state.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A thread's place among those that fly; leaves it even when the thread panics, so that nobody waits for it.
struct Seat<'a> {
    state: &'a Mutex<State>,
    landed: &'a Condvar,
}

impl Drop for Seat<'_> {
    fn drop(&mut self) {
        lock(self.state).flying -= 1;
        self.landed.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

    fn flown(
        jobs: usize,
        fly: &(dyn Fn(&Scenario) -> Result<bool, String> + Sync),
    ) -> Result<Option<Trial>, String> {
        let pilots = Pilots { jobs, fly, stops: &|| false };
        fly_trial(&Scenario::default(), 1, 300, Trial::new(0.95, 0.01), &pilots, |_| {})
    }

    #[test]
    fn the_number_of_threads_does_not_change_which_flights_count() {
        // Seeds land out of order, and every sixth fails.
        let fly = |scenario: &Scenario| {
            thread::sleep(Duration::from_micros(scenario.seed * 7 % 500));
            Ok(!scenario.seed.is_multiple_of(6))
        };
        let alone = flown(1, &fly).unwrap().unwrap();
        assert_eq!(alone.decision(), Decision::Below);
        for jobs in [2, 5, 16] {
            assert_eq!(flown(jobs, &fly).unwrap().unwrap(), alone, "{jobs} jobs");
        }
    }

    #[test]
    fn a_scenario_that_cannot_fly_ends_the_trial() {
        let fly = |scenario: &Scenario| if scenario.seed == 3 { Err("no room".into()) } else { Ok(true) };
        assert_eq!(flown(2, &fly), Err("no room".into()));
    }

    #[test]
    fn a_trial_that_is_stopped_gives_no_result() {
        let begun = AtomicU64::new(0);
        let fly = |_: &Scenario| {
            begun.fetch_add(1, Relaxed);
            Ok(true)
        };
        let pilots = Pilots { jobs: 2, fly: &fly, stops: &|| begun.load(Relaxed) > 20 };
        let trial = fly_trial(&Scenario::default(), 1, u64::MAX, Trial::new(0.95, 1e-300), &pilots, |_| {});
        assert_eq!(trial, Ok(None));
    }
}
