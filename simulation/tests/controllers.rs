//! Controllers of the user's in a simulated flight.

use ringwing_agent::{
    controller::{Controller, Wish},
    pilot::Situation,
};
use ringwing_flight::{Event, Tick, UavId};
use ringwing_scenario::{AgentSection, Scenario};
use ringwing_simulation::{Frames, Simulation, SimulationError};
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
    scenario.faults = vec!["at 1 s restart uav 3 after 0.5 s".parse().unwrap()];
    assert_eq!(flown(&scenario, f64::INFINITY).1, 2);
}

#[test]
fn a_program_of_the_users_is_not_simulated_unless_a_controller_stands_in_for_it() {
    let mut scenario = scenario();
    scenario.agents = vec![AgentSection::parse("3=./mine").unwrap()];
    assert!(matches!(Simulation::new(&scenario), Err(SimulationError::OwnProgram { uav: UavId(3), .. })));
    assert_eq!(flown(&scenario, f64::INFINITY).1, 1);
}

/// Flies straight on, and may note where it is.
struct Noting {
    is_noting: bool,
}

impl Controller for Noting {
    fn step(&mut self, situation: &Situation<'_>) -> Wish {
        let wish = Wish::new(situation.sensed.speed_m_s, 0.0);
        if !self.is_noting {
            return wish;
        }
        // From 1 s on, one note is another one.
        let second = if situation.time_s() < 1.0 { "early_s" } else { "late_s" };
        wish.with_note("x_m", situation.own.position.x).with_note(second, situation.time_s())
    }
}

/// Tick, UAV, name and value of a note.
type Noted = (i64, u32, String, f64);

/// Flies UAVs 2 and 5 with such controllers; returns all notes, and the hash.
fn noted(scenario: &Scenario, is_noting: bool) -> (Vec<Noted>, String) {
    let own = |uav: UavId| [2, 5].contains(&uav.0);
    let make = move |uav: UavId| own(uav).then(|| Box::new(Noting { is_noting }) as Box<dyn Controller>);
    let mut simulation = Simulation::with_controllers(scenario, Box::new(make)).unwrap();
    let (mut frames, mut found, mut goes_on) = (Frames::new(scenario), Vec::new(), true);
    while goes_on {
        goes_on = simulation.step();
        let Some(frame) = frames.take(&simulation) else { continue };
        for notes in &frame.notes {
            assert_eq!(notes.tick, Tick(frame.tick));
            let one = |(name, value): (&str, f64)| (frame.tick, notes.uav.0, name.to_owned(), value);
            found.extend(notes.iter().map(one));
        }
    }
    (found, simulation.report().payload_hash)
}

#[test]
fn notes_are_in_the_frames_of_their_ticks_and_change_no_byte_of_the_flight() {
    let mut scenario = scenario();
    scenario.faults = ["at 1.5 s restart uav 2 after 0.5 s", "at 1.5 s freeze uav 5 for 0.5 s"]
        .map(|s| s.parse().unwrap())
        .into();
    let (notes, hash) = noted(&scenario, true);
    let (none, silent) = noted(&scenario, false);
    assert_eq!((none, hash), (Vec::new(), silent));
    let ticks = |uav: u32| {
        let of_uav = notes.iter().filter(move |note| note.1 == uav && note.2 == "x_m");
        of_uav.map(|note| note.0).collect::<Vec<_>>()
    };
    // The killed agent is away for fifty ticks; the frozen one still answers the tick before it was thawed.
    assert_eq!(ticks(2), (0..150).chain(200..301).collect::<Vec<_>>());
    assert_eq!(ticks(5), (0..150).chain(199..301).collect::<Vec<_>>());
    assert_eq!(notes[1], (0, 2, "early_s".into(), 0.0));
    assert_eq!(notes.last().unwrap(), &(300, 5, "late_s".into(), 3.0));
}
