use super::*;
use crate::testing;
use ringwing_flight::{AfterLoss, ProcessEnd};

fn scenario(sentences: &[&str]) -> Scenario {
    let mut scenario = testing::ring_of(6, 40.0);
    scenario.time.rate_hz = 100;
    scenario.faults = sentences.iter().map(|text| text.parse().unwrap()).collect();
    scenario
}

/// What became of the faults of a flight of `ticks` in which these `events` happened, and in which the links reported
/// the effects of the faults in `acted`.
fn effects(sentences: &[&str], ticks: i64, events: &[(i64, Event)], acted: &[u32]) -> FaultEffects {
    let scenario = scenario(sentences);
    let mut watch = EffectWatch::new(&scenario);
    for tick in 0..ticks {
        let of_tick = events.iter().filter(|(at, _)| *at == tick);
        of_tick.for_each(|(at, event)| {
            watch.on_event(&TimedEvent { tick: Tick(*at), event: event.clone() });
        });
        let mut frame = testing::at_rest(&scenario, tick);
        let report = |number| LinkTotals { link: "2->3".into(), acted: number, ..LinkTotals::default() };
        frame.links = acted.iter().map(|number| report(*number)).collect();
        watch.observe(&frame);
    }
    watch.effects(&[LinkTotals { link: "2->3".into(), ..LinkTotals::default() }])
}

fn applied(part: Part, action: ProcessAction, sentence: &str) -> Event {
    Event::ProcessFault { part, action, sentence: sentence.into() }
}

fn lost(part: Part) -> Event {
    let then = AfterLoss::Failsafe { before_flight: false };
    Event::ProcessLost { part, end: ProcessEnd::Killed(9), then }
}

const UAV_3: Part = Part::Agent(UavId(3));
const KILL: ProcessAction = ProcessAction::Kill { returns: false };

fn reasons(effects: &FaultEffects) -> Vec<&str> {
    effects.without_effect.iter().map(|idle| idle.reason.as_str()).collect()
}

fn idle(effects: &FaultEffects) -> Vec<&str> {
    effects.without_effect.iter().map(|idle| idle.fault.as_str()).collect()
}

#[test]
fn a_process_fault_acts_if_an_event_says_so() {
    let refused =
        |why: &str| Event::FaultRefused { part: Some(UAV_3), why: why.into(), sentence: "kill uav 3".into() };
    let faults = ["at 0.01 s kill uav 3", "at 0.05 s kill uav 3", "at 9 s kill uav 2"];
    let events = [(1, applied(UAV_3, KILL, "kill uav 3")), (5, refused("is gone already"))];
    let effects = effects(&faults, 10, &events, &[]);
    assert_eq!((effects.asked, effects.acted), (3, 1));
    assert_eq!(
        reasons(&effects),
        ["uav 3 is gone already", "it begins after the end of the flight at 0.09 s"]
    );
    assert_eq!(effects.without_effect[0].fault, "at 50 ms kill uav 3");
}

#[test]
fn a_link_fault_acts_if_its_receiver_says_so() {
    let faults = [
        "at 0 s link 2->3 loss 1 %",
        "at 0 s link 2->3 loss 5 %",
        "at 0 s link 2->5 blackout",
        "at 0 s link 2->3 delay 4 ms",
    ];
    let effects = effects(&faults, 10, &[], &[0, 2]);
    assert_eq!((effects.asked, effects.acted), (4, 1));
    assert_eq!(
        reasons(&effects),
        [
            "it altered no sample while it lasted",
            "nobody listened on such a link",
            "4 ms rounds to no tick at 100 Hz"
        ]
    );
}

#[test]
fn a_link_whose_end_is_gone_is_told_from_one_that_lost_nothing() {
    let events = [(1, applied(UAV_3, KILL, "kill uav 3"))];
    let faults = ["at 0.01 s kill uav 3", "at 0.05 s link 2->3 blackout"];
    assert_eq!(reasons(&effects(&faults, 10, &events, &[])), ["the sender or the receiver was not running"]);
}

