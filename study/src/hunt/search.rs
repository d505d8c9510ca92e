//! Which candidates to fly: chance first, then an evolution strategy, again and again.
//!
//! A population begins with random candidates. Then each generation descends from the worst flights of its population:
//! a child takes genes of one or two of them and changes some, by steps of every size, or moves all faults together in
//! time. A population whose generations find nothing worse is given up for another one. This is a (mu + lambda) strategy
//! with restarts (Beyer and Schwefel, *Evolution strategies*, 2002). It adapts no size of steps, because one budget has
//! numbers that are coarse, such as a target, beside others that have to hit a tenth of a second.
//!
//! Some candidates of every generation are random: most of them until one flight stands out, and few after that. In many
//! hunts, nearly all flights are about equally bad, because the faults of the budget hardly matter in them. Small changes
//! of such a flight lead nowhere.
//!
//! Never flies anything. What a candidate is depends on the seed, its number and the flights of earlier generations, so
//! neither the order in which flights land nor the number of threads changes it.

use super::{
    candidate::{Candidate, Gene, Shape},
    goal::Badness,
};
use ringwing_flight::draw::Draws;

/// Random candidates at the beginning of a population. Fewer miss the regions where flights are bad; more leave fewer
/// flights to improve on them.
const SCOUTS: usize = 32;
/// Flights of a population that have children. Fewer get stuck earlier; more take longer to improve.
const PARENTS: usize = 3;
/// Children of a generation. More use more threads, and learn later from what was flown.
const CHILDREN: usize = 16;
/// Generations without progress after which a population is given up. More search longer where there is nothing.
const STALE_GENERATIONS: usize = 5;
/// Share of random candidates among the later generations once a flight stands out. Fewer rarely leave a region that is not
/// the worst; more are closer to random search.
const RANDOM: f64 = 0.2;
/// The same share until then. With fewer, the search wastes flights on changes that do not matter; with more, it is slower
/// where small steps would have led to a bad flight.
const RANDOM_BEFORE: f64 = 0.8;
/// How many of the worst random flights are left out when the search decides what is usual. With fewer, a few bad flights
/// keep the next one from standing out; with more, ordinary flights stand out.
const UNUSUAL: usize = 5;
/// A flight stands out if its distance from the worst usual flight exceeds this share of that flight's distance from the
/// median. With less, ordinary flights stand out; with more, small steps begin too late.
const STANDS_OUT: f64 = 0.5;
/// Share of children whose faults all move by the same time. Fewer lose what two faults do together, because a fault
/// that moves alone destroys it; more leave fewer children that try anything else.
const MOVED_TOGETHER: f64 = 0.2;
/// Share of children with two parents. The others inherit from one.
const CROSSED: f64 = 0.3;
/// Share of changes of a target or kind; the others are steps of a number. More are closer to random search.
const REDRAWN: f64 = 0.3;
/// The smallest and the largest step of a number, as shares of its range. The smallest is a few ticks of a window of
/// half a minute; the largest is nearly chance.
const STEPS: [f64; 2] = [0.001, 0.3];
/// Separates these draws from those of the flights ("hunt" in ASCII). Another value gives other candidates.
const PURPOSE: [u64; 3] = [0x6875_6e74, 0, 0];

/// How candidates are chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Strategy {
    /// Random candidates, and descendants of the worst of them.
    Evolution,
    /// Random candidates only: what any strategy has to beat.
    Random,
}

/// A candidate that was flown.
#[derive(Debug, Clone, PartialEq)]
pub struct Flown {
    /// Number of its flight, from 0.
    pub number: u64,
    /// The candidate.
    pub candidate: Candidate,
    /// How bad its flight was.
    pub badness: Badness,
}

/// A search, between two generations or within one.
#[derive(Debug, Clone)]
pub struct Search {
    strategy: Strategy,
    seed: u64,
    shapes: Vec<Shape>,
    /// Number of the first candidate of the generation.
    first: u64,
    generation: Vec<Candidate>,
    /// Which candidates of the generation are random.
    is_random: Vec<bool>,
    landed: Vec<Option<Badness>>,
    /// How bad the random candidates of all populations were.
    by_chance: Vec<Badness>,
    /// The worst flights of the population, the worst first.
    parents: Vec<Flown>,
    /// Generations since the population last found something worse.
    stale: usize,
    /// Number of populations that were begun.
    populations: u64,
    worst: Option<Flown>,
}

