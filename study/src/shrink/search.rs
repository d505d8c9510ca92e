//! Tries smaller scenarios until none of them shows the symptom.
//!
//! Never keeps a scenario that a reader of scenario files would refuse.

use super::{
    ShrinkError,
    sentence::{smaller, smaller_faults},
    symptom::Symptom,
    uavs::{with_names, without_uav},
};
use crate::flight::{Outcome, fly};
use ringwing_recorder::metrics::Verdict;
use ringwing_scenario::{Action, Fault, Scenario, fault::ProcessFault};
use std::collections::HashMap;

/// A small scenario that shows the symptom of a larger one.
#[derive(Debug, Clone)]
pub struct Shrunk {
    /// The small scenario, and how it was found.
    pub smallest: Smallest,
    /// What both violate.
    pub symptom: Symptom,
}

/// The smallest scenario that a search has found.
#[derive(Debug, Clone)]
pub struct Smallest {
    /// The scenario.
    pub scenario: Scenario,
    /// Number of flights that the search took.
    pub flights: usize,
    /// Whether the search was stopped before its end, so that there may be a smaller one.
    pub is_stopped: bool,
}

/// What a smaller flight must have in common with the original.
pub struct Kept<S, A> {
    /// Whether a flight still shows what matters.
    pub shows: S,
    /// Whether a scenario may be tried at all.
    pub allows: A,
    /// Whether one moment of a flight decides that, so that the rest can be cut off.
    pub is_at_one_moment: bool,
}

/// How far the search is.
#[derive(Debug, Clone, Copy)]
pub struct Progress<'a> {
    /// The smallest scenario so far.
    pub smallest: &'a Scenario,
    /// Number of flights so far.
    pub flights: usize,
}