#[test]
fn a_link_is_dead_while_a_process_at_its_end_is_lost_or_frozen_by_chance() {
    let lost = lost(UAV_3);
    let frozen = Event::ProcessFrozen { part: UAV_3 };
    let (thawed, ready) = (Event::ProcessThawed { part: UAV_3 }, Event::ProcessReady { part: UAV_3 });
    let reason = |events: &[(i64, Event)]| {
        reasons(&effects(&["at 0.02 s link 2->3 blackout"], 10, events, &[]))[0].to_owned()
    };
    for event in [lost.clone(), frozen.clone()] {
        assert_eq!(reason(&[(1, event)]), "the sender or the receiver was not running");
    }
    for events in [[(1, lost), (5, ready)], [(1, frozen), (5, thawed)]] {
        assert_eq!(reason(&events), "it altered no sample while it lasted");
    }
}

#[test]
fn a_healing_acts_if_there_is_something_to_heal_and_a_slow_fault_if_its_agent_runs() {
    let faults = [
        "at 0 s link 2->3 blackout",
        "at 0.05 s heal all",
        "at 0.06 s heal all",
        "at 0 s slow uav 3 by 1 ms",
    ];
    let result = effects(&faults, 10, &[], &[1]);
    assert_eq!((result.acted, reasons(&result)), (3, vec!["there was nothing to heal"]));
    assert_eq!(idle(&result), ["at 60 ms heal all"]);
    let gone = [(0, applied(UAV_3, KILL, "kill uav 3"))];
    let late = ["at 0 s kill uav 3", "at 0.05 s slow uav 3 by 1 ms"];
    assert_eq!(reasons(&effects(&late, 10, &gone, &[])), ["no such agent was running"]);
}

#[test]
fn a_failure_of_an_airframe_acts_if_the_agent_asks_for_what_it_cannot_do() {
    // At rest every agent asks for 15 m/s, straight on.
    let faults = [
        "at 0 s weaken uav 3 to 14 m/s",
        "at 0 s weaken uav 3 to 16 m/s",
        "at 0 s jam uav 2 turn at 5 deg/s",
        "at 0 s jam uav 2 turn at 0 deg/s",
    ];
    let result = effects(&faults, 10, &[], &[]);
    assert_eq!((result.asked, result.acted), (4, 2));
    assert_eq!(reasons(&result), ["no agent asked its airframe for what it could not do"; 2]);
}

#[test]
fn a_sensor_that_drifts_acts_once_an_agent_flies_with_a_reading_that_was_taken_meanwhile() {
    let scenario = scenario(&[
        "at 20 ms drift uav 1 position at 0.5 m/s toward 90 deg",
        "at 20 ms drift uav 2 position at 0.5 m/s toward 90 deg",
        "at 20 ms drift uav 3 position at 0.5 m/s toward 90 deg",
        "at 20 ms drift uav 1 heading at 1 deg/s",
        "at 20 ms drift uav 2 heading at 1 deg/s",
        "at 20 ms drift uav 1 heading at 0 deg/s",
    ]);
    let mut watch = EffectWatch::new(&scenario);
    for tick in 0..10 {
        let mut frame = testing::at_rest(&scenario, tick);
        let fix = |x_m| {
            Some(MeasuredFlight {
                position_m: [x_m, 0.0],
                heading_rad: x_m / 100.0,
                speed_m_s: 15.0,
                turn_rate_rad_s: 0.0,
            })
        };
        // UAV 1 gets a fix and a heading in every tick, UAV 2 none since tick 2, and the agent of UAV 3 is silent.
        for (uav, x_m) in [(0, tick), (1, tick.min(2)), (2, tick)] {
            frame.uavs[uav].state.as_mut().unwrap().measured = fix(x_m as f64);
        }
        frame.uavs[2].control = None;
        watch.observe(&frame);
    }
    let result = watch.effects(&[]);
    assert_eq!((result.asked, result.acted), (6, 2));
    assert_eq!(reasons(&result), ["no agent flew with what the sensor said"; 4]);
    assert_eq!(
        idle(&result),
        [
            "at 20 ms drift uav 2 position at 0.5 m/s toward 90 deg",
            "at 20 ms drift uav 3 position at 0.5 m/s toward 90 deg",
            "at 20 ms drift uav 2 heading at 1 deg/s",
            "at 20 ms drift uav 1 heading at 0 deg/s",
        ]
    );
}

