use super::*;
use crate::testing::{self, at_rest};
use proptest::prelude::*;
use ringwing_flight::{Collider, UavId};

fn measured(scenario: &Scenario, frames: &[Frame]) -> FlightSummary {
    let mut metrics = Metrics::new(scenario);
    for frame in frames {
        metrics.observe(frame);
    }
    metrics.summary()
}

fn state(frame: &mut Frame, number: usize) -> &mut TrueState {
    frame.uavs[number - 1].state.as_mut().unwrap()
}

#[test]
fn a_flight_without_frames_has_no_numbers() {
    let summary = measured(&Scenario::default(), &[]);
    assert_eq!(summary, FlightSummary::default());
}

#[test]
fn the_formation_at_rest_has_no_errors() {
    let scenario = testing::ring_of(6, 40.0);
    let frames: Vec<_> = (0..=700).map(|tick| at_rest(&scenario, tick)).collect();
    let summary = measured(&scenario, &frames);
    assert_eq!((summary.settling_s, summary.ticks, summary.last_tick), (Some(0.0), 701, Some(700)));
    assert!(summary.slot_error_max_m.unwrap() < 1e-9 && summary.slot_error_rms_m.unwrap() < 1e-9);
    assert!(summary.neighbour_error_max_m.unwrap() < 1e-9 && summary.radius_error_max_m.unwrap() < 1e-9);
    assert!((summary.closest_adjacent.unwrap().distance_m - 40.0).abs() < 1e-9);
    assert!((summary.closest_other.unwrap().distance_m - 40.0 * 3f64.sqrt()).abs() < 1e-9);
    assert_eq!((summary.speed_min_m_s, summary.speed_max_m_s), (Some(15.0), Some(15.0)));
    assert_eq!((summary.speed_saturated_share, summary.uavs.len()), (Some(0.0), 6));
}

#[test]
fn errors_are_those_of_the_last_frame() {
    let scenario = testing::ring_of(4, 10.0);
    let mut frame = at_rest(&scenario, 0);
    (state(&mut frame, 1).slot_error_m, state(&mut frame, 2).slot_error_m) = (Some(3.0), Some(4.0));
    (state(&mut frame, 3).slot_error_m, state(&mut frame, 4).slot_error_m) = (Some(0.0), Some(0.0));
    state(&mut frame, 2).next_distance_m = Some(7.0);
    state(&mut frame, 4).leader_distance_m = Some(scenario.formation().radius_m() + 2.5);
    let summary = measured(&scenario, &[frame]);
    assert_eq!((summary.slot_error_max_m, summary.slot_error_rms_m), (Some(4.0), Some(2.5)));
    assert_eq!(summary.neighbour_error_max_m, Some(3.0));
    assert!((summary.radius_error_max_m.unwrap() - 2.5).abs() < 1e-12);
    assert_eq!(summary.uavs[1].next_distance_m, Some(7.0));
}

#[test]
fn a_uav_in_its_failsafe_has_no_slot_error_but_can_come_close() {
    let scenario = testing::ring_of(3, 10.0);
    let mut frame = at_rest(&scenario, 0);
    let (x, y) = (state(&mut frame, 2).x_m, state(&mut frame, 2).y_m);
    let stray = state(&mut frame, 1);
    (stray.mode, stray.slot_error_m) = (FlightMode::LOITER, Some(99.0));
    (stray.x_m, stray.y_m) = (x + 0.5, y);
    let summary = measured(&scenario, &[frame]);
    assert!(summary.slot_error_max_m.unwrap() < 1e-9);
    assert_eq!(summary.closest_pair.map(|pair| pair.distance_m), Some(0.5));
    assert_eq!(summary.closest_other, None);
    assert_eq!(summary.uavs.iter().map(|uav| uav.commanded).collect::<Vec<_>>(), [false, true, true]);
}

#[test]
fn a_vanished_uav_is_close_to_nothing() {
    let scenario = testing::ring_of(3, 10.0);
    let mut frame = at_rest(&scenario, 0);
    frame.uavs[0].state = None;
    state(&mut frame, 2).mode = FlightMode::VANISHED;
    let summary = measured(&scenario, &[frame]);
    assert_eq!((summary.closest_pair, summary.uavs.len()), (None, 1));
}

