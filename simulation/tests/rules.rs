//! What each process fault does to a flight, rule by rule, as the crate's documentation lists them.

use crate::support::{Flight, agent, preset, with_faults};
use ringwing_flight::{Event, FlightMode, Part, ProcessAction, Tick, UavId};
use ringwing_recorder::metrics::{FlightSummary, Verdict};
use ringwing_scenario::Scenario;
use ringwing_simulation::{Flown, Simulation, SimulationError, fly};

/// Six UAVs fly for 10 s under the paper's law, through these faults.
fn scenario(faults: &[&str]) -> Scenario {
    with_faults(preset("paper-4.1", &["time.duration_s=10"]), faults)
}

/// The flight through these faults, up to and with tick `tick`.
fn flight_to(faults: &[&str], tick: i64) -> Flight {
    let mut flight = Flight::new(&scenario(faults));
    flight.fly_to(tick);
    flight
}

fn flown(faults: &[&str]) -> Flown {
    fly(&scenario(faults)).expect("a flight")
}

fn hash_of(faults: &[&str]) -> String {
    hash(&flown(faults))
}

fn hash(flown: &Flown) -> String {
    flown.report.as_ref().expect("a world that lives").payload_hash.clone()
}

/// The names of the events with their ticks.
fn events(flown: &Flown) -> Vec<(i64, &str)> {
    flown.events.iter().map(|timed| (timed.tick.0, timed.event.name())).collect()
}

/// Why each refused fault was refused.
fn refusals(flown: &Flown) -> Vec<&str> {
    fn why(event: &Event) -> Option<&str> {
        if let Event::FaultRefused { why, .. } = event { Some(why) } else { None }
    }
    flown.events.iter().filter_map(|timed| why(&timed.event)).collect()
}

#[test]
fn a_killed_or_stopped_agent_answers_the_tick_before_last_and_what_it_sent_then_is_still_used() {
    for fault in ["at 2 s kill uav 3", "at 2 s stop uav 3"] {
        let mut flight = flight_to(&[fault], 199);
        assert!(flight.account(3).is_some(), "{fault}");
        flight.step();
        assert!(flight.account(3).is_none() && !flight.simulation.runs(UavId(3)), "{fault}");
        assert_eq!(flight.next_age(2), Some(1), "{fault}: UAV 2 uses what was sent in tick 199");
        flight.step();
        assert_eq!(flight.next_age(2), Some(2), "{fault}");
    }
}

#[test]
fn a_new_agent_knows_only_its_own_senses_in_its_first_tick() {
    let mut flight = flight_to(&["at 2 s restart uav 3 after 1 s"], 299);
    assert!(flight.account(3).is_none(), "it has no part in the tick before it starts");
    flight.step();
    assert_eq!((flight.leader_age(3), flight.next_age(3)), (None, None));
    flight.step();
    assert_eq!((flight.leader_age(3), flight.next_age(3)), (Some(1), Some(1)));
    assert_eq!(flight.next_age(2), Some(1), "and UAV 2 hears it from then on");
}

#[test]
fn a_frozen_agent_answers_nothing() {
    let mut flight = flight_to(&["at 2 s freeze uav 3 for 0.2 s"], 199);
    assert!(flight.account(3).is_some());
    for _ in 200..219 {
        flight.step();
        assert!(flight.account(3).is_none());
    }
}

#[test]
fn a_thawed_agent_first_answers_the_tick_that_it_finds_open() {
    let mut flight = flight_to(&["at 2 s freeze uav 3"], 219);
    let newest_command = |flight: &Flight| flight.simulation.sky().airframes()[2].newest_command();
    assert_eq!(newest_command(&flight), Some(Tick(199)));
    flight.simulation.apply(agent(3), ProcessAction::Thaw);
    assert_eq!(newest_command(&flight), Some(Tick(219)), "the late command is offered to the airframe");
    flight.step();
    assert_eq!(flight.next_age(2), Some(1), "UAV 2 hears what was sent in answer to tick 219");
    assert_eq!(flight.account(3).unwrap().tick, Tick(220), "it answers the next tick as well");
}

