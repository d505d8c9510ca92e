//! Flies the candidates of a hunt on several threads, and keeps a row for each flight in a file.
//!
//! A row is appended as soon as its flight has landed. A hunt that goes on takes the rows in place of flights, so a kill
//! loses only the flights in the air. Must never let the number of threads decide anything: a generation is flown
//! to its end before the next one begins.

use super::{
    Hunt,
    candidate::Candidate,
    goal::{Badness, Goal},
    search::Search,
};
use crate::{
    files::{LineFile, ResultsError, damaged, fields_of, line_of},
    flight::Outcome,
    sweep::Crew,
};
use ringwing_scenario::{Fault, Scenario};
use std::{
    collections::HashMap,
    path::Path,
    sync::{
        atomic::{AtomicUsize, Ordering::Relaxed},
        mpsc,
    },
    thread,
};

/// The columns of the file.
const COLUMNS: [&str; 3] = ["flight", "value", "faults"];

/// When a hunt ends by itself.
#[derive(Debug, Clone, Copy)]
pub struct Limits {
    /// Most flights, with those of earlier runs.
    pub flights: u64,
    /// Flights without anything worse after which there is little hope.
    pub patience: u64,
}

/// Why a hunt has ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    /// It has flown the largest number of flights that it may.
    Flights,
    /// Nothing got worse for as long as it is patient.
    NothingWorse,
    /// Nothing can be worse than what it has found.
    Worst,
    /// It was stopped.
    Stopped,
}

/// A hunt that has ended.
pub struct Hunted {
    /// The search with everything that was flown.
    pub search: Search,
    /// Why it has ended.
    pub end: End,
    /// Number of flights that this run has flown; the others were flown by an earlier one.
    pub flown: u64,
}

/// Why a hunt cannot go on.
#[derive(Debug, thiserror::Error)]
pub enum HuntError {
    /// The rows cannot be read or written.
    #[error(transparent)]
    Results(#[from] ResultsError),
    /// A candidate cannot be flown.
    #[error("flight {0}: {1}")]
    Flight(u64, String),
}

/// The rows of a hunt, open for appending.
pub struct FlightFile {
    lines: LineFile,
    /// Flights of earlier runs: how bad they were and what was done to them, by number.
    before: HashMap<u64, (Badness, String)>,
}

impl FlightFile {
    /// Opens the rows at `path`, or begins them. A torn last row is cut off.
    ///
    /// # Errors
    /// Another process writes the file, it is no such file, or it cannot be read or written.
    pub fn open(path: &Path, goal: &Goal) -> Result<Self, ResultsError> {
        let mut before = HashMap::new();
        let lines = LineFile::open(path, &line_of(COLUMNS.iter()), |line, offset| {
            let (number, row) = parse(line, goal).ok_or_else(|| damaged(path, offset))?;
            before.insert(number, row);
            Ok(())
        })?;
        Ok(Self { lines, before })
    }

    /// Number of flights of earlier runs.
    pub fn before(&self) -> usize {
        self.before.len()
    }

    /// How bad flight `number` was, if an earlier run has flown it.
    fn flown(&self, number: u64, faults: &str) -> Result<Option<Badness>, ResultsError> {
        // The search learns from these rows. A row of other faults under the same number would lead it elsewhere
        // unnoticed.
        match self.before.get(&number) {
            Some((_, flown)) if flown != faults => Err(ResultsError::other(
                self.lines.path(),
                format!("flight {number} is that of another hunt: choose another folder with --out"),
            )),
            row => Ok(row.map(|(badness, _)| *badness)),
        }
    }

