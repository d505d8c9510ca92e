//! Whether hunting beats chance: both get the same number of flights.

use super::*;
use crate::{flight::fly, statistics::quantile, sweep::Crew};
use ringwing_scenario::Source;
use std::{env, num::NonZero, thread};

/// A flight that is hunted, by its budget and its goal.
#[derive(Clone, Copy)]
struct Case {
    preset: &'static str,
    duration_s: f64,
    budget: &'static str,
    goal: &'static str,
}

impl Case {
    fn hunt(self, strategy: Strategy, seed: u64) -> Hunt {
        let mut scenario = Scenario::read(&Source::find(self.preset).unwrap(), &[]).unwrap();
        scenario.time.duration_s = self.duration_s;
        let budget: Budget = self.budget.parse().unwrap();
        let arena = Arena::new(&budget, &scenario).unwrap();
        Hunt { scenario, budget, arena, goal: Goal::new(self.goal, None).unwrap(), strategy, seed }
    }

    /// How bad the worst of `flights` is.
    fn worst(self, strategy: Strategy, seed: u64, flights: u64) -> f64 {
        let hunt = self.hunt(strategy, seed);
        let folder = tempfile::tempdir().unwrap();
        let file = FlightFile::open(&folder.path().join("flights.csv"), &hunt.goal).unwrap();
        let fly = |scenario: &Scenario| fly(scenario).map_err(|error| error.to_string());
        let jobs = thread::available_parallelism().map_or(1, NonZero::get);
        let limits = Limits { flights, patience: u64::MAX };
        let hunted = run(&hunt, file, limits, &Crew { jobs, fly, stops: || false }, |_| {}).unwrap();
        match hunted.search.worst().unwrap().badness {
            Badness::Of(badness) => badness,
            Badness::Nothing => f64::NEG_INFINITY,
            Badness::Never => f64::INFINITY,
        }
    }

    /// The worst flights of evolution and of chance, seed by seed.
    fn compared(self, seeds: u64, flights: u64) -> Vec<[f64; 2]> {
        let worst = |seed| {
            [Strategy::Evolution, Strategy::Random].map(|strategy| self.worst(strategy, seed, flights))
        };
        (1..=seeds).map(worst).collect()
    }
}

fn wins(compared: &[[f64; 2]]) -> usize {
    compared.iter().filter(|[evolution, random]| evolution > random).count()
}

#[test]
fn a_hunt_finds_worse_flights_than_chance_does() {
    let case = Case {
        preset: "dropout",
        duration_s: 36.0,
        budget: "1 kill, 1 freeze of at most 2 s, from 14 s to 29 s",
        goal: "closest_pair_m",
    };
    let compared = case.compared(4, 96);
    assert!(wins(&compared) >= 3, "{compared:?}");
}

/// The table of the manual: 20 seeds of each case. `RINGWING_HUNT_FLIGHTS` sets the number of flights of each hunt.
#[test]
#[ignore = "flies 16,000 flights, for half an hour on two cores in release"]
fn a_hunt_beats_chance_over_twenty_seeds() {
    let flights = env::var("RINGWING_HUNT_FLIGHTS").map_or(200, |text| text.parse().expect("a number"));
    let budget = "2 kills, 1 link fault of at most 1 s, loss at most 30 %";
    let cases = [
        Case { preset: "dropout", duration_s: 90.0, budget, goal: "closest_pair_m" },
        Case { preset: "storm", duration_s: 150.0, budget, goal: "closest_pair_m" },
    ];
    let all_wins = cases.map(|case| {
        let compared = case.compared(20, flights);
        let [hunted, by_chance] = [0, 1].map(|side| {
            let mut values: Vec<_> = compared.iter().map(|both| both[side].abs()).collect();
            quantile(&mut values, 0.5).unwrap()
        });
        let wins = wins(&compared);
        let Case { preset, goal, .. } = case;
        println!(
            "{preset}, {goal}: median {hunted:.3} by hunting, {by_chance:.3} by chance; worse in {wins} of 20"
        );
        println!("{compared:.3?}");
        wins
    });
    // By chance alone, 15 of 20 or more come with a probability of 2 %.
    assert!(all_wins.iter().all(|wins| *wins >= 15), "{all_wins:?}");
}