#[test]
fn a_failure_takes_nothing_from_an_airframe_that_flies_at_its_limits() {
    let acted = |sentence: &str, speed_m_s: f64, turn_rate_rad_s: f64| {
        let scenario = scenario(&[sentence]);
        let mut watch = EffectWatch::new(&scenario);
        let mut frame = testing::at_rest(&scenario, 0);
        let control = frame.uavs[2].control.as_mut().unwrap();
        (control.speed_command_m_s, control.turn_rate_command_rad_s) = (speed_m_s, turn_rate_rad_s);
        watch.observe(&frame);
        watch.effects(&[]).acted == 1
    };
    // The airframe flies at 12 m/s at least, and turns at 0.5 rad/s at most.
    assert!(!acted("at 0 s weaken uav 3 to 5 m/s", 12.0, 0.0));
    assert!(acted("at 0 s weaken uav 3 to 5 m/s", 12.1, 0.0));
    assert!(!acted("at 0 s jam uav 3 turn at 40 deg/s", 15.0, 0.5));
    assert!(acted("at 0 s jam uav 3 turn at 40 deg/s", 15.0, 0.4));
}

#[test]
fn without_a_command_a_jam_keeps_the_failsafe_from_its_circle_and_a_weak_engine_hinders_nothing() {
    let scenario = scenario(&["at 0 s weaken uav 3 to 13 m/s", "at 0 s jam uav 3 turn at 0 deg/s"]);
    let mut watch = EffectWatch::new(&scenario);
    let mut frame = testing::at_rest(&scenario, 0);
    frame.uavs[2].control = None;
    watch.observe(&frame);
    assert_eq!(idle(&watch.effects(&[])), ["at 0 s weaken uav 3 to 13 m/s"]);
}

#[test]
fn each_kind_of_fault_without_effect_has_its_own_reason() {
    let gone = lost(UAV_3);
    let faults = ["at 0 s weaken uav 3 to 16 m/s", "at 0.01 s slow uav 3 by 1 ms", "at 0.05 s kill uav 2"];
    assert_eq!(
        reasons(&effects(&faults, 10, &[(0, gone)], &[])),
        [
            "no agent asked its airframe for what it could not do",
            "no such agent was running",
            "the flight ended before it was applied",
        ]
    );
}

#[test]
fn a_fault_that_is_asked_for_live_counts_like_one_of_the_scenario() {
    let requested = |sentence: &str| Event::FaultRequested { sentence: sentence.into() };
    // The scenario's fault with the same words comes later, so the event belongs to the live one.
    let events = [
        (2, requested("at 20 ms kill uav 3")),
        (2, applied(UAV_3, KILL, "kill uav 3")),
        (3, requested("at 30 ms link 2->3 delay trace {1")),
        (4, requested("at 40 ms link 2->3 blackout")),
    ];
    let effects = effects(&["at 5 s kill uav 3"], 10, &events, &[4]);
    assert_eq!((effects.asked, effects.acted), (4, 2));
    assert_eq!(idle(&effects), ["at 5 s kill uav 3", "at 30 ms link 2->3 delay trace {1"]);
    assert!(reasons(&effects)[1].starts_with("its sentence is too long"));
}

#[test]
fn a_requirement_that_every_fault_acts_names_the_first_that_did_not() {
    let idle = IdleFault { fault: "at 9 s kill uav 3".into(), reason: "uav 3 is gone already".into() };
    let effects = FaultEffects { asked: 3, acted: 1, without_effect: vec![idle.clone(), idle] };
    assert_eq!(judge(false, &effects), None);
    assert_eq!(judge(true, &FaultEffects::default()), None);
    assert_eq!(
        judge(true, &effects).unwrap(),
        "without effect: at 9 s kill uav 3 (uav 3 is gone already), and 1 more; required that every fault acts"
    );
    let alone = FaultEffects { asked: 3, acted: 2, without_effect: effects.without_effect[..1].to_vec() };
    assert_eq!(
        judge(true, &alone).unwrap(),
        "without effect: at 9 s kill uav 3 (uav 3 is gone already); required that every fault acts"
    );
}
