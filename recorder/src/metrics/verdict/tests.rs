use super::*;
use crate::{
    Metrics,
    metrics::{ClosestPair, Frame, IntruderSummary, ObstacleSummary, UavFrame},
    testing,
};
use ringwing_flight::{AfterLoss, Event, FlightMode, Part, ProcessEnd, Tick, TimedEvent, UavId};
use ringwing_scenario::ManoeuvreSection;

/// A ring of `uavs` at 10 Hz past an obstacle far away, with every requirement, each of which an undisturbed flight meets.
fn strict(uavs: u32) -> Scenario {
    let mut scenario = testing::ring_of(uavs, 40.0);
    scenario.time.rate_hz = 10;
    scenario.obstacles = vec![testing::obstacle([0.0, 900.0])];
    scenario.requirements = RequirementsSection {
        collisions_max: Some(0),
        clearance_min_m: Some(2.0),
        separation_min_m: Some(10.0),
        // There are no intruders here; a test of its own has one.
        intruder_distance_min_m: None,
        settling_max_s: Some(20.0),
        // Of an undisturbed flight it cannot be measured.
        recovery_max_s: None,
        slot_error_max_m: Some(0.05),
        // These flights end in their first half; `keeping` has it.
        keeping_error_rms_max_m: None,
        turn_rate_saturated_share_max: Some(0.25),
        unplanned_losses_max: 0,
        repeatable: true,
        faults_act: true,
    };
    scenario
}

/// As [`strict`], and the formation has to be kept as well.
fn keeping(uavs: u32) -> Scenario {
    let mut scenario = strict(uavs);
    scenario.requirements.keeping_error_rms_max_m = Some(0.5);
    scenario
}

/// The summary of a flight of `scenario` at rest over `ticks`, with each frame changed by `change`.
fn flown(scenario: &Scenario, ticks: i64, change: impl Fn(i64, &mut Frame)) -> FlightSummary {
    let mut metrics = Metrics::new(scenario);
    for tick in 0..ticks {
        let mut frame = testing::at_rest(scenario, tick);
        change(tick, &mut frame);
        metrics.observe(&frame);
    }
    metrics.summary()
}

fn judged(scenario: &Scenario, summary: &FlightSummary) -> Vec<String> {
    judge(scenario, summary, Some(0))
}

fn kill(frame: &mut Frame, number: usize) {
    let uav = &mut frame.uavs[number - 1];
    uav.state.as_mut().unwrap().mode = FlightMode::LOITER;
    uav.control = None;
}

const NOT_MEASURED: [&str; 8] = [
    "no tick of the flight was measured",
    "collisions not measured, required at most 0",
    "clearance of tower not measured, required at least 2 m",
    "closest pair not measured, as no two UAVs flew, required at least 10 m",
    "settling not measured, required within 20 s",
    "largest slot error at the end not measured, required at most 0.05 m",
    "slot error over the second half of the flight not measured, required at most 0.5 m root mean square",
    "turn rates of commands not measured, required cut in at most 25 %",
];

#[test]
fn an_undisturbed_flight_meets_every_requirement() {
    let scenario = strict(6);
    assert_eq!(judged(&scenario, &flown(&scenario, 100, |_, _| ())), [""; 0]);
}

#[test]
fn a_flight_without_a_tick_meets_no_requirement() {
    let scenario = keeping(6);
    assert_eq!(judged(&scenario, &flown(&scenario, 0, |_, _| ())), NOT_MEASURED);
    assert_eq!(judge(&Scenario::default(), &FlightSummary::default(), Some(0)), NOT_MEASURED[..1]);
}

