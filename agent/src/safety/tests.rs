use super::*;
use proptest::prelude::*;
use ringwing_flight::{AircraftId, SensedAircraft};
use std::f64::consts::{FRAC_PI_2, PI};

/// A tick in which UAV 1 looks for a clear way, at 100 Hz and every 0.1 s.
const LOOK: Tick = Tick(19);
/// The aircraft that is avoided.
const OTHER: AircraftId = AircraftId::uav(UavId(2));
const WISH: ControlInput = ControlInput { speed_m_s: 15.0, turn_rate_rad_s: 0.0 };

fn filter() -> CollisionFilter {
    CollisionFilter::new(&Scenario::default(), UavId(1))
}

fn own() -> Pose {
    Pose { position: Point2::origin(), heading_rad: 0.0 }
}

fn aircraft(position_m: [f64; 2], heading_rad: f64, turn_rate_rad_s: f64) -> SensedAircraft {
    SensedAircraft { position_m, heading_rad, speed_m_s: 15.0, turn_rate_rad_s, who: OTHER, is_answering: 1 }
}

fn report(tick: Tick, sensed: &[SensedAircraft]) -> Traffic {
    let mut report = Traffic {
        tick,
        uav: UavId(1),
        aircraft_count: sensed.len() as u32,
        aircraft_omitted: 0,
        reserved: 0,
        aircraft: Default::default(),
    };
    report.aircraft_mut().copy_from_slice(sensed);
    report
}

/// What UAV 1 flies at `now`, from the origin to the east, under a law that leads straight on.
fn flown(filter: &mut CollisionFilter, now: Tick, obstacles: &[SensedObstacle]) -> Flown {
    flown_in_wind(filter, now, obstacles, Vector2::zeros())
}

fn flown_in_wind(
    filter: &mut CollisionFilter,
    now: Tick,
    obstacles: &[SensedObstacle],
    wind_m_s: Vector2<f64>,
) -> Flown {
    let around = Surroundings { obstacles, swarm_rad_s: 0.0, wind_m_s };
    filter.apply(now, &own(), WISH, |_, _| Vector2::new(15.0, 0.0), &around)
}

fn flown_among(sensed: &[SensedAircraft]) -> Flown {
    let mut filter = filter();
    filter.receive(&report(LOOK, sensed));
    flown(&mut filter, LOOK, &[])
}

#[test]
fn a_clear_way_is_flown_as_wished_to_the_bit() {
    for clear in [aircraft([0.0, 40.0], 0.0, 0.0), aircraft([-50.0, 0.0], PI, 0.0)] {
        let flown = flown_among(&[clear]);
        assert_eq!((flown.control, flown.avoided), (WISH, Avoided::NOTHING));
    }
}

#[test]
fn two_that_meet_head_on_both_turn_right() {
    let flown = flown_among(&[aircraft([90.0, 0.0], PI, 0.0)]);
    assert!(flown.control.turn_rate_rad_s < 0.0, "{flown:?}");
    assert_eq!((flown.avoided, flown.avoided_at), (Avoided::aircraft(OTHER), Point2::new(90.0, 0.0)));
}

#[test]
fn an_obstacle_exactly_on_the_line_of_flight_is_passed_on_one_side() {
    let mast = SensedObstacle {
        position_m: [50.0, 0.0],
        radius_m: 10.0,
        braking_distance_m: 20.0,
        velocity_m_s: [0.0; 2],
    };
    let flown = flown(&mut filter(), LOOK, &[mast]);
    assert!(flown.control.turn_rate_rad_s < 0.0, "{flown:?}");
    assert_eq!(flown.avoided, Avoided::OBSTACLE);
}

#[test]
fn an_aircraft_that_nobody_flies_is_predicted_along_its_arc() {
    let crossing = |turn_rate_rad_s| {
        let mut one = aircraft([40.0, 40.0], -FRAC_PI_2, turn_rate_rad_s);
        one.speed_m_s = 12.0;
        flown_among(&[one]).avoided
    };
    assert_eq!((crossing(0.0), crossing(0.5)), (Avoided::aircraft(OTHER), Avoided::NOTHING));
}

#[test]
fn a_neighbour_that_is_nearer_than_asked_closes_no_course_that_does_not_approach_it() {
    assert_eq!(flown_among(&[aircraft([0.0, 8.0], 0.0, 0.0)]).avoided, Avoided::NOTHING);
}

#[test]
fn a_course_is_held_until_the_next_look() {
    let mut filter = filter();
    filter.receive(&report(LOOK, &[aircraft([90.0, 0.0], PI, 0.0)]));
    let first = flown(&mut filter, LOOK, &[]);
    filter.receive(&report(LOOK.next(), &[]));
    assert_eq!(flown(&mut filter, LOOK.next(), &[]), first);
    assert_eq!(flown(&mut filter, Tick(23), &[]).control, WISH);
}

#[test]
fn old_reports_and_those_for_other_uavs_are_not_used() {
    let near = [aircraft([60.0, 0.0], PI, 0.0)];
    let mut filter = filter();
    filter.receive(&report(Tick(LOOK.0 - 201), &near));
    filter.receive(&Traffic { uav: UavId(3), ..report(LOOK, &near) });
    assert_eq!(flown(&mut filter, LOOK, &[]).avoided, Avoided::NOTHING);
}