#[test]
fn what_a_thawed_agent_sends_late_is_measured_in_the_tick_that_it_answers() {
    let mut flight = flight_to(&["at 2 s freeze uav 3 for 0.2 s"], 218);
    assert_eq!(flight.frame().uavs[2].control, None);
    flight.step();
    assert_eq!(flight.account(3).unwrap().tick, Tick(219));
    assert!(flight.frame().uavs[2].control.is_some());
    // Link counts are due in every hundredth tick.
    let counted = |end_s: f64| {
        let faults = [format!("at 1.5 s freeze uav 3 for {end_s} s"), "at 0 s link 2->3 loss 10 %".into()];
        let flight = flight_to(&faults.each_ref().map(String::as_str), 200);
        flight.frame().links.len()
    };
    assert_eq!((counted(0.51), counted(0.52)), (1, 0));
}

#[test]
fn an_agent_that_is_frozen_and_thawed_between_two_ticks_answers_none_of_them_twice() {
    assert_eq!(hash_of(&["at 2 s freeze uav 3", "at 2 s thaw uav 3"]), hash_of(&[]));
}

#[test]
fn a_late_command_is_not_hashed() {
    // Its senses have been silent for so long that the late command is withheld: it changes nothing in the sky, and
    // nobody hears of it, so that only its own bytes could change the hash.
    let silent = "at 1.5 s link own->3 blackout";
    let thawed = flown(&[silent, "at 2 s freeze uav 3", "at 5 s thaw uav 3", "at 5 s kill uav 3"]);
    let killed = flown(&[silent, "at 2 s freeze uav 3", "at 5 s kill uav 3"]);
    assert_eq!(hash(&thawed), hash(&killed));
    assert_eq!(events(&thawed).len(), events(&killed).len() + 1, "it was thawed");
}

#[test]
fn a_frozen_agent_keeps_its_memory_and_skips_what_was_sent_meanwhile() {
    // The leader's last state is of tick 209. The frozen agent last used the one of tick 198.
    let faults = ["at 2 s freeze uav 3 for 0.2 s", "at 2.1 s kill leader"];
    let flight = flight_to(&faults, 220);
    assert_eq!(flight.leader_age(3), Some(220 - 198));
    assert_eq!(flight.leader_age(1), Some(220 - 209));
    assert_eq!(flight.next_age(3), Some(1));
}

#[test]
fn an_agent_that_is_killed_while_it_is_frozen_returns_without_its_memory() {
    let faults = ["at 2 s freeze uav 3", "at 2.1 s restart uav 3 after 0.1 s"];
    let mut flight = flight_to(&faults, 219);
    assert!(flight.account(3).is_none());
    flight.step();
    assert_eq!(flight.leader_age(3), None);
}

#[test]
fn each_action_of_a_tick_sees_the_effect_of_the_one_before() {
    let renewed = flight_to(&["at 2 s kill uav 3", "at 2 s start uav 3"], 200);
    assert_eq!(renewed.leader_age(3), None, "a new agent flies");
    let dead = flight_to(&["at 2 s start uav 3", "at 2 s kill uav 3"], 200);
    assert!(dead.account(3).is_none());
    assert_eq!(refusals(&dead.finish()), ["is there already"]);
}

#[test]
fn an_action_that_does_not_fit_the_process_is_refused_and_changes_only_the_events() {
    for (before, refused, why) in [
        (&[] as &[&str], "at 3 s start uav 3", "is there already"),
        (&[], "at 3 s thaw uav 3", "is not frozen"),
        (&["at 2 s kill uav 3"], "at 3 s kill uav 3", "is gone already"),
        (&["at 2 s stop uav 3"], "at 3 s freeze uav 3", "is gone already"),
        (&["at 2 s freeze uav 3"], "at 3 s freeze uav 3", "is frozen already"),
        (&["at 2 s freeze uav 3"], "at 3 s stop uav 3", "is frozen: thaw or kill it"),
        (&["at 2 s kill leader"], "at 3 s thaw leader", "is gone already"),
        (&[], "at 3 s start leader", "is there already"),
        (&[], "at 3 s thaw recorder", "is not frozen"),
    ] {
        let with: Vec<&str> = before.iter().copied().chain([refused]).collect();
        let with_count = with.len() as u64;
        let (with, without) = (flown(&with), flown(before));
        assert_eq!(refusals(&with), [why], "{refused}");
        assert_eq!(hash(&with), hash(&without), "{refused}");
        // The refused fault counts as asked for; everything else is as without it.
        let effects = with.summary.fault_effects.clone();
        assert_eq!((effects.asked, effects.without_effect.len()), (with_count, 1), "{refused}");
        let flown =
            FlightSummary { fault_effects: without.summary.fault_effects.clone(), ..with.summary.clone() };
        assert_eq!(flown, without.summary, "{refused}");
        assert_eq!(events(&with).iter().filter(|event| **event == (300, "fault.refused")).count(), 1);
    }
}