#[test]
fn an_empty_sky_meets_no_requirement_but_that_it_had_no_collision() {
    let scenario = strict(6);
    let nothing = |_, frame: &mut Frame| frame.uavs.iter_mut().for_each(|uav| *uav = UavFrame::default());
    let summary = flown(&scenario, 100, nothing);
    let expected = [
        "no UAV flies on command at the end",
        NOT_MEASURED[2],
        NOT_MEASURED[3],
        "the formation never settled, required within 20 s",
        NOT_MEASURED[5],
        NOT_MEASURED[7],
    ];
    assert_eq!(judged(&scenario, &summary), expected);
}

#[test]
fn one_uav_has_no_separation() {
    let scenario = strict(3);
    let only = |_, frame: &mut Frame| frame.uavs[1..].iter_mut().for_each(|uav| uav.state = None);
    assert_eq!(judged(&scenario, &flown(&scenario, 100, only)), [NOT_MEASURED[3]]);
}

#[test]
fn a_flight_that_is_interrupted_early_has_not_settled() {
    let scenario = strict(6);
    let expected = "settling not seen to the end: every slot error was within 1 m from 0.00 s on, but not yet for 5 s, \
                    required within 20 s";
    assert_eq!(judged(&scenario, &flown(&scenario, 50, |_, _| ())), [expected]);
    assert_eq!(judged(&scenario, &flown(&scenario, 51, |_, _| ())), [""; 0]);
}

#[test]
fn a_flight_that_ends_in_the_middle_of_a_recovery_is_judged_by_its_last_tick() {
    let scenario = strict(6);
    let summary = flown(&scenario, 100, |tick, frame| {
        if tick > 90 {
            frame.uavs[2].state.as_mut().unwrap().slot_error_m = Some(7.5);
        }
    });
    let expected = "largest slot error at the end 7.500 m (uav 3), required at most 0.05 m";
    assert_eq!(judged(&scenario, &summary), [expected]);
}

#[test]
fn nobody_alive_is_no_success_whatever_is_required() {
    let scenario = strict(6);
    let dead = |tick, frame: &mut Frame| {
        if tick >= 80 {
            (1..=6).for_each(|number| kill(frame, number));
        }
    };
    let summary = flown(&scenario, 100, dead);
    let expected = ["no UAV flies on command at the end", NOT_MEASURED[5]];
    assert_eq!(judged(&scenario, &summary), expected);
    let mut lenient = scenario;
    lenient.requirements = RequirementsSection::default();
    assert_eq!(judged(&lenient, &summary), expected[..1]);
    // Nor is a swarm that was dead from the beginning.
    let never = flown(&lenient, 100, |_, frame| (1..=6).for_each(|number| kill(frame, number)));
    assert_eq!(judged(&lenient, &never), expected[..1]);
    assert_eq!(never.settling_s, None);
}

#[test]
fn without_the_leader_there_is_no_slot_error_to_judge() {
    let scenario = strict(6);
    let summary = flown(&scenario, 100, |tick, frame| {
        if tick >= 80 {
            frame.uavs.iter_mut().for_each(|uav| uav.state.as_mut().unwrap().slot_error_m = None);
        }
    });
    assert_eq!(judged(&scenario, &summary), [NOT_MEASURED[5]]);
}

#[test]
fn a_clearance_without_an_obstacle_is_not_measured() {
    let mut scenario = strict(6);
    scenario.obstacles.clear();
    let expected = "clearance not measured, as there is no obstacle, required at least 2 m";
    assert_eq!(judged(&scenario, &flown(&scenario, 100, |_, _| ())), [expected]);
}

#[test]
fn an_intruder_keeps_its_distance_and_must_be_there_to_be_measured() {
    let mut scenario = strict(6);
    scenario.requirements.intruder_distance_min_m = Some(5.0);
    let rest = |scenario: &Scenario| flown(scenario, 100, |_, _| ());
    assert_eq!(
        judged(&scenario, &rest(&scenario)),
        ["distance of intruders not measured, because nobody intrudes, required at least 5 m"]
    );
    // Slot 1 is behind the leader, so UAV 1 begins at (-40, 0); the intruder is 4 m north of there and flies on.
    scenario.intruders = vec![testing::intruder([-40.0, 4.0])];
    assert_eq!(
        judged(&scenario, &rest(&scenario)),
        ["intruder 1 at 4.00 m (uav 1 at 0.00 s), required at least 5 m"]
    );
    scenario.intruders = vec![testing::intruder([-40.0, -400.0])];
    assert_eq!(judged(&scenario, &rest(&scenario)), [""; 0]);
}

