//! Reads every cell of a sweep before the first flight, so that a mistake does not show after an hour.

use super::definition::Definition;
use crate::flight;
use std::{
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicU64, Ordering::Relaxed},
    },
    thread,
};

/// Most problems that are reported. More would only repeat the same mistake for other cells.
const LISTED: usize = 10;

/// The problems of the cells, which are to fly in the simulation if `is_simulated`: one line for each problem, in the order
/// of the cells. If there are many, only some of them, and only those found until `stops` says that nobody wants them any
/// more.
pub fn check(
    definition: &Definition,
    jobs: usize,
    is_simulated: bool,
    stops: impl Fn() -> bool + Sync,
) -> Vec<String> {
    let cells = definition.cells().unwrap_or(u64::MAX);
    let (next, found) = (AtomicU64::new(0), Mutex::new(Vec::<(u64, String)>::new()));
    let look = || {
        loop {
            let cell = next.fetch_add(1, Relaxed);
            if cell >= cells || stops() {
                return;
            }
            let problem = match definition.checked_cell(cell) {
                Ok(scenario) if is_simulated => flight::check(&scenario).err().map(|error| error.to_string()),
                Ok(scenario) => ringwing_programs::check(&scenario).err().map(|error| error.to_string()),
                Err(problem) => Some(problem.to_string()),
            };
            if let Some(problem) = problem {
                let mut found = found.lock().unwrap_or_else(PoisonError::into_inner);
                // The same value is wrong in many cells.
                for line in problem.lines() {
                    if found.iter().all(|(_, other)| other != line) {
                        found.push((cell, line.to_owned()));
                    }
                }
                if found.len() >= LISTED {
                    return;
                }
            }
        }
    };
    thread::scope(|scope| (0..jobs).for_each(|_| drop(scope.spawn(look))));
    let mut found = found.into_inner().unwrap_or_else(PoisonError::into_inner);
    found.sort_by_key(|(cell, _)| *cell);
    found.truncate(LISTED);
    found.into_iter().map(|(_, problem)| problem).collect()
}