impl Search {
    /// A search among candidates with genes of these shapes, before its first generation.
    pub fn new(strategy: Strategy, seed: u64, shapes: Vec<Shape>) -> Self {
        Self {
            strategy,
            seed,
            shapes,
            first: 0,
            generation: Vec::new(),
            is_random: Vec::new(),
            landed: Vec::new(),
            by_chance: Vec::new(),
            parents: Vec::new(),
            stale: 0,
            populations: 0,
            worst: None,
        }
    }

    /// Begins the next generation, of at most `most` candidates; the flights of the one before have all landed.
    pub fn begin_generation(&mut self, most: u64) {
        self.end_generation();
        let is_new = self.parents.is_empty() || self.stale >= STALE_GENERATIONS;
        if is_new {
            self.parents.clear();
            self.stale = 0;
            self.populations += 1;
        }
        let count = if is_new { SCOUTS } else { CHILDREN }.min(most as usize);
        let random = if self.stands_out() { RANDOM } else { RANDOM_BEFORE };
        let candidates = (self.first..).take(count).map(|number| self.candidate(number, random));
        (self.generation, self.is_random) = candidates.unzip();
        self.landed = vec![None; count];
    }

    /// The candidates of the generation with the numbers of their flights, in order.
    pub fn generation(&self) -> impl Iterator<Item = (u64, &Candidate)> {
        (self.first..).zip(&self.generation)
    }

    /// Takes the flight `number` of the generation.
    pub fn land(&mut self, number: u64, badness: Badness) {
        let place = (number - self.first) as usize;
        self.landed[place] = Some(badness);
        // The lower number counts where two flights are equally bad: flights land in any order.
        let is_worse = self.worst.as_ref().is_none_or(|worst| {
            badness > worst.badness || (badness == worst.badness && number < worst.number)
        });
        if is_worse {
            self.worst = Some(Flown { number, candidate: self.generation[place].clone(), badness });
        }
    }

    /// The worst flight so far.
    pub fn worst(&self) -> Option<&Flown> {
        self.worst.as_ref()
    }

    /// Number of flights that have landed.
    pub fn flights(&self) -> u64 {
        self.first + self.landed.iter().flatten().count() as u64
    }

    /// Number of flights since the worst one.
    pub fn since_worst(&self) -> u64 {
        self.worst.as_ref().map_or(0, |worst| self.flights().saturating_sub(worst.number + 1))
    }

    /// Number of random beginnings.
    pub fn populations(&self) -> u64 {
        self.populations
    }

    /// Takes the generation into the population.
    fn end_generation(&mut self) {
        let before = self.parents.first().map(|parent| parent.badness);
        let generation =
            std::mem::take(&mut self.generation).into_iter().zip(std::mem::take(&mut self.landed));
        let count = generation.len() as u64;
        let is_random = std::mem::take(&mut self.is_random);
        for ((number, (candidate, badness)), is_random) in (self.first..).zip(generation).zip(is_random) {
            let badness = badness.expect("all flights of a generation have landed");
            self.by_chance.extend(is_random.then_some(badness));
            self.parents.push(Flown { number, candidate, badness });
        }
        self.first += count;
        // The sort is stable: of equally bad flights, the earlier one stays ahead.
        self.parents
            .sort_by(|one, other| other.badness.partial_cmp(&one.badness).expect("no badness is NaN"));
        self.parents.truncate(if self.strategy == Strategy::Random { 0 } else { PARENTS });
        let is_worse = self.parents.first().map(|parent| parent.badness) > before;
        // Until a flight stands out, there is no region to give up.
        self.stale = if is_worse || !self.stands_out() { 0 } else { self.stale + 1 };
    }

    /// Whether the worst flight of the population is far worse than usual.
    fn stands_out(&self) -> bool {
        let Some(Flown { badness: Badness::Of(worst), .. }) = self.parents.first() else { return false };
        // Flights without a value of the goal do not count.
        let said = |badness: &Badness| if let Badness::Of(value) = *badness { Some(value) } else { None };
        let mut by_chance: Vec<f64> = self.by_chance.iter().filter_map(said).collect();
        by_chance.sort_by(|one, other| other.total_cmp(one));
        let median = by_chance.get(by_chance.len() / 2);
        // With too few of them to tell what is usual, any flight that has a value is worth following.
        by_chance
            .get(UNUSUAL)
            .zip(median)
            .is_none_or(|(usual, median)| worst - usual > STANDS_OUT * (usual - median))
    }