/// A flight in numbers that no frame has to give.
fn flight(clearance_m: f64, distance_m: f64, settling_s: f64, slot_error_m: f64) -> FlightSummary {
    let name = "tower".into();
    FlightSummary {
        ticks: 1000,
        commanded: 6,
        settling_s: Some(settling_s),
        slot_error_max_m: Some(slot_error_m),
        keeping_error_rms_m: Some(0.5),
        turn_rate_saturated_share: Some(0.25),
        closest_pair: Some(ClosestPair { distance_m, uav: 2, other: 5, time_s: 12.31 }),
        obstacles: vec![ObstacleSummary { name, clearance_m, uav: 3, time_s: 60.0, repelled: vec![3] }],
        ..FlightSummary::default()
    }
}

#[test]
fn a_flight_at_its_limits_passes() {
    let mut scenario = keeping(6);
    scenario.requirements.intruder_distance_min_m = Some(5.0);
    scenario.requirements.recovery_max_s = Some(2.0);
    let summary = FlightSummary {
        intruders: vec![IntruderSummary { intruder: 1, distance_m: 5.0, uav: 3, time_s: 60.0 }],
        fault_moments: 1,
        recovery_max_s: Some(2.0),
        ..flight(2.0, 10.0, 20.0, 0.05)
    };
    assert_eq!(judged(&scenario, &summary), [""; 0]);
}

#[test]
fn a_verdict_has_the_same_name_in_results_as_in_a_summary() {
    for (verdict, name) in
        [(Verdict::Passed, "passed"), (Verdict::Violated, "violated"), (Verdict::Failed, "failed")]
    {
        assert_eq!((verdict.name(), serde_json::to_value(verdict).unwrap()), (name, name.into()));
    }
}

#[test]
fn each_violation_names_what_was_and_what_was_required() {
    let summary = FlightSummary {
        turn_rate_saturated_share: Some(0.2508),
        keeping_error_rms_m: Some(0.51),
        ..flight(-0.5, 1.3, 31.4, 0.7)
    };
    assert_eq!(
        judge(&keeping(6), &summary, Some(1)),
        [
            "1 collision, required at most 0",
            "clearance of tower -0.50 m (uav 3 at 60.00 s), required at least 2 m",
            "closest pair 1.30 m (uav 2 and 5 at 12.31 s), required at least 10 m",
            "the formation settled at 31.40 s, required within 20 s",
            "largest slot error at the end 0.700 m, required at most 0.05 m",
            "slot error over the second half of the flight 0.510 m root mean square, required at most 0.5 m",
            "turn rate cut in 25.1 % of the commands, required in at most 25 %",
        ]
    );
    assert_eq!(judge(&strict(6), &summary, None)[0], NOT_MEASURED[1]);
    assert_eq!(judge(&Scenario::default(), &summary, Some(7)), [""; 0]);
}

/// What a flight at rest violates in which these events happen at 1 s, 2 s, ...
fn violated_by(scenario: &Scenario, events: &[Event]) -> Vec<String> {
    let mut metrics = Metrics::new(scenario);
    for (second, event) in (1..).zip(events) {
        metrics.on_event(&TimedEvent { tick: Tick(10 * second), event: event.clone() });
    }
    (0..100).for_each(|tick| metrics.observe(&testing::at_rest(scenario, tick)));
    judged(scenario, &metrics.summary())
}

