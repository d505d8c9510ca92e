//! Controllers of the user's in a simulated flight.

use ringwing_agent::{
    controller::{Controller, Wish},
    pilot::Situation,
};
use ringwing_flight::{Event, UavId};
use ringwing_scenario::{AgentSection, Scenario};
use ringwing_simulation::{Simulation, SimulationError};
use std::{cell::Cell, rc::Rc};

/// Flies straight on, and wishes for nothing that can be flown from `broken_from_s` on.
struct Straight {
    broken_from_s: f64,
}

impl Controller for Straight {
    fn step(&mut self, situation: &Situation<'_>) -> Wish {
        let is_broken = situation.time_s() >= self.broken_from_s;
        Wish::new(if is_broken { f64::NAN } else { situation.sensed.speed_m_s }, 0.0)
    }
}

fn scenario() -> Scenario {
    let mut scenario = Scenario::default();
    scenario.time.duration_s = 3.0;
    scenario.supervision.start_timeout_s = 60.0;
    scenario
}

/// Flies `scenario` with a controller for UAV 3; returns all events, how many controllers were made, and the hash.
fn flown(scenario: &Scenario, broken_from_s: f64) -> (Vec<Event>, u32, String) {
    let made = Rc::new(Cell::new(0));
    let count = made.clone();
    let make = move |uav: UavId| {
        (uav == UavId(3)).then(|| {
            count.set(count.get() + 1);
            Box::new(Straight { broken_from_s }) as Box<dyn Controller>
        })
    };
    let mut simulation = Simulation::with_controllers(scenario, Box::new(make)).unwrap();
    let mut events = Vec::new();
    let mut goes_on = true;
    while goes_on {
        goes_on = simulation.step();
        events.extend(simulation.events().iter().map(|timed| timed.event.clone()));
    }
    (events, made.get(), simulation.report().payload_hash)
}

#[test]
fn a_controller_flies_its_uav_and_the_flight_repeats_to_the_bit() {
    let (events, made, hash) = flown(&scenario(), f64::INFINITY);
    assert_eq!((events, made), (Vec::new(), 1));
    assert_eq!(hash, flown(&scenario(), f64::INFINITY).2);
    let mut built_in = Simulation::new(&scenario()).unwrap();
    while built_in.step() {}
    assert_ne!(hash, built_in.report().payload_hash);
}

#[test]
fn a_wish_that_is_not_finite_is_named_and_ends_in_the_failsafe() {
    let (events, ..) = flown(&scenario(), 1.0);
    assert_eq!(events[0], Event::WishNotFinite { uav: UavId(3) });
    assert!(matches!(events[1], Event::Failsafe { uav: UavId(3), .. }), "{events:?}");
    assert_eq!(events.len(), 2, "{events:?}");
}

#[test]
fn an_agent_that_is_started_again_has_a_new_controller() {
    let mut scenario = scenario();
    scenario.faults = vec!["at 1 s kill uav 3 for 0.5 s".parse().unwrap()];
    assert_eq!(flown(&scenario, f64::INFINITY).1, 2);
}

#[test]
fn a_program_of_the_users_is_not_simulated_unless_a_controller_stands_in_for_it() {
    let mut scenario = scenario();
    scenario.agents = vec![AgentSection::parse("3=./mine").unwrap()];
    assert!(matches!(Simulation::new(&scenario), Err(SimulationError::OwnProgram { uav: UavId(3), .. })));
    assert_eq!(flown(&scenario, f64::INFINITY).1, 1);
}