    /// The candidate of flight `number`, and whether it is random; a share of `random` of all candidates is.
    fn candidate(&self, number: u64, random: f64) -> (Candidate, bool) {
        let mut dice = Dice(Draws::new(self.seed, PURPOSE, number));
        if self.parents.is_empty() || dice.0.uniform() < random {
            return (self.shapes.iter().map(|_| dice.gene()).collect(), true);
        }
        (self.child(&mut dice), false)
    }

    /// A descendant of the worst flights of the population.
    fn child(&self, dice: &mut Dice) -> Candidate {
        let mut child = dice.parent(&self.parents).clone();
        if dice.0.uniform() < MOVED_TOGETHER {
            dice.move_together(&mut child);
            return child;
        }
        if dice.0.uniform() < CROSSED {
            let other = dice.parent(&self.parents);
            for (gene, other) in child.iter_mut().zip(other) {
                if dice.0.uniform() < 0.5 {
                    *gene = *other;
                }
            }
        }
        // One gene changes in any case, each other one with a chance that leaves one more on average.
        let sure = dice.below(child.len());
        for (place, (gene, shape)) in child.iter_mut().zip(&self.shapes).enumerate() {
            if place == sure || dice.0.uniform() * (self.shapes.len() as f64) < 1.0 {
                dice.change(gene, *shape);
            }
        }
        child
    }
}

/// The draws of one candidate.
struct Dice(Draws);

impl Dice {
    fn below(&mut self, count: usize) -> usize {
        (self.0.uniform() * count as f64) as usize
    }

    fn gene(&mut self) -> Gene {
        let mut number = || self.0.uniform();
        Gene { time: number(), target: number(), length: number(), kind: number(), magnitude: number() }
    }

