//! Frames of payloads.

use super::*;
use crate::testing;
use ringwing_flight::{AircraftId, IntruderId, SensedObstacle};

/// The sample of a UAV with perfect sensors that sense this.
fn sample(sensed: &Sensed) -> AirframeSample {
    AirframeSample::new(sensed, &testing::truth(sensed))
}

#[test]
fn terms_are_rounded_as_the_log_has_them_and_missing_data_have_no_age() {
    let third = 1.0 / 3.0;
    let account = Account {
        previous_force_m: [third, 2.0],
        next_force_m: [third, 3.0],
        repulsion_m: [third, 0.0],
        ..testing::account(7, 3)
    };
    let terms = ControlTerms::of(&account, 100);
    assert_eq!(terms.previous_force_m[0], f64::from(third as f32));
    assert_eq!(terms.neighbour_force_m(), [f64::from((2.0 * f64::from(third as f32)) as f32), 5.0]);
    assert_eq!(terms.repulsion_length_m(), third);
    assert_eq!((terms.previous_age_s, terms.leader_age_s), (None, None));
    assert_eq!(terms.wind_estimate_m_s, None, "the agent assumes still air");
    let windy = Account { wind_m_s: [0.0, -3.0], ..account };
    assert_eq!(ControlTerms::of(&windy, 100).wind_estimate_m_s, Some([0.0, -3.0]));
}

#[test]
fn each_flag_of_an_account_is_kept_apart_from_the_others() {
    let told = |account: Account| {
        let terms = ControlTerms::of(&account, 100);
        [terms.speed_saturated, terms.turn_rate_saturated, terms.leader_silent, terms.slots_moving]
    };
    let calm =
        Account { speed_saturated: 0, turn_rate_saturated: 0, leader_silent: 0, ..testing::account(7, 3) };
    assert_eq!(told(Account { slots_moving: 0, ..calm }), [false; 4]);
    assert_eq!(told(Account { speed_saturated: 1, ..calm }), [true, false, false, false]);
    assert_eq!(told(Account { turn_rate_saturated: 1, ..calm }), [false, true, false, false]);
    assert_eq!(told(Account { leader_silent: 1, ..calm }), [false, false, true, false]);
    assert_eq!(told(Account { slots_moving: 1, ..calm }), [false, false, false, true]);
}

#[test]
fn what_a_filter_avoids_is_a_uav_an_intruder_an_obstacle_or_nothing() {
    let avoided = |avoided| {
        let account =
            Account { avoided, avoided_m: [3.0, 4.0], avoided_turn_rad: -0.5, ..testing::account(7, 3) };
        ControlTerms::of(&account, 100).avoided
    };
    let thing = |uav, intruder| Some(AvoidedThing { uav, intruder, place_m: [3.0, 4.0], turn_rad: -0.5 });
    assert_eq!(avoided(Avoided::NOTHING), None);
    assert_eq!(avoided(Avoided::OBSTACLE), thing(None, None));
    assert_eq!(avoided(Avoided::aircraft(AircraftId::uav(UavId(2)))), thing(Some(2), None));
    assert_eq!(avoided(Avoided::aircraft(AircraftId::intruder(IntruderId(1)))), thing(None, Some(1)));
}

#[test]
fn what_sensors_say_is_kept_if_any_of_it_is_not_the_truth() {
    let sensed = testing::sensed(0, 1, [3.0, 4.0]);
    let truth = testing::truth(&sensed);
    let said = MeasuredFlight {
        position_m: sensed.position_m,
        heading_rad: sensed.heading_rad,
        speed_m_s: sensed.speed_m_s,
        turn_rate_rad_s: sensed.turn_rate_rad_s,
    };
    assert_eq!(AirframeSample::new(&sensed, &truth).measured, None);
    for truth in [
        Truth { position_m: [3.0, 5.0], ..truth },
        Truth { heading_rad: 0.1, ..truth },
        Truth { speed_m_s: 16.0, ..truth },
        Truth { turn_rate_rad_s: 0.1, ..truth },
    ] {
        assert_eq!(AirframeSample::new(&sensed, &truth).measured, Some(said), "{truth:?}");
    }
}

#[test]
fn the_wind_carries_an_airframe_and_agents_are_off_by_what_they_do_not_know_of_it() {
    let scenario = testing::ring_of(3, 40.0);
    let mut frame = testing::at_rest(&scenario, 0);
    let mut uav = frame.uavs[0];
    assert_eq!((frame.wind_m_s(), uav.wind_error_m_s()), (None, None), "the air is still");
    assert_eq!((uav.state.unwrap().wind_speed_m_s(), uav.state.unwrap().course_rad()), (None, 0.0));
    uav.state.as_mut().unwrap().wind_m_s = Some([-12.0, 4.0]);
    let state = uav.state.unwrap();
    // Its heading is east, at 15 m/s through the air.
    assert_eq!(state.velocity_m_s(), Vector2::new(3.0, 4.0));
    assert!((state.course_rad() - 4.0_f64.atan2(3.0)).abs() < 1e-12);
    assert!((state.wind_speed_m_s().unwrap() - 160.0_f64.sqrt()).abs() < 1e-12);
    assert_eq!(uav.wind_error_m_s(), state.wind_speed_m_s(), "the agent assumes still air");
    uav.control.as_mut().unwrap().wind_estimate_m_s = Some([-9.0, 0.0]);
    assert_eq!(uav.wind_error_m_s(), Some(5.0));
    frame.uavs[0] = uav;
    frame.uavs[1].state.as_mut().unwrap().wind_m_s = Some([-6.0, 0.0]);
    assert_eq!(frame.wind_m_s(), Some(Vector2::new(-9.0, 2.0)));
}