#[test]
fn saturated_commands_are_a_share_of_all() {
    let scenario = testing::ring_of(4, 10.0);
    let mut frame = at_rest(&scenario, 0);
    frame.uavs[0].control.as_mut().unwrap().speed_saturated = true;
    for uav in [1, 2] {
        frame.uavs[uav].control.as_mut().unwrap().turn_rate_saturated = true;
    }
    frame.uavs[3].control = None;
    let summary = measured(&scenario, &[frame.clone(), frame]);
    assert_eq!(summary.speed_saturated_share, Some(1.0 / 3.0));
    assert_eq!(summary.turn_rate_saturated_share, Some(2.0 / 3.0));
}

#[test]
fn the_extremes_are_those_of_all_frames_and_turns_count_in_either_direction() {
    let scenario = testing::ring_of(3, 10.0);
    let flown = |tick, speed_m_s, turn_rate_rad_s| {
        let mut frame = at_rest(&scenario, tick);
        let state = state(&mut frame, 2);
        (state.speed_m_s, state.turn_rate_rad_s) = (speed_m_s, turn_rate_rad_s);
        frame
    };
    let summary = measured(&scenario, &[flown(0, 15.0, 0.1), flown(1, 13.0, -0.4), flown(2, 18.0, 0.2)]);
    assert_eq!((summary.speed_min_m_s, summary.speed_max_m_s), (Some(13.0), Some(18.0)));
    assert_eq!(summary.turn_rate_max_rad_s, Some(0.4));
}

#[test]
fn without_a_leader_there_are_no_slot_errors() {
    let scenario = testing::ring_of(3, 10.0);
    let mut frame = at_rest(&scenario, 0);
    (1..=3).for_each(|number| state(&mut frame, number).slot_error_m = None);
    let summary = measured(&scenario, &[frame]);
    assert_eq!((summary.slot_error_max_m, summary.slot_error_rms_m), (None, None));
}

#[test]
fn near_misses_are_counted_up_to_each_moment_and_in_the_end() {
    let scenario = testing::ring_of(3, 10.0);
    let mut metrics = Metrics::new(&scenario);
    for tick in 0..2 {
        let event = Event::NearMiss {
            uav: UavId(1),
            with: Collider::Uav(UavId(2)),
            distance_m: 5.0,
            position_m: [0.0; 2],
            closest: Tick(tick),
        };
        metrics.on_event(&TimedEvent { tick: Tick(tick), event });
        metrics.observe(&at_rest(&scenario, tick));
        assert_eq!(metrics.moment().near_misses, tick as u64 + 1);
    }
    assert_eq!(metrics.summary().near_misses, 2);
}

#[test]
fn a_moment_has_the_filters_that_act_and_the_views_and_a_summary_their_time_in_seconds() {
    let mut scenario = testing::ring_of(3, 10.0);
    (scenario.control.collision_filter, scenario.time.rate_hz) = (true, 100);
    let mut metrics = Metrics::new(&scenario);
    for tick in 0..250 {
        let mut frame = at_rest(&scenario, tick);
        let control = frame.uavs[1].control.as_mut().unwrap();
        control.avoided = Some(AvoidedThing { uav: None, intruder: None, place_m: [0.0; 2], turn_rad: 0.1 });
        control.lost_fingerprint = 5;
        metrics.observe(&frame);
    }
    assert_eq!((metrics.moment().avoidance.acting, metrics.moment().views), (1, 2));
    assert_eq!(metrics.summary().filter_longest_s, Some(2.5));
}

proptest! {
    #[test]
    fn a_summary_can_be_read_back_whatever_the_numbers(x: f64, y: f64, speed: f64, error: f64) {
        let scenario = Scenario { obstacles: vec![testing::obstacle([0.0, 0.0])], ..testing::ring_of(3, 10.0) };
        let mut frame = at_rest(&scenario, 0);
        let odd = state(&mut frame, 2);
        (odd.x_m, odd.y_m, odd.speed_m_s, odd.slot_error_m) = (x, y, speed, Some(error));
        let summary = measured(&scenario, &[frame]);
        let text = serde_json::to_string(&summary).unwrap();
        prop_assert_eq!(serde_json::from_str::<FlightSummary>(&text).is_ok(), true, "{}", text);
    }
}