fn lost(uav: u32, signal: i32) -> Event {
    let then = AfterLoss::Failsafe { before_flight: false };
    Event::ProcessLost { part: Part::Agent(UavId(uav)), end: ProcessEnd::Killed(signal), then }
}

#[test]
fn processes_that_die_unasked_violate_unless_as_many_are_allowed() {
    let mut scenario = strict(6);
    scenario.requirements.repeatable = false;
    let events = [lost(3, 7), lost(4, 9), lost(5, 11), lost(6, 9)];
    let expected = "4 processes lost unplanned (uav 3 killed by signal 7 (SIGBUS) at 1.00 s, \
                    uav 4 killed by signal 9 (SIGKILL) at 2.00 s, uav 5 killed by signal 11 (SIGSEGV) at 3.00 s \
                    and 1 more), required at most 0";
    assert_eq!(violated_by(&scenario, &events), [expected]);
    scenario.requirements.unplanned_losses_max = 4;
    assert_eq!(violated_by(&scenario, &events), [""; 0]);
    scenario.requirements.unplanned_losses_max = 3;
    assert_eq!(violated_by(&scenario, &events).len(), 1);
    scenario.requirements.unplanned_losses_max = 0;
    assert_eq!(
        violated_by(&scenario, &[lost(3, 9)]),
        ["1 process lost unplanned (uav 3 killed by signal 9 (SIGKILL) at 1.00 s), required at most 0"]
    );
}

#[test]
fn chance_violates_where_the_flight_has_to_be_repeatable() {
    let mut scenario = strict(6);
    let frozen = Event::ProcessFrozen { part: Part::Agent(UavId(3)) };
    let thawed = Event::ProcessThawed { part: Part::Agent(UavId(3)) };
    let outside = [frozen, thawed];
    let violated = violated_by(&scenario, &outside);
    assert!(violated[0].starts_with("not repeatable: uav 3 is frozen (SIGSTOP) at 1.00 s"), "{violated:?}");
    scenario.requirements.repeatable = false;
    assert_eq!(violated_by(&scenario, &outside), [""; 0]);
}

#[test]
fn a_flight_in_lockstep_that_does_not_wait_is_no_success() {
    let mut scenario = strict(6);
    scenario.requirements = RequirementsSection::default();
    let silent = Event::ProcessSilent { part: Part::Agent(UavId(3)), waited_s: 2.0 };
    let expected = "lockstep was broken at 1.00 s: uav 3 has not answered for 2.0 s; flying on";
    let violated = violated_by(&scenario, std::slice::from_ref(&silent));
    assert!(violated.len() == 1 && violated[0].starts_with(expected), "{violated:?}");
    scenario.time.real_time = true;
    assert_eq!(violated_by(&scenario, &[silent]), [""; 0]);
}

#[test]
fn recovery_has_to_be_measured_seen_and_quick() {
    let mut scenario = testing::ring_of(3, 40.0);
    scenario.time.rate_hz = 10;
    scenario.requirements.recovery_max_s = Some(2.0);
    let judge = |scenario: &Scenario, ticks: i64, broken: i64| {
        let summary = flown(scenario, ticks, |tick, frame| {
            if (10..10 + broken).contains(&tick) {
                frame.uavs[0].state.as_mut().unwrap().slot_error_m = Some(3.0);
            }
        });
        judged(scenario, &summary)
    };
    assert_eq!(
        judge(&scenario, 100, 0),
        ["recovery not measured, as there was no fault or manoeuvre, required within 2 s"]
    );
    scenario.manoeuvres = vec![ManoeuvreSection { at_s: 1.0, over_s: 1.0, ..ManoeuvreSection::default() }];
    assert_eq!(judge(&scenario, 100, 15), [""; 0]);
    assert_eq!(judge(&scenario, 100, 30), ["longest recovery 3.00 s, required within 2 s"]);
    assert_eq!(
        judge(&scenario, 40, 15),
        ["recovery not seen after every fault and manoeuvre, required within 2 s"]
    );
}