/// The smallest scenario that the search finds from `scenario`, which has been validated.
///
/// `wanted` is the requirement that it must violate; by default one about coming too close, or else the first of the
/// alphabet. `stops` says whether to end early, with the smallest scenario so far; `show` is called whenever the scenario
/// has become smaller.
///
/// # Errors
/// The scenario cannot be simulated, passes, or violates only other requirements.
pub fn shrink(
    scenario: &Scenario,
    wanted: Option<&str>,
    stops: impl Fn() -> bool,
    show: impl FnMut(Progress<'_>),
) -> Result<Shrunk, ShrinkError> {
    let symptom = symptom(scenario, wanted)?;
    let shows = |outcome: &Outcome| {
        outcome.verdict == Verdict::Violated
            && Symptom::all(outcome).iter().any(|shown| symptom.is_shown_by(shown))
    };
    let kept = Kept { shows, allows: |_: &_| true, is_at_one_moment: symptom.is_at_one_moment() };
    let smallest = shrink_keeping(scenario, &kept, stops, show);
    Ok(Shrunk { smallest, symptom })
}

/// As [`shrink`], for a scenario whose flight shows what is `kept`.
pub fn shrink_keeping(
    scenario: &Scenario,
    kept: &Kept<impl Fn(&Outcome) -> bool, impl Fn(&Scenario) -> bool>,
    stops: impl Fn() -> bool,
    show: impl FnMut(Progress<'_>),
) -> Smallest {
    let mut search = Search::new(scenario, kept, stops, show);
    search.name_draws();
    // A step can make another one possible: without a fault, a shorter flight may be enough.
    loop {
        let before = search.smallest.clone();
        search.drop_faults();
        search.drop_manoeuvres();
        search.shorten();
        search.drop_uavs();
        search.reduce_faults();
        if search.smallest == before {
            break;
        }
    }
    Smallest { scenario: search.smallest, flights: search.flown.len(), is_stopped: search.is_stopped }
}

fn symptom(scenario: &Scenario, wanted: Option<&str>) -> Result<Symptom, ShrinkError> {
    let outcome = fly(scenario)?;
    let name = || scenario.name.clone();
    match outcome.verdict {
        Verdict::Failed => return Err(ShrinkError::Ended(name())),
        Verdict::Passed => return Err(ShrinkError::Passed(name())),
        Verdict::Violated => {}
    }
    let is_wanted = |symptom: &Symptom| wanted.is_none_or(|wanted| symptom.requirement == wanted);
    Symptom::all(&outcome).into_iter().find(is_wanted).ok_or_else(|| ShrinkError::OtherRequirement {
        name: name(),
        wanted: wanted.unwrap_or_default().into(),
        violated: outcome.violated().collect::<Vec<_>>().join(", "),
    })
}

struct Search<'k, S, A, H, F> {
    smallest: Scenario,
    kept: &'k Kept<S, A>,
    /// Whether only the faults make the original show what is kept. Then this must hold for every smaller one too:
    /// a flight that is too short to settle violates most requirements, and says nothing about the faults.
    needs_faults: bool,
    /// Seconds from the last fault to the end of the original.
    quiet_s: f64,
    /// Whether a scenario shows what is kept, by its text: equal scenarios fly once.
    flown: HashMap<String, bool>,
    stops: H,
    is_stopped: bool,
    show: F,
}

impl<'k, S, A, H, F> Search<'k, S, A, H, F>
where
    S: Fn(&Outcome) -> bool,
    A: Fn(&Scenario) -> bool,
    H: Fn() -> bool,
    F: FnMut(Progress<'_>),
{
    fn new(scenario: &Scenario, kept: &'k Kept<S, A>, stops: H, show: F) -> Self {
        let mut search = Self {
            smallest: scenario.clone(),
            kept,
            needs_faults: false,
            quiet_s: quiet_s(scenario),
            // `symptom` has flown the original already.
            flown: HashMap::from([(scenario.to_toml(), true)]),
            stops,
            is_stopped: false,
            show,
        };
        search.needs_faults = !search.is_shown(&without_faults(scenario));
        search
    }

    /// Takes `candidate` as the smallest if it shows what is kept for the same reason.
    fn accept(&mut self, candidate: Scenario) -> bool {
        // A stopped search accepts nothing more, so every step ends soon.
        self.is_stopped |= (self.stops)();
        // A requirement that is judged over the whole flight must leave the swarm as much time to recover.
        let is_rushed = !self.kept.is_at_one_moment && quiet_s(&candidate) < self.quiet_s;
        if self.is_stopped || is_rushed || !(self.kept.allows)(&candidate) || !self.is_shown(&candidate) {
            return false;
        }
        if self.needs_faults && self.is_shown(&without_faults(&candidate)) {
            return false;
        }
        self.smallest = candidate;
        (self.show)(Progress { smallest: &self.smallest, flights: self.flown.len() });
        true
    }

    fn is_shown(&mut self, scenario: &Scenario) -> bool {
        let text = scenario.to_toml();
        if let Some(known) = self.flown.get(&text) {
            return *known;
        }
        let outcome = Scenario::resolved(&text).ok().and_then(|scenario| fly(&scenario).ok());
        let is_shown = outcome.is_some_and(|outcome| (self.kept.shows)(&outcome));
        self.flown.insert(text, is_shown);
        is_shown
    }

    /// Drops faults: half of them at once, then smaller parts, down to single ones (delta debugging; Zeller and
    /// Hildebrandt, *Simplifying and Isolating Failure-Inducing Input*, 2002).
    fn drop_faults(&mut self) {
        let mut size = self.smallest.faults.len().div_ceil(2);
        while size > 0 {
            let mut first = 0;
            let mut is_smaller = false;
            while first < self.smallest.faults.len() {
                let mut candidate = self.smallest.clone();
                let end = (first + size).min(candidate.faults.len());
                candidate.faults.drain(first..end);
                // After a success, the next part has moved to the same place.
                if self.accept(candidate) { is_smaller = true } else { first += size }
            }
            // One fault that is gone can make another one superfluous.
            if !(is_smaller && size == 1) {
                size /= 2;
            }
        }
    }

    /// Leaves out manoeuvres, the last one first.
    fn drop_manoeuvres(&mut self) {
        for index in (0..self.smallest.manoeuvres.len()).rev() {
            let mut candidate = self.smallest.clone();
            candidate.manoeuvres.remove(index);
            self.accept(candidate);
        }
    }

    /// Ends the flight earlier, and lets the faults come earlier by as much where the end counts.
    fn shorten(&mut self) {
        let mut is_shorter = true;
        while is_shorter {
            let duration_s = self.smallest.time.duration_s;
            is_shorter = smaller(duration_s).into_iter().any(|new_s| {
                let mut cut = self.smallest.clone();
                cut.time.duration_s = new_s;
                let mut shifted = cut.clone();
                for fault in &mut shifted.faults {
                    // Whole milliseconds, because a difference of decimals has many digits.
                    fault.at_s = ((fault.at_s - duration_s + new_s) * 1000.0).round() / 1000.0;
                }
                self.accept(cut) || self.accept(shifted)
            });
        }
    }

    /// Names the UAVs that faults draw, so that fewer UAVs and other times are still about the same ones.
    fn name_draws(&mut self) {
        if let Some(named) = with_names(&self.smallest) {
            self.accept(named);
        }
    }

    /// Takes away one UAV after the other, the highest number first: the others keep their numbers as long as possible.
    fn drop_uavs(&mut self) {
        for uav in (1..=self.smallest.formation.uavs).rev() {
            if let Some(candidate) = without_uav(&self.smallest, uav) {
                self.accept(candidate);
            }
        }
    }

    /// Makes times, durations and magnitudes smaller, each until the symptom would go.
    fn reduce_faults(&mut self) {
        for index in 0..self.smallest.faults.len() {
            let mut is_smaller = true;
            while is_smaller {
                let faults = smaller_faults(&self.smallest.faults[index]);
                is_smaller = faults.into_iter().any(|fault| {
                    let mut candidate = self.smallest.clone();
                    candidate.faults[index] = fault;
                    self.accept(candidate)
                });
            }
        }
    }
}

fn without_faults(scenario: &Scenario) -> Scenario {
    Scenario { faults: Vec::new(), ..scenario.clone() }
}

/// Seconds from the end of the last fault to the end of the flight.
fn quiet_s(scenario: &Scenario) -> f64 {
    let last_s = scenario.faults.iter().map(end_s).fold(0.0, f64::max);
    scenario.time.duration_s - last_s
}

/// When a fault ends; its start if it lasts to the end of the flight or has no duration.
fn end_s(fault: &Fault) -> f64 {
    let lasts_s = match &fault.action {
        Action::Link { for_s, .. } => *for_s,
        Action::Process { fault, .. } => match *fault {
            ProcessFault::Freeze { for_s }
            | ProcessFault::Slow { for_s, .. }
            | ProcessFault::Weaken { for_s, .. }
            | ProcessFault::Jam { for_s, .. }
            | ProcessFault::Drift { for_s, .. } => for_s,
            ProcessFault::Restart { after_s } => Some(after_s),
            ProcessFault::Flap { for_s, .. } => Some(for_s),
            ProcessFault::Kill | ProcessFault::Stop | ProcessFault::Thaw | ProcessFault::Start => None,
        },
        Action::Heal(_) => None,
    };
    fault.at_s + lasts_s.unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::Cell;

    /// A short flight that violates `faults_act`, because nothing thaws a UAV that flies.
    fn idle() -> Scenario {
        let mut scenario = Scenario::default();
        scenario.time.duration_s = 4.0;
        scenario.requirements.faults_act = true;
        let sentences = [
            "at 0.5 s link all->all loss 20 % for 0.5 s",
            "at 1.234 s thaw uav 2",
            "at 1.5 s link 1->2 delay 50 ms for 0.5 s",
        ];
        scenario.faults = sentences.iter().map(|text| text.parse().unwrap()).collect();
        scenario
    }

    #[test]
    fn only_the_fault_that_matters_is_left_and_its_time_is_round() {
        let original = idle();
        let shrunk = shrink(&original, None, || false, |_| ()).unwrap();
        let small = shrunk.smallest.scenario;
        let [fault] = &*small.faults else { panic!("{:?}", small.faults) };
        assert_eq!(fault.action.to_string(), "thaw uav 2");
        assert!(fault.at_s <= 0.02, "{fault}");
        assert!(small.formation.uavs < original.formation.uavs);
        assert_eq!(shrunk.symptom.requirement, "faults_act");
        let again = fly(&small).unwrap();
        assert_eq!(again.violated().collect::<Vec<_>>(), ["faults_act"]);
    }

    #[test]
    fn the_same_scenario_gives_the_same_result_in_as_many_flights() {
        let [one, other] = [(); 2].map(|()| shrink(&idle(), None, || false, |_| ()).unwrap().smallest);
        assert_eq!((one.scenario, one.flights), (other.scenario, other.flights));
    }

    #[test]
    fn a_search_that_is_stopped_gives_the_smallest_scenario_so_far() {
        let accepted = Cell::new(0);
        let shrunk =
            shrink(&idle(), None, || accepted.get() == 2, |_| accepted.set(accepted.get() + 1)).unwrap();
        let whole = shrink(&idle(), None, || false, |_| ()).unwrap();
        assert_eq!((shrunk.smallest.is_stopped, whole.smallest.is_stopped), (true, false));
        assert!(shrunk.smallest.scenario.faults.len() < idle().faults.len());
        assert!(shrunk.smallest.scenario != whole.smallest.scenario && accepted.get() == 2);
        assert_eq!(fly(&shrunk.smallest.scenario).unwrap().violated().collect::<Vec<_>>(), ["faults_act"]);
    }

    #[test]
    fn a_flight_that_cannot_be_shrunk_is_refused_with_the_reason() {
        let refusal =
            |scenario: &Scenario, wanted| shrink(scenario, wanted, || false, |_| ()).unwrap_err().to_string();
        let mut scenario = idle();
        assert!(refusal(&scenario, Some("settling_max_s")).ends_with("it violates faults_act"));
        scenario.requirements.faults_act = false;
        assert!(refusal(&scenario, None).contains("passes, so there is nothing to shrink"));
        scenario.time.real_time = true;
        assert!(refusal(&scenario, None).contains("real time"));
    }
}
