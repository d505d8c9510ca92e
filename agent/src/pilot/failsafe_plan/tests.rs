use super::*;
use proptest::prelude::*;
use ringwing_flight::Tick;

/// A leader at the origin that flies at 15 m/s.
fn leader(heading_rad: f64, turn_rate_rad_s: f64) -> PeerTrack {
    let pose = Pose { position: Point2::origin(), heading_rad };
    PeerTrack { tick: Tick(0), pose, speed_m_s: 15.0, turn_rate_rad_s }
}

fn scenario(uavs: u32) -> Scenario {
    let mut scenario = Scenario::default();
    scenario.formation.uavs = uavs;
    scenario.control.ring_closes = true;
    scenario
}

/// One tick of a plan: `leader` flies in this wind.
fn go_on(
    plan: &mut FailsafePlan,
    slots: &Slots,
    leader: &PeerTrack,
    wind_m_s: Vector2<f64>,
    obstacles: &[SensedObstacle],
) {
    plan.sight = Some(Sight { leader: *leader, wind_m_s });
    plan.go_on(slots, obstacles);
}

/// Lets `plan` go on in still air until it is made.
fn finish(plan: &mut FailsafePlan, slots: &Slots, leader: &PeerTrack) -> FailsafePath {
    finish_in(Vector2::zeros(), plan, slots, leader)
}

fn finish_in(
    wind_m_s: Vector2<f64>,
    plan: &mut FailsafePlan,
    slots: &Slots,
    leader: &PeerTrack,
) -> FailsafePath {
    go_on(plan, slots, leader, wind_m_s, &[]);
    while plan.search.is_some() {
        go_on(plan, slots, leader, wind_m_s, &[]);
    }
    plan.planned
}

const NO_OBSTACLES: Obstacles<'_> = Obstacles { sensed: &[], leader: Point2::new(0.0, 0.0) };

/// The path of UAV `own` of `scenario`, and how near it comes to anybody.
fn planned(scenario: &Scenario, own: u32, leader: &PeerTrack) -> (FailsafePath, f64) {
    planned_in(Vector2::zeros(), scenario, own, leader)
}

fn planned_in(
    wind_m_s: Vector2<f64>,
    scenario: &Scenario,
    own: u32,
    leader: &PeerTrack,
) -> (FailsafePath, f64) {
    let (slots, mut plan) = (Slots::new(scenario, UavId(own)), FailsafePlan::new(scenario, UavId(own)));
    let path = finish_in(wind_m_s, &mut plan, &slots, leader);
    let loiter = plan.loiter.expect("it chooses");
    let outlook = loiter.outlook(UavId(own), slots.ring(), &Sight { leader: *leader, wind_m_s });
    let at = |step| loiter.clearance_m(path, &outlook, f64::from(step) * STEP_S, &NO_OBSTACLES);
    (path, (0..=STEPS).map(at).fold(f64::INFINITY, f64::min))
}

#[test]
fn uavs_at_the_sides_circle_outwards_at_once_and_one_in_front_leaves_first() {
    let path = |own| planned(&scenario(6), own, &leader(0.0, 0.0)).0;
    // UAV 1 flies behind the leader, UAV 2 behind and to the left, UAV 6 behind and to the right.
    let circles = [FailsafePath::CIRCLE_LEFT, FailsafePath::CIRCLE_RIGHT];
    assert_eq!([1, 2, 6].map(path), [circles[0], circles[0], circles[1]]);
    // The others would overtake those in front.
    for own in 3..=5 {
        assert!(!circles.contains(&path(own)), "{own}");
    }
}

#[test]
fn every_uav_of_every_ring_has_a_clear_way_out() {
    for (uavs, own) in (3..=16).flat_map(|uavs| (1..=uavs).map(move |own| (uavs, own))) {
        let clear_m = planned(&scenario(uavs), own, &leader(0.0, 0.0)).1;
        assert!(clear_m > 20.0, "{own} of {uavs}: {clear_m} m");
    }
}

#[test]
fn an_obstacle_on_the_path_changes_it_before_the_uav_is_there() {
    let scenario = scenario(6);
    let (slots, mut plan) = (Slots::new(&scenario, UavId(2)), FailsafePlan::new(&scenario, UavId(2)));
    let before = finish(&mut plan, &slots, &leader(0.0, 0.0));
    assert_eq!(before, FailsafePath::CIRCLE_LEFT);
    // UAV 2 would circle round it, too near to its edge.
    let mast = |x_m: f64| SensedObstacle {
        position_m: [x_m, 110.0],
        radius_m: 20.0,
        braking_distance_m: 40.0,
        velocity_m_s: [0.0; 2],
    };
    let path = |plan: &mut FailsafePlan, x_m: f64| {
        // While an obstacle is sensed, a search never ends for good.
        for _ in 0..1000 {
            go_on(plan, &slots, &leader(0.0, 0.0), Vector2::zeros(), &[mast(x_m)]);
        }
        plan.planned
    };
    assert_eq!(path(&mut plan, 500.0), before);
    let after = path(&mut plan, -20.0);
    assert_ne!(after, before);
    let loiter = plan.loiter.expect("it chooses");
    let outlook = loiter.outlook(
        UavId(2),
        slots.ring(),
        &Sight { leader: leader(0.0, 0.0), wind_m_s: Vector2::zeros() },
    );
    let obstacles = Obstacles { sensed: &[mast(-20.0)], leader: Point2::origin() };
    let clear_m = |path| {
        let at = |step| loiter.clearance_m(path, &outlook, f64::from(step) * STEP_S, &obstacles);
        (0..=STEPS).map(at).fold(f64::INFINITY, f64::min)
    };
    assert!(clear_m(before) < 10.0 && clear_m(after) > 20.0, "{} m", clear_m(after));
}