    fn append(
        &mut self,
        goal: &Goal,
        number: u64,
        badness: Badness,
        faults: &str,
    ) -> Result<(), ResultsError> {
        let fields = [number.to_string(), goal.text(badness), faults.to_owned()];
        self.lines.append(&line_of(fields.iter()))
    }
}

fn parse(line: &[u8], goal: &Goal) -> Option<(u64, (Badness, String))> {
    let fields = fields_of(line)?;
    let [number, value, faults] = fields.iter().collect::<Vec<_>>().try_into().ok()?;
    Some((number.parse().ok()?, (goal.parse(value)?, faults.to_owned())))
}

/// Flies `hunt` until it ends; `show` gets the search after each flight.
///
/// # Errors
/// A row cannot be written, or a candidate cannot be flown.
pub fn run<F, S>(
    hunt: &Hunt,
    mut file: FlightFile,
    limits: Limits,
    crew: &Crew<F, S>,
    mut show: impl FnMut(&Search),
) -> Result<Hunted, HuntError>
where
    F: Fn(&Scenario) -> Result<Outcome, String> + Sync,
    S: Fn() -> bool + Sync,
{
    let mut search = Search::new(hunt.strategy, hunt.seed, hunt.arena.shapes());
    let mut flown = 0;
    loop {
        if let Some(end) = end(&search, limits) {
            return Ok(Hunted { search, end, flown });
        }
        // Cannot overflow: `end` has ended a hunt that has flown the limit.
        search.begin_generation(limits.flights - search.flights());
        let mut left = Vec::new();
        let generation: Vec<_> =
            search.generation().map(|(number, candidate)| (number, candidate.clone())).collect();
        for (number, candidate) in generation {
            match file.flown(number, &sentences(&hunt.arena.faults(&candidate)))? {
                Some(badness) => search.land(number, badness),
                None => left.push((number, candidate)),
            }
        }
        let landed = fly_all(hunt, &left, crew, |number, candidate, badness| {
            file.append(&hunt.goal, number, badness, &sentences(&hunt.arena.faults(candidate)))?;
            search.land(number, badness);
            show(&search);
            Ok(())
        })?;
        flown += landed;
        // An error has returned above, so flights are missing only if somebody has stopped the hunt.
        if landed < left.len() as u64 {
            return Ok(Hunted { search, end: End::Stopped, flown });
        }
    }
}

fn end(search: &Search, limits: Limits) -> Option<End> {
    if search.worst().is_some_and(|worst| worst.badness == Badness::Never) {
        Some(End::Worst)
    } else if search.flights() >= limits.flights {
        Some(End::Flights)
    } else if search.since_worst() >= limits.patience {
        Some(End::NothingWorse)
    } else {
        None
    }
}

fn sentences(faults: &[Fault]) -> String {
    faults.iter().map(ToString::to_string).collect::<Vec<_>>().join("; ")
}

/// Flies all of `left` unless it is stopped, and hands each flight to `keep` as it lands; returns how many have landed.
fn fly_all<F, S>(
    hunt: &Hunt,
    left: &[(u64, Candidate)],
    crew: &Crew<F, S>,
    mut keep: impl FnMut(u64, &Candidate, Badness) -> Result<(), HuntError>,
) -> Result<u64, HuntError>
where
    F: Fn(&Scenario) -> Result<Outcome, String> + Sync,
    S: Fn() -> bool + Sync,
{
    let next = AtomicUsize::new(0);
    let fly_some = |landed: mpsc::Sender<_>| {
        // Ask before a flight is taken, and not while it flies: one in the air still lands, and its row is kept.
        while !(crew.stops)()
            && let Some((number, candidate)) = left.get(next.fetch_add(1, Relaxed))
        {
            let badness = (crew.fly)(&hunt.scenario_of(candidate)).map(|outcome| hunt.goal.badness(&outcome));
            // Nobody listens any more once a row could not be written.
            if landed.send((*number, candidate, badness)).is_err() {
                return;
            }
        }
    };
    thread::scope(|scope| {
        let (sender, landed) = mpsc::channel();
        for _ in 0..crew.jobs.min(left.len()) {
            let sender = sender.clone();
            scope.spawn(|| fly_some(sender));
        }
        // The channel ends with the last thread.
        drop(sender);
        let mut count = 0;
        for (number, candidate, badness) in landed {
            keep(number, candidate, badness.map_err(|why| HuntError::Flight(number, why))?)?;
            count += 1;
        }
        Ok(count)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        flight::fly,
        hunt::{Arena, Strategy},
    };
    use std::{fs, sync::atomic::AtomicU64};

    fn hunt() -> Hunt {
        let mut scenario = Scenario::default();
        scenario.time.duration_s = 4.0;
        scenario.formation.uavs = 3;
        let budget = "1 kill, 1 isolation of at most 1 s".parse().unwrap();
        Hunt {
            arena: Arena::new(&budget, &scenario).unwrap(),
            goal: Goal::new("closest_pair_m", None).unwrap(),
            strategy: Strategy::Evolution,
            seed: 1,
            scenario,
            budget,
        }
    }

    const LIMITS: Limits = Limits { flights: 70, patience: 1000 };

    fn simulate(scenario: &Scenario) -> Result<Outcome, String> {
        fly(scenario).map_err(|error| error.to_string())
    }

    /// The rows of a whole hunt, in order, and its worst flight.
    fn hunted(path: &Path, jobs: usize, stops: impl Fn() -> bool + Sync) -> (Vec<String>, Hunted) {
        let hunt = hunt();
        let file = FlightFile::open(path, &hunt.goal).unwrap();
        let hunted = run(&hunt, file, LIMITS, &Crew { jobs, fly: simulate, stops }, |_| {}).unwrap();
        let text = fs::read_to_string(path).unwrap();
        let mut rows: Vec<_> = text.lines().skip(1).map(ToOwned::to_owned).collect();
        rows.sort_by_key(|row| row.split(',').next().unwrap().parse::<u64>().unwrap());
        (rows, hunted)
    }

    #[test]
    fn a_hunt_does_not_depend_on_threads_and_goes_on_where_it_was_stopped() {
        let folder = tempfile::tempdir().unwrap();
        let [alone, many, stopped] = ["1", "5", "x"].map(|name| folder.path().join(name));
        let (rows, whole) = hunted(&alone, 1, || false);
        assert_eq!((rows.len(), whole.end, whole.flown), (70, End::Flights, 70));
        let (others, other) = hunted(&many, 5, || false);
        assert_eq!((others, other.search.worst()), (rows.clone(), whole.search.worst()));
        // Stopped within the first generation, and then within a later one.
        for most in [7, 41] {
            let begun = AtomicU64::new(0);
            let (_, hunted) = hunted(&stopped, 2, || begun.fetch_add(1, Relaxed) >= most);
            assert_eq!(hunted.end, End::Stopped);
        }
        let (resumed, end) = hunted(&stopped, 3, || false);
        assert_eq!((resumed, end.search.worst()), (rows, whole.search.worst()));
        assert!(end.flown < 70 - 40, "{}", end.flown);
    }

    #[test]
    fn rows_of_another_hunt_and_damaged_rows_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("flights.csv");
        let refused = |row: &str| {
            fs::write(&path, format!("flight,value,faults\n{row}\n")).unwrap();
            let hunt = hunt();
            let file = FlightFile::open(&path, &hunt.goal).map_err(HuntError::from);
            let crew = Crew { jobs: 1, fly: simulate, stops: || false };
            file.and_then(|file| run(&hunt, file, LIMITS, &crew, |_| {})).err().unwrap().to_string()
        };
        assert!(refused("0,1.5,at 1 s kill uav 1").contains("another hunt"));
        assert!(refused("0,close,at 1 s kill uav 1").contains("damaged"));
        assert!(refused("0,1.5").contains("damaged"));
    }

    #[test]
    fn a_hunt_ends_when_nothing_gets_worse_or_nothing_can_be() {
        let folder = tempfile::tempdir().unwrap();
        let crew = |fly| Crew { jobs: 2, fly, stops: || false };
        let end = |name: &str, goal: &str, limits| {
            let mut hunt = hunt();
            hunt.goal = Goal::new(goal, None).unwrap();
            let file = FlightFile::open(&folder.path().join(name), &hunt.goal).unwrap();
            run(&hunt, file, limits, &crew(simulate), |_| {}).unwrap().end
        };
        let limits = Limits { flights: 1000, patience: 40 };
        assert_eq!(end("ticks", "ticks", limits), End::NothingWorse);
        assert_eq!(end("settling", "settling_s", limits), End::Worst, "4 s are too few to settle");
    }

    #[test]
    fn a_candidate_that_cannot_be_flown_ends_the_hunt() {
        let folder = tempfile::tempdir().unwrap();
        let hunt = hunt();
        let file = FlightFile::open(&folder.path().join("x"), &hunt.goal).unwrap();
        let fly = |_: &Scenario| Err("no room".to_owned());
        let error = run(&hunt, file, LIMITS, &Crew { jobs: 2, fly, stops: || false }, |_| {}).err().unwrap();
        assert!(error.to_string().ends_with(": no room"), "{error}");
    }
}