#[test]
fn a_late_report_is_predicted_to_now() {
    let mut filter = filter();
    // It was seen 1.5 s ago, and has passed since.
    filter.receive(&report(Tick(LOOK.0 - 150), &[aircraft([10.0, 0.0], PI, 0.0)]));
    assert_eq!(flown(&mut filter, LOOK, &[]).avoided, Avoided::NOTHING);
}

#[test]
fn an_obstacle_is_avoided_where_it_will_be() {
    // It is not in the way now, and reaches the UAV's way when the UAV does.
    let crossing = |velocity_m_s| SensedObstacle {
        position_m: [45.0, -30.0],
        radius_m: 5.0,
        braking_distance_m: 10.0,
        velocity_m_s,
    };
    assert_eq!(flown(&mut filter(), LOOK, &[crossing([0.0; 2])]).avoided, Avoided::NOTHING);
    assert_eq!(flown(&mut filter(), LOOK, &[crossing([0.0, 10.0])]).avoided, Avoided::OBSTACLE);
    // And one that leaves the way in time is no reason to leave it.
    let leaving = SensedObstacle { position_m: [45.0, 0.0], ..crossing([0.0, 15.0]) };
    assert_eq!(flown(&mut filter(), LOOK, &[leaving]).avoided, Avoided::NOTHING);
}

#[test]
fn in_wind_aircraft_are_avoided_where_they_meet_in_the_air_and_obstacles_where_they_drift() {
    // An aircraft of the swarm drifts as this UAV does: the wind changes nothing.
    let meeting = aircraft([52.0, 45.0], -FRAC_PI_2, 0.0);
    let avoided = |sensed: SensedAircraft, obstacles: &[SensedObstacle], wind_m_s: [f64; 2]| {
        let mut filter = filter();
        filter.receive(&report(LOOK, &[sensed]));
        flown_in_wind(&mut filter, LOOK, obstacles, wind_m_s.into()).avoided
    };
    for wind_m_s in [[0.0; 2], [0.0, -10.0]] {
        assert_eq!(avoided(meeting, &[], wind_m_s), Avoided::aircraft(OTHER));
    }
    // An intruder that comes over the ground is not carried along.
    let intruder = AircraftId::intruder(ringwing_flight::IntruderId(1));
    let crossing = SensedAircraft { who: intruder, is_answering: 0, ..meeting };
    assert_eq!(avoided(crossing, &[], [0.0; 2]), Avoided::aircraft(intruder));
    assert_eq!(avoided(crossing, &[], [0.0, -15.0]), Avoided::NOTHING);
    // Nor is a mast beside the way: the UAV drifts into it.
    let far = aircraft([-90.0, 0.0], PI, 0.0);
    let mast = SensedObstacle {
        position_m: [45.0, -30.0],
        radius_m: 5.0,
        braking_distance_m: 10.0,
        velocity_m_s: [0.0; 2],
    };
    assert_eq!(avoided(far, &[mast], [0.0; 2]), Avoided::NOTHING);
    assert_eq!(avoided(far, &[mast], [0.0, -10.0]), Avoided::OBSTACLE);
}

#[test]
fn an_intruder_that_stays_in_the_way_for_long_is_left_behind_and_a_uav_of_the_swarm_is_not() {
    let speed_m_s = |who: AircraftId, after_ticks: i64| {
        let mut filter = filter();
        let mut flown_m_s = 0.0;
        for tick in (LOOK.0..=LOOK.0 + after_ticks).step_by(20).map(Tick) {
            let ahead = SensedAircraft { who, speed_m_s: 14.0, ..aircraft([12.0, 0.0], 0.0, 0.0) };
            filter.receive(&report(tick, &[ahead]));
            flown_m_s = flown(&mut filter, tick, &[]).control.speed_m_s;
        }
        flown_m_s
    };
    let intruder = AircraftId::intruder(ringwing_flight::IntruderId(1));
    // 25 m/s gets away from 14 m/s sooner than 12 m/s does.
    assert!(speed_m_s(intruder, 1000) < 25.0);
    assert_eq!(speed_m_s(intruder, 1040), 25.0);
    assert!(speed_m_s(OTHER, 1040) < 25.0);
}

proptest! {
    #[test]
    fn the_airframes_limits_hold_whatever_is_near(
        places in prop::collection::vec((-120.0..120.0, -120.0..120.0, -3.0..3.0, -0.5..0.5), 0..8),
        masts in prop::collection::vec((-100.0..100.0, -100.0..100.0, 1.0..30.0), 0..8),
    ) {
        let mut filter = filter();
        let sensed: Vec<_> =
            places.into_iter().map(|(x, y, heading, rate)| aircraft([x, y], heading, rate)).collect();
        let mast = |(x, y, radius_m)| SensedObstacle { position_m: [x, y], radius_m, braking_distance_m: 50.0, velocity_m_s: [0.0; 2] };
        let masts: Vec<_> = masts.into_iter().map(mast).collect();
        filter.receive(&report(LOOK, &sensed));
        let control = flown(&mut filter, LOOK, &masts).control;
        prop_assert!((12.0..=25.0).contains(&control.speed_m_s), "{control:?}");
        prop_assert!((-0.5..=0.5).contains(&control.turn_rate_rad_s), "{control:?}");
    }
}
