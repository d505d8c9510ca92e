//! Flies scenarios for the tests, with the recorder's measures of every tick.

use nalgebra::Point2;
use ringwing_flight::{Account, AgeTicks, Part, ProcessAction, Tick, UavId};
use ringwing_recorder::metrics::{ControlTerms, Frame, Moment, TrueState};
use ringwing_scenario::{Fault, ObstacleSection, Scenario, Setting, Source, StartState};
use ringwing_simulation::{Flown, Measurement, Simulation};

/// Longer than any of these tests flies.
const DURATION_S: f64 = 300.0;

/// The preset `name` with `settings`.
pub(crate) fn preset(name: &str, settings: &[&str]) -> Scenario {
    let settings: Vec<_> = settings.iter().map(|text| Setting::parse(text).expect("a setting")).collect();
    Scenario::read(&Source::find(name).expect("a preset"), &settings).expect("a valid scenario")
}

/// Free sky, drawn starts, and this law.
pub(crate) fn scenario(law: &str, settings: &[&str]) -> Scenario {
    let law = format!("control.law={law}");
    let settings: Vec<&str> = [law.as_str()].into_iter().chain(settings.iter().copied()).collect();
    let mut scenario = preset("paper-4.1", &settings);
    // The preset lists its starts, and then no seed would change them.
    scenario.start.uavs.clear();
    scenario.time.duration_s = DURATION_S;
    scenario
}

/// `scenario` with these faults too.
pub(crate) fn with_faults(mut scenario: Scenario, sentences: &[&str]) -> Scenario {
    let faults = sentences.iter().map(|sentence| sentence.parse::<Fault>().expect("a fault"));
    scenario.faults.extend(faults);
    scenario
}

/// `scenario` with every UAV in its slot at the start, flying like the leader.
pub(crate) fn at_rest(mut scenario: Scenario) -> Scenario {
    let leader = scenario.leader_start();
    let start = |number| StartState {
        position_m: scenario.start_slot(number).into(),
        heading_deg: leader.heading_deg,
        speed_m_s: leader.speed_m_s,
    };
    scenario.start.uavs = (1..=scenario.formation.uavs).map(start).collect();
    scenario
}

/// The two obstacles of the paper's Section 4.2.
pub(crate) fn obstacles_of_the_paper() -> Vec<ObstacleSection> {
    preset("paper-4.2", &[]).obstacles
}

/// A flight with the measures of its newest tick.
pub(crate) struct Flight {
    pub(crate) simulation: Simulation,
    measurement: Measurement,
    is_over: bool,
}

impl Flight {
    pub(crate) fn new(scenario: &Scenario) -> Self {
        Self {
            simulation: Simulation::new(scenario).expect("a scenario that can be simulated"),
            measurement: Measurement::new(scenario),
            is_over: false,
        }
    }

    /// Flies the next tick; panics after the last one, so that no test measures a flight that stands still.
    pub(crate) fn step(&mut self) {
        assert!(!self.is_over, "the scenario is over");
        self.is_over = !self.simulation.step();
        self.measurement.observe(&self.simulation);
    }

    /// Flies for `duration_s` and shows each tick to `see`.
    pub(crate) fn fly(&mut self, duration_s: f64, mut see: impl FnMut(&Self)) {
        // Round, because such a product may be just below a whole number, and a cast would fly a tick less.
        for _ in 0..(duration_s * f64::from(self.simulation.scenario().time.rate_hz)).round() as i64 {
            self.step();
            see(self);
        }
    }

    /// Flies until `tick` is the tick flown last.
    pub(crate) fn fly_to(&mut self, tick: i64) {
        while self.simulation.flown() != Some(Tick(tick)) {
            self.step();
        }
    }

    /// Flies to the end of the scenario.
    pub(crate) fn finish(mut self) -> Flown {
        while !self.is_over {
            self.step();
        }
        self.measurement.finish(&self.simulation)
    }

    pub(crate) fn kill(&mut self, numbers: &[u32]) {
        for number in numbers {
            self.simulation.apply(agent(*number), ProcessAction::Kill { returns: false });
        }
    }

    pub(crate) fn start(&mut self, numbers: &[u32]) {
        for number in numbers {
            self.simulation.apply(agent(*number), ProcessAction::Start);
        }
    }

    pub(crate) fn moment(&self) -> &Moment {
        self.measurement.moment()
    }

    pub(crate) fn frame(&self) -> &Frame {
        self.measurement.frame()
    }

    /// The account of UAV `number`'s agent in the tick flown last; `None` if it gave no command.
    pub(crate) fn account(&self, number: u32) -> Option<&Account> {
        self.simulation.account(UavId(number))
    }

    /// The age, in ticks, of what UAV `number` knew of the leader in the tick flown last; `None` if it knew nothing.
    pub(crate) fn leader_age(&self, number: u32) -> Option<u32> {
        self.age(number, |account| account.leader_age)
    }

    /// The same of what it knew of its next neighbour.
    pub(crate) fn next_age(&self, number: u32) -> Option<u32> {
        self.age(number, |account| account.next_age)
    }

    fn age(&self, number: u32, of: fn(&Account) -> AgeTicks) -> Option<u32> {
        of(self.account(number).expect("the agent commands")).ticks()
    }

    pub(crate) fn hash(&self) -> String {
        self.simulation.report().payload_hash
    }