#[test]
fn a_frame_measures_from_true_positions() {
    let scenario = testing::ring_of(4, 10.0);
    let radius = scenario.formation().radius_m();
    let mut samples = TickSamples::new(4);
    samples.leader = Some(testing::leader(0, [100.0, 0.0]));
    // The slot of UAV 1 lies behind the leader.
    let east = 103.0 - radius;
    let mut sensed = testing::sensed(0, 1, [east, 4.0]);
    sensed.obstacle_count = 1;
    sensed.obstacles[0] = SensedObstacle { position_m: [east, 16.0], ..SensedObstacle::default() };
    samples.airframes[0] = Some(sample(&sensed));
    samples.airframes[3] = Some(sample(&testing::sensed(0, 4, [east, -2.0])));
    let mut frame = Frame::new(&scenario);
    frame.refill(&samples, 100);
    let state = frame.uavs[0].state.unwrap();
    assert_eq!((state.previous_distance_m, state.next_distance_m), (Some(6.0), None));
    assert!((state.slot_error_m.unwrap() - 5.0).abs() < 1e-12);
    assert_eq!(state.obstacle_distance_m, Some(12.0));
    assert_eq!(state.mode, FlightMode::COMMANDED);
    assert_eq!((&frame.uavs[1].state, &frame.uavs[0].control), (&None, &None));
}

#[test]
fn a_closed_ring_is_that_of_the_uavs_that_fly_on_command() {
    let mut scenario = testing::ring_of(4, 10.0);
    scenario.control.ring_closes = true;
    let mut ring = scenario.whole_ring();
    ring.reform(|number| number != 2);
    let mut samples = TickSamples::new(4);
    samples.leader = Some(testing::leader(0, [0.0, 0.0]));
    for number in 1..=4 {
        let mut sensed = testing::sensed(0, number, ring.slot(number).offset().into());
        if number == 2 {
            sensed.mode = FlightMode::LOITER;
        }
        samples.airframes[number as usize - 1] = Some(sample(&sensed));
    }
    let mut frame = Frame::new(&scenario);
    frame.refill(&samples, 100);
    for number in [1, 3, 4] {
        let state = frame.uavs[number - 1].state.as_ref().unwrap();
        assert!(state.slot_error_m.unwrap() < 1e-9, "{number}");
        assert!((state.next_distance_m.unwrap() - 10.0).abs() < 1e-9, "{number}");
    }
}

#[test]
fn in_the_leaders_frame_slots_turn_with_its_heading() {
    let mut scenario = testing::ring_of(4, 10.0);
    scenario.formation.frame = ringwing_flight::FormationFrame::Leader;
    let radius = scenario.formation().radius_m();
    let mut samples = TickSamples::new(4);
    let leader = testing::leader(0, [100.0, 0.0]);
    samples.leader = Some(LeaderState { heading_rad: std::f64::consts::FRAC_PI_2, ..leader });
    // The slot of UAV 1 lies behind the leader, which heads north.
    samples.airframes[0] = Some(sample(&testing::sensed(0, 1, [103.0, -radius])));
    let mut frame = Frame::new(&scenario);
    frame.refill(&samples, 100);
    assert!((frame.uavs[0].state.unwrap().slot_error_m.unwrap() - 3.0).abs() < 1e-9);
}

#[test]
fn without_a_leader_there_is_no_slot() {
    let scenario = testing::ring_of(3, 10.0);
    let mut samples = TickSamples::new(3);
    samples.airframes[1] = Some(sample(&testing::sensed(0, 2, [1.0, 2.0])));
    let mut frame = Frame::new(&scenario);
    frame.refill(&samples, 100);
    let state = frame.uavs[1].state.as_ref().unwrap();
    assert_eq!((state.slot_m, state.slot_error_m, state.leader_distance_m), (None, None, None));
}

#[test]
fn errors_count_from_the_truth_whatever_the_sensors_say_and_the_agent_believes() {
    let scenario = testing::ring_of(3, 40.0);
    let mut samples = TickSamples::new(3);
    let sensed = testing::sensed(0, 1, [3.0, 4.0]);
    let truth = Truth { position_m: [0.0, 0.0], ..testing::truth(&sensed) };
    samples.airframes[0] = Some(AirframeSample::new(&sensed, &truth));
    samples.accounts[0] = Some(Account { estimate_m: [0.0, 2.0], ..testing::account(0, 1) });
    samples.airframes[1] = Some(sample(&testing::sensed(0, 2, [1.0, 0.0])));
    samples.accounts[1] = Some(Account { estimate_m: [1.0, 0.0], ..testing::account(0, 2) });
    let mut frame = Frame::new(&scenario);
    frame.refill(&samples, 100);
    let state = frame.uavs[0].state.unwrap();
    assert_eq!((state.x_m, state.y_m), (0.0, 0.0));
    assert_eq!(state.measured.unwrap().position_m, [3.0, 4.0]);
    assert_eq!(frame.uavs[0].estimate_error_m(), Some(2.0));
    // UAV 2 senses the truth and believes it, so nothing is there to be logged.
    assert_eq!(
        (frame.uavs[1].state.unwrap().measured, frame.uavs[1].control.unwrap().estimate),
        (None, None)
    );
    assert_eq!((frame.uavs[1].estimate_error_m(), frame.uavs[2].estimate_error_m()), (Some(0.0), None));
}
