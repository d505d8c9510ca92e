use super::*;
use nalgebra::Point2;
use ringwing_flight::{FlightMode, SensedObstacle, UavId, draw::Draws, payload::MAX_SENSED_OBSTACLES};
use ringwing_scenario::SensorsSection;

const TURN_RATE_RAD_S: f64 = 0.2;
const WIND_M_S: [f64; 2] = [4.0, -2.0];

/// The sensors of a small autopilot, without biases.
fn scenario() -> Scenario {
    let mut scenario = Scenario::default();
    scenario.control.pose_estimated = true;
    let sensors = &mut scenario.sensors;
    (sensors.position_rate_hz, sensors.position_noise_m) = (10.0, 0.5);
    (sensors.heading_rate_hz, sensors.heading_noise_deg) = (50.0, 1.5);
    (sensors.airspeed_noise_m_s, sensors.turn_rate_noise_rad_s) = (0.5, 0.01);
    scenario
}

fn senses(tick: i64, pose: &Pose, position_age_ticks: u32) -> Sensed {
    Sensed {
        tick: Tick(tick),
        position_m: pose.position.into(),
        heading_rad: pose.heading_rad,
        speed_m_s: 15.0,
        turn_rate_rad_s: TURN_RATE_RAD_S,
        uav: UavId(1),
        mode: FlightMode::COMMANDED,
        obstacle_count: 0,
        obstacles_omitted: 0,
        obstacles: [SensedObstacle::default(); MAX_SENSED_OBSTACLES],
        position_age_ticks,
        heading_age_ticks: 0,
    }
}

/// Where a UAV is that circles in the wind, in each tick.
fn flight() -> impl Iterator<Item = (i64, Pose)> {
    let start = Pose { position: Point2::new(5.0, -3.0), heading_rad: 3.0 };
    let step = |pose: &Pose| Some(pose.after(15.0, TURN_RATE_RAD_S, 0.01).carried(WIND_M_S.into(), 0.01));
    (0..).zip(std::iter::successors(Some(start), step))
}

fn error_m(estimate: &OwnEstimate, tick: i64, truth: &Pose) -> f64 {
    (estimate.pose(&senses(tick, truth, 0)).position - truth.position).norm()
}

#[test]
fn with_perfect_sensors_or_switched_off_it_does_nothing() {
    let perfect = Scenario { sensors: SensorsSection::default(), ..scenario() };
    let mut off = scenario();
    off.control.pose_estimated = false;
    for scenario in [perfect, off] {
        let mut estimate = OwnEstimate::new(&scenario);
        let (tick, pose) = flight().nth(3).unwrap();
        let sensed = senses(tick, &pose, 0);
        estimate.observe(&sensed);
        assert_eq!((estimate.wind_m_s(), estimate.pose(&sensed)), (None, pose));
    }
}

#[test]
fn readings_without_noise_give_place_heading_and_wind_also_between_fixes_and_through_a_dropout() {
    let mut estimate = OwnEstimate::new(&scenario());
    let mut fix = (0, flight().next().unwrap().1);
    for (tick, truth) in flight().take(3000) {
        // From 20 s on no fix comes any more.
        if tick % 10 == 0 && tick < 2000 {
            fix = (tick, truth);
        }
        let held = Pose { position: fix.1.position, heading_rad: truth.heading_rad };
        estimate.observe(&senses(tick, &held, (tick - fix.0) as u32));
        if tick > 1000 {
            assert!(error_m(&estimate, tick, &truth) < 0.1, "{tick}: {}", error_m(&estimate, tick, &truth));
        }
    }
    let wind = estimate.wind_m_s().unwrap();
    assert!((wind - Vector2::from(WIND_M_S)).norm() < 0.02, "{wind}");
}

#[test]
fn noise_leaves_less_than_half_of_itself() {
    let mut estimate = OwnEstimate::new(&scenario());
    let mut draws = Draws::new(7, [0; 3], 0);
    let (mut squares_m2, mut squares_rad2, mut fix) = (0.0, 0.0, (0, Point2::origin()));
    for (tick, truth) in flight().take(20_000) {
        if tick % 10 == 0 {
            fix = (tick, truth.position + Vector2::new(draws.normal(), draws.normal()) * 0.5);
        }
        let heading_rad = wrap(truth.heading_rad + 1.5_f64.to_radians() * draws.normal());
        let read = senses(tick, &Pose { position: fix.1, heading_rad }, (tick - fix.0) as u32);
        let (speed_m_s, turn_rate_rad_s) = (15.0 + 0.5 * draws.normal(), 0.2 + 0.01 * draws.normal());
        estimate.observe(&Sensed { speed_m_s, turn_rate_rad_s, ..read });
        if tick >= 2000 {
            squares_m2 += error_m(&estimate, tick, &truth).powi(2);
            squares_rad2 += wrap(estimate.pose(&read).heading_rad - truth.heading_rad).powi(2);
        }
    }
    let (place_m, heading_rad) = ((squares_m2 / 18_000.0).sqrt(), (squares_rad2 / 18_000.0).sqrt());
    // Two coordinates of 0.5 m are 0.7 m apart from the truth, and the UAV moves on by 0.8 m RMS until the next fix.
    assert!((0.2..0.5).contains(&place_m), "{place_m}");
    assert!(heading_rad < 0.4_f64.to_radians(), "{heading_rad}");
}

#[test]
fn the_bias_of_a_gyroscope_is_found() {
    let mut estimate = OwnEstimate::new(&scenario());
    for (tick, truth) in flight().take(6000) {
        let read = senses(tick, &truth, 0);
        estimate.observe(&Sensed { turn_rate_rad_s: TURN_RATE_RAD_S + 0.005, ..read });
    }
    let (tick, truth) = flight().nth(5999).unwrap();
    let heading_rad = estimate.pose(&senses(tick, &truth, 0)).heading_rad;
    assert!(wrap(heading_rad - truth.heading_rad).abs() < 1e-3);
    assert!((estimate.filter.unwrap().heading.offset + 0.005).abs() < 5e-4);
}

#[test]
fn a_fix_that_arrives_late_is_compared_with_where_the_uav_was() {
    let mut estimate = OwnEstimate::new(&scenario());
    // Senses come in every third tick, and their fix is from one or two ticks before.
    let all: Vec<(i64, Pose)> = flight().take(3000).collect();
    for (tick, truth) in all.iter().skip(3).step_by(3) {
        let age = 1 + (tick % 2) as usize;
        let held = Pose { position: all[*tick as usize - age].1.position, ..*truth };
        estimate.observe(&senses(*tick, &held, age as u32));
    }
    let (tick, truth) = all[2997];
    assert!(error_m(&estimate, tick, &truth) < 0.02, "{}", error_m(&estimate, tick, &truth));
}

#[test]
fn after_a_long_gap_the_filter_begins_anew() {
    let mut estimate = OwnEstimate::new(&scenario());
    for (tick, truth) in flight().take(200) {
        estimate.observe(&senses(tick, &truth, 0));
    }
    let (tick, truth) = flight().nth(400).unwrap();
    estimate.observe(&senses(tick, &truth, 0));
    assert_eq!(error_m(&estimate, tick, &truth), 0.0);
    assert_eq!(estimate.wind_m_s(), Some(Vector2::zeros()));
}