#[test]
fn the_sides_are_those_of_the_leaders_heading() {
    let turned_round = leader(std::f64::consts::PI, 0.0);
    // UAV 3, in front and to the left of a leader that heads along x, is now behind and to its right.
    assert_eq!(planned(&scenario(6), 3, &turned_round).0, FailsafePath::CIRCLE_RIGHT);
}

#[test]
fn only_a_uav_near_its_slot_leaves_as_planned_and_others_circle_away_from_the_leader() {
    let scenario = scenario(6);
    let (slots, mut plan) = (Slots::new(&scenario, UavId(4)), FailsafePlan::new(&scenario, UavId(4)));
    let planned = finish(&mut plan, &slots, &leader(0.0, 0.0));
    let loiter = plan.loiter.expect("it chooses");
    let path = |x_m: f64, y_m: f64| {
        let own = Pose { position: Point2::new(x_m, y_m), heading_rad: 0.0 };
        plan.way_out(&loiter, &own, Point2::new(40.0, 0.0), &leader(0.0, 0.0).pose)
    };
    // Its slot is 40 m in front of the leader.
    assert_eq!([path(40.0, 0.0), path(30.0, -20.0)], [planned; 2]);
    assert_eq!(path(20.0, 20.0), FailsafePath::CIRCLE_LEFT);
    assert_eq!(path(20.0, -20.0), FailsafePath::CIRCLE_RIGHT);
}

#[test]
fn an_airframe_circles_as_it_is_built_if_nobody_closes_the_ring_or_it_does_not_loiter() {
    let path = |settings: &dyn Fn(&mut Scenario)| {
        let mut scenario = scenario(6);
        settings(&mut scenario);
        let mut plan = FailsafePlan::new(&scenario, UavId(6));
        finish(&mut plan, &Slots::new(&scenario, UavId(6)), &leader(0.0, 0.0))
    };
    assert_eq!(path(&|_| ()), FailsafePath::CIRCLE_RIGHT);
    assert_eq!(path(&|scenario| scenario.control.ring_closes = false), FailsafePath::CIRCLE_LEFT);
    assert_eq!(path(&|scenario| scenario.airframe.failsafe = Failsafe::Hold), FailsafePath::CIRCLE_LEFT);
}

#[test]
fn a_plan_is_made_anew_when_the_slots_change_or_the_leader_turns() {
    let scenario = scenario(6);
    let (mut slots, mut plan) = (Slots::new(&scenario, UavId(6)), FailsafePlan::new(&scenario, UavId(6)));
    assert_eq!(finish(&mut plan, &slots, &leader(0.0, 0.0)), FailsafePath::CIRCLE_RIGHT);
    // In front of a leader that has turned round, it leaves first.
    assert_ne!(finish(&mut plan, &slots, &leader(3.1, 0.0)), FailsafePath::CIRCLE_RIGHT);
    let path = finish(&mut plan, &slots, &leader(0.0, 0.0));
    // In a gust the plan stays, and in another wind it is made anew.
    for (wind_m_s, is_planned) in [(1.5, false), (8.0, true)] {
        go_on(&mut plan, &slots, &leader(0.0, 0.0), Vector2::new(wind_m_s, 0.0), &[]);
        assert_eq!(plan.search.is_some(), is_planned);
    }
    // Alone, it has nobody to keep clear of, so any path is good enough.
    slots.reform(Tick(0), |uav| uav == UavId(6));
    assert_eq!(finish(&mut plan, &slots, &leader(0.0, 0.0)), path);
}

#[test]
fn a_plan_takes_many_ticks_and_ends_even_while_the_leader_keeps_turning() {
    let scenario = scenario(6);
    let (slots, mut plan) = (Slots::new(&scenario, UavId(4)), FailsafePlan::new(&scenario, UavId(4)));
    go_on(&mut plan, &slots, &leader(0.0, 0.0), Vector2::zeros(), &[]);
    let mut ticks = 1;
    while plan.search.is_some() {
        go_on(&mut plan, &slots, &leader(0.2 * f64::from(ticks), 0.0), Vector2::zeros(), &[]);
        ticks += 1;
    }
    assert!((5..400).contains(&ticks), "{ticks}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn a_formation_that_turns_with_its_leader_plans_the_same_whatever_the_heading(
        heading_rad in -3.0..3.0, turn_rate_rad_s in -0.03..0.03, own in 1..=6_u32,
    ) {
        let mut scenario = scenario(6);
        scenario.formation.frame = FormationFrame::Leader;
        let path = |heading_rad| planned(&scenario, own, &leader(heading_rad, turn_rate_rad_s)).1;
        prop_assert!((path(heading_rad) - path(0.0)).abs() < 1e-6);
    }

    #[test]
    fn also_in_wind_a_path_is_found_that_keeps_clear(
        from_rad in -3.0..3.0, wind_m_s in 0.0..7.0, own in 1..=6_u32,
    ) {
        let wind = direction(from_rad) * wind_m_s;
        let clear_m = planned_in(wind, &scenario(6), own, &leader(0.0, 0.0)).1;
        prop_assert!(clear_m > 15.0, "{} m", clear_m);
    }

    #[test]
    fn also_in_a_turn_a_path_is_found_that_keeps_clear(turn_rate_rad_s in -0.05..0.05, own in 1..=6_u32) {
        let clear_m = planned(&scenario(6), own, &leader(0.0, turn_rate_rad_s)).1;
        prop_assert!(clear_m > 15.0, "{} m", clear_m);
    }
}