#[test]
fn without_a_leader_agents_go_on_by_its_last_state_and_a_new_one_continues_its_path() {
    let mut flight = flight_to(&["at 2 s restart leader after 1 s"], 200);
    assert_eq!((flight.simulation.led(), flight.leader_age(1)), (None, Some(1)));
    flight.fly_to(300);
    assert_eq!(flight.leader_age(1), Some(300 - 199));
    let undisturbed = flight_to(&[], 300);
    assert!(flight.simulation.led().is_some());
    assert_eq!(flight.simulation.led(), undisturbed.simulation.led());
    flight.step();
    assert_eq!(flight.leader_age(1), Some(1));
}

#[test]
fn a_thawed_leader_first_answers_the_tick_that_it_finds_open() {
    let mut flight = flight_to(&["at 2 s freeze leader for 0.2 s"], 218);
    assert_eq!(flight.simulation.led(), None);
    flight.step();
    assert_eq!(flight.simulation.led().unwrap().tick, Tick(219));
    assert_eq!(flight.leader_age(1), Some(219 - 199), "too late for the agents");
    flight.step();
    assert_eq!(flight.leader_age(1), Some(1), "agents hear what it sent in answer to tick 219");
}

#[test]
fn a_killed_or_stopped_world_ends_the_flight_before_the_tick_without_a_report() {
    for fault in ["at 2 s kill world", "at 2 s stop world"] {
        let flown = flown(&[fault]);
        assert!(flown.report.is_none());
        assert_eq!((flown.verdict(), flown.summary.last_tick), (Verdict::Failed, Some(199)));
        let last = flown.events.last().unwrap();
        assert_eq!(last.tick, Tick(200));
        assert!(matches!(last.event, Event::ProcessFault { part: Part::World, .. }), "{fault}: {last:?}");
    }
}

#[test]
fn an_agent_with_silent_senses_withholds_its_command_which_is_an_answer_too() {
    // The loss timeout is 1 s, and the last senses arrive in tick 199.
    let silent = "at 2 s link own->3 blackout";
    let mut flight = flight_to(&[silent], 298);
    assert!(flight.account(3).is_some());
    flight.step();
    assert!(flight.account(3).is_none() && flight.simulation.runs(UavId(3)));
    let mut killed = flight_to(&[silent, "at 2.99 s kill uav 3"], 298);
    killed.step();
    let uavs = |flight: &Flight| flight.frame().uavs.clone();
    assert_eq!(uavs(&flight), uavs(&killed), "in the sky, a withheld command is like none");
    assert_ne!(flight.hash(), killed.hash(), "and yet the agent answers");
}

#[test]
fn an_agent_whose_senses_return_commands_and_is_heard_at_once() {
    let faults = ["at 2 s link own->3 blackout for 3 s"];
    let mut flight = flight_to(&faults, 499);
    let mode = |flight: &Flight| flight.frame().uavs[2].state.unwrap().mode;
    assert!(flight.account(3).is_none());
    assert_eq!((flight.next_age(2), mode(&flight)), (Some(499 - 298), FlightMode::LOITER));
    flight.step();
    assert_eq!(flight.leader_age(3), Some(1), "it has listened all the time");
    flight.step();
    assert_eq!((flight.next_age(2), mode(&flight)), (Some(1), FlightMode::COMMANDED));
    assert_eq!(hash_of(&faults), hash_of(&faults));
}