    /// One of `parents`; the first ones, which are worse flights, more often.
    fn parent<'p>(&mut self, parents: &'p [Flown]) -> &'p Candidate {
        let share = self.0.uniform() * self.0.uniform();
        &parents[(share * parents.len() as f64) as usize].candidate
    }

    /// Moves all faults by one step of time, as far as all of them can go.
    fn move_together(&mut self, candidate: &mut Candidate) {
        let times = || candidate.iter().map(|gene| gene.time);
        let (first, last) = (times().fold(1.0, f64::min), times().fold(0.0, f64::max));
        // All times are between 0 and 1, so the bounds are in order, and `clamp` cannot panic.
        let step = self.step().clamp(-first, 1.0 - last);
        for gene in candidate {
            gene.time = (gene.time + step).clamp(0.0, 1.0);
        }
    }

    /// Draws the target or the kind anew, or moves one or more of the other numbers.
    fn change(&mut self, gene: &mut Gene, shape: Shape) {
        if self.0.uniform() < REDRAWN {
            let is_kind = shape.has_kind && self.0.uniform() < 0.5;
            let number = if is_kind { &mut gene.kind } else { &mut gene.target };
            *number = self.0.uniform();
            return;
        }
        let mut numbers = vec![&mut gene.time];
        numbers.extend(shape.has_length.then_some(&mut gene.length));
        numbers.extend(shape.has_magnitude.then_some(&mut gene.magnitude));
        let sure = self.below(numbers.len());
        for (place, number) in numbers.into_iter().enumerate() {
            if place == sure || self.0.uniform() < 0.3 {
                // The ends of a range are often the worst, and a step beyond them ends there.
                *number = (*number + self.step()).clamp(0.0, 1.0);
            }
        }
    }

    /// A step of a size between the smallest and the largest, each power of ten equally likely.
    fn step(&mut self) -> f64 {
        let [smallest, largest] = STEPS;
        let size = smallest * libm::pow(largest / smallest, self.0.uniform());
        size * self.0.normal()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SHAPE: Shape = Shape { has_length: true, has_kind: true, has_magnitude: true };

    /// The candidates and the worst flight of a search whose flights are as bad as `badness` says; they land backwards.
    fn searched(
        strategy: Strategy,
        seed: u64,
        flights: u64,
        badness: impl Fn(&Candidate) -> Badness,
    ) -> (Vec<Candidate>, Search) {
        let (mut search, mut all) = (Search::new(strategy, seed, vec![SHAPE; 2]), Vec::new());
        while search.flights() < flights {
            search.begin_generation(flights - search.flights());
            let generation: Vec<_> =
                search.generation().map(|(number, candidate)| (number, candidate.clone())).collect();
            for (number, candidate) in generation.iter().rev() {
                search.land(*number, badness(candidate));
            }
            all.extend(generation.into_iter().map(|(_, candidate)| candidate));
        }
        (all, search)
    }

    /// Worst in a narrow valley of two times that have to fit each other, for one target only.
    fn valley(candidate: &Candidate) -> Badness {
        let [one, other] = [candidate[0], candidate[1]];
        let off = (one.time - 0.31).abs() + 3.0 * (other.time - one.time - 0.2).abs();
        Badness::Of(-off - if one.target < 0.2 { 0.0 } else { 1.0 })
    }

    #[test]
    fn evolution_finds_what_chance_does_not_in_the_same_number_of_flights() {
        let worst = |strategy, seed| {
            let (_, search) = searched(strategy, seed, 300, valley);
            let Badness::Of(badness) = search.worst().unwrap().badness else { panic!("a number") };
            -badness
        };
        let wins = (0..20).filter(|seed| worst(Strategy::Evolution, *seed) < worst(Strategy::Random, *seed));
        let wins = wins.count();
        assert!(wins >= 19, "{wins} of 20");
        let mean = (0..20).map(|seed| worst(Strategy::Evolution, seed)).sum::<f64>() / 20.0;
        assert!(mean < 0.02, "{mean}");
    }

    #[test]
    fn the_same_seed_gives_the_same_candidates_and_another_seed_others() {
        let candidates = |seed| searched(Strategy::Evolution, seed, 200, valley).0;
        assert_eq!(candidates(1), candidates(1));
        assert_ne!(candidates(1), candidates(2));
    }

    #[test]
    fn a_longer_search_begins_like_a_shorter_one() {
        let candidates = |flights| searched(Strategy::Evolution, 5, flights, valley).0;
        assert_eq!(candidates(300)[..90], candidates(90));
    }

    #[test]
    fn every_number_of_a_candidate_stays_in_its_range() {
        let (candidates, _) = searched(Strategy::Evolution, 1, 1000, valley);
        let numbers = |gene: &Gene| [gene.time, gene.target, gene.length, gene.kind, gene.magnitude];
        assert!(candidates.iter().flatten().flat_map(numbers).all(|number| (0.0..=1.0).contains(&number)));
    }

    #[test]
    fn a_population_without_progress_is_given_up_and_the_worst_flight_stays() {
        // A rare kind of flight is worse than all others, and all flights of that kind are equally bad.
        let rare = |candidate: &Candidate| Badness::Of(if candidate[0].target < 0.01 { 1.0 } else { 0.0 });
        let (_, search) = searched(Strategy::Evolution, 1, 500, rare);
        assert!(search.populations() > 1, "{}", search.populations());
        let worst = search.worst().unwrap();
        assert!(worst.badness == Badness::Of(1.0) && worst.candidate[0].target < 0.01);
    }

    #[test]
    fn where_no_flight_stands_out_most_candidates_are_random() {
        let (all, search) = searched(Strategy::Evolution, 1, 500, |_| Badness::Of(1.0));
        let worst = search.worst().unwrap();
        assert_eq!((worst.number, search.since_worst()), (0, 499), "the first of equals");
        assert_eq!(search.populations(), 1);
        // A descendant keeps most numbers of its parent; no two random candidates share one.
        let mut times: Vec<f64> = all.iter().map(|candidate| candidate[1].time).collect();
        times.sort_by(f64::total_cmp);
        times.dedup();
        assert!(times.len() > 430, "{}", times.len());
    }

    #[test]
    fn flights_that_say_nothing_do_not_hide_one_that_does() {
        let seldom = |candidate: &Candidate| {
            if candidate[0].target < 0.05 { Badness::Of(-candidate[0].time) } else { Badness::Nothing }
        };
        let (_, search) = searched(Strategy::Evolution, 3, 200, seldom);
        assert!(search.worst().unwrap().badness > Badness::Of(-0.01), "{:?}", search.worst());
    }
}