    /// The largest slot error of the UAVs that fly on command.
    pub(crate) fn slot_error_max_m(&self) -> f64 {
        self.moment().slot_error_max_m.expect("a leader, and a UAV that flies on command")
    }

    pub(crate) fn slot_error_rms_m(&self) -> f64 {
        self.moment().slot_error_rms_m.expect("a leader, and a UAV that flies on command")
    }

    fn commanded(&self) -> impl Iterator<Item = &TrueState> + Clone {
        self.frame().uavs.iter().filter_map(|uav| uav.commanded())
    }

    fn controls(&self) -> impl Iterator<Item = &ControlTerms> {
        self.frame()
            .uavs
            .iter()
            .filter(|uav| uav.commanded().is_some())
            .filter_map(|uav| uav.control.as_ref())
    }

    /// The distance of the closest two UAVs that fly on command.
    pub(crate) fn closest_commanded_m(&self) -> f64 {
        let places: Vec<Point2<f64>> = self.commanded().map(TrueState::position).collect();
        let pairs = places
            .iter()
            .enumerate()
            .flat_map(|(index, one)| places[..index].iter().map(move |two| one - two));
        pairs.map(|apart| apart.norm()).fold(f64::INFINITY, f64::min)
    }

    /// The distance of the closest two in the sky, those in their failsafes included.
    pub(crate) fn closest_m(&self) -> f64 {
        self.moment().closest.pair().expect("two UAVs").distance_m
    }

    /// Whether all that fly on command agree that just those that fly on command are alive.
    pub(crate) fn all_agree_with_the_truth(&self) -> bool {
        let commanded = self.moment().commanded;
        // One view can still be wrong: all may agree on somebody who is gone.
        self.moment().views == 1 && self.controls().all(|control| control.living == commanded)
    }

    /// Whether every agent reports that it does not hear the leader.
    pub(crate) fn reports_a_silent_leader(&self) -> bool {
        self.controls().all(|control| control.leader_silent)
    }

    /// Flies for `duration_s` and measures when all slot errors fell below `bound_m` for good.
    pub(crate) fn recover(&mut self, duration_s: f64, bound_m: f64) -> Recovery {
        let (mut ticks, mut broken) = (0, 0);
        let mut recovery = Recovery {
            whole_s: 0.0,
            felt_m: 0.0,
            closest_commanded_m: f64::INFINITY,
            closest_m: f64::INFINITY,
        };
        self.fly(duration_s, |flight| {
            ticks += 1;
            let error_m = flight.slot_error_max_m();
            // Keep the last tick beyond the bound, and not the first within: a swarm may swing through its slots.
            if error_m >= bound_m {
                broken = ticks;
            }
            recovery.felt_m = recovery.felt_m.max(error_m);
            recovery.closest_commanded_m = recovery.closest_commanded_m.min(flight.closest_commanded_m());
            recovery.closest_m = recovery.closest_m.min(flight.closest_m());
        });
        recovery.whole_s = f64::from(broken) * self.simulation.scenario().period_s();
        recovery
    }
}

pub(crate) fn agent(number: u32) -> Part {
    Part::Agent(UavId(number))
}

/// How a swarm returned to its formation.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Recovery {
    /// The last time at which a slot error was not below the bound.
    pub(crate) whole_s: f64,
    /// The largest slot error on the way.
    pub(crate) felt_m: f64,
    /// How close two UAVs came that flew on command.
    pub(crate) closest_commanded_m: f64,
    /// How close any two came, those in their failsafes included.
    pub(crate) closest_m: f64,
}

/// Flies `scenario` to its end; returns the simulation and the swarm in the last tick. Measures only that tick, which
/// is three times as fast as [`Flight`].
pub(crate) fn fly_to_end(scenario: &Scenario, mut see: impl FnMut(&Simulation)) -> (Simulation, Measurement) {
    let mut simulation = Simulation::new(scenario).expect("a scenario that can be simulated");
    while simulation.step() {
        see(&simulation);
    }
    // The last step returns false, but it has flown a tick too.
    see(&simulation);
    let mut measurement = Measurement::new(scenario);
    measurement.observe(&simulation);
    (simulation, measurement)
}

/// Where the UAVs are that have not left the sky.
pub(crate) fn places(simulation: &Simulation) -> Vec<Point2<f64>> {
    simulation.sky().airframes().iter().filter(|one| one.is_flying()).map(|one| one.pose().position).collect()
}

/// The distance of the closest two UAVs in the sky.
pub(crate) fn closest_pair_m(simulation: &Simulation) -> f64 {
    let places = places(simulation);
    let pairs = places.iter().enumerate().flat_map(|(at, one)| places[..at].iter().map(move |two| one - two));
    pairs.map(|apart| apart.norm()).fold(f64::INFINITY, f64::min)
}

/// The largest distance of a UAV from its slot in the whole ring around the leader, of those that have lost their agents too.
pub(crate) fn slot_error_max_m(simulation: &Simulation) -> f64 {
    let (scenario, leader) = (simulation.scenario(), Point2::from(simulation.leader().position_m));
    let ring = scenario.whole_ring();
    let error_m = |uav: UavId| {
        let place = simulation.sky().airframes()[uav.index()].pose().position;
        (place - leader - ring.slot(uav.0).offset()).norm()
    };
    UavId::all(scenario.formation.uavs).map(error_m).fold(0.0, f64::max)
}