#[test]
fn the_agent_of_a_vanished_uav_answers_and_changes_nothing_in_the_sky() {
    let vanishing = |faults: &[&str]| {
        let mut scenario = with_faults(preset("paper-4.1", &["failsafe=vanish"]), faults);
        scenario.time.duration_s = 10.0;
        scenario
    };
    let gone = fly(&vanishing(&["at 2 s kill uav 3"])).unwrap();
    assert!(events(&gone).contains(&(250, "failsafe")), "{:?}", events(&gone));
    assert!(gone.summary.uavs.iter().all(|uav| uav.uav != 3));
    let restarted = vanishing(&["at 2 s restart uav 3 after 2 s"]);
    let mut flight = Flight::new(&restarted);
    flight.fly_to(402);
    assert!(flight.simulation.sensed(UavId(3)).is_none() && flight.simulation.runs(UavId(3)));
    assert!(flight.account(3).is_none(), "with nothing to go by it withholds its command");
    let restarted = flight.finish();
    assert_eq!(restarted.summary.uavs, gone.summary.uavs, "nobody notices");
    assert_ne!(hash(&restarted), hash(&gone), "but it answers");
    assert_eq!(restarted.report.unwrap().refused_commands, 0);
}

#[test]
fn the_airframe_of_a_vanished_uav_refuses_what_a_thawed_agent_commands() {
    let mut scenario = scenario(&["at 2 s freeze uav 3 for 0.6 s"]);
    scenario.airframe.failsafe = ringwing_scenario::Failsafe::Vanish;
    let report = fly(&scenario).unwrap().report.unwrap();
    // It flies on its old senses for the rest of the loss timeout: from tick 259, which it finds open, to tick 298.
    assert_eq!(report.refused_commands, 40);
}

#[test]
fn a_slow_agent_changes_nothing() {
    let slow = flown(&["at 2 s slow uav 3 by 50 ms for 1 s"]);
    assert_eq!(hash(&slow), hash_of(&[]));
    assert_eq!(events(&slow), [(200, "fault.slow"), (300, "fault.healed")]);
}

#[test]
fn faults_of_the_recorder_change_nothing_but_events() {
    let undisturbed = flown(&[]);
    let faults_and_events: [(&str, &[(i64, &str)]); 4] = [
        ("at 2 s kill recorder", &[(200, "fault.kill")]),
        ("at 2 s stop recorder", &[(200, "fault.stop")]),
        ("at 2 s freeze recorder for 1 s", &[(200, "fault.freeze"), (300, "fault.thaw")]),
        ("at 2 s restart recorder after 1 s", &[(200, "fault.kill"), (300, "fault.start")]),
    ];
    for (fault, expected) in faults_and_events {
        let flown = flown(&[fault]);
        assert_eq!(hash(&flown), hash(&undisturbed), "{fault}");
        assert_eq!(flown.summary.uavs, undisturbed.summary.uavs);
        assert_eq!(events(&flown), expected);
    }
}

#[test]
fn a_killed_recorder_is_replaced_at_once_unless_its_fault_brings_it_back() {
    let killed = flown(&["at 2 s kill recorder", "at 3 s kill recorder"]);
    assert_eq!(refusals(&killed), [""; 0]);
    let restarting = flown(&["at 2 s restart recorder after 2 s", "at 3 s kill recorder"]);
    assert_eq!(refusals(&restarting), ["is gone already"]);
}

#[test]
fn an_action_applied_by_hand_is_the_same_as_a_scheduled_one() {
    let mut flight = flight_to(&[], 199);
    flight.kill(&[3]);
    flight.fly_to(299);
    flight.start(&[3]);
    let by_hand = flight.finish();
    let scheduled = flown(&["at 2 s kill uav 3", "at 3 s start uav 3"]);
    assert_eq!(hash(&by_hand), hash(&scheduled));
    assert_eq!(events(&by_hand), events(&scheduled));
}

#[test]
fn a_flight_in_real_time_is_refused() {
    let mut scenario = scenario(&[]);
    scenario.time.real_time = true;
    assert!(matches!(Simulation::new(&scenario), Err(SimulationError::RealTime(_))));
}
