//! Single ticks of a pilot, with what the equations give by hand.

use super::*;
use crate::controller::{Controller, Guest, Wish};
use crate::law::Bond;
use crate::reception::sample::test_state;
use ringwing_flight::{FlightMode, SensedAircraft, payload::MAX_SENSED_OBSTACLES, turned};

/// UAV 1 of six flies by the paper's law with G = 2, k = 100 m and 0.01 rad/s for a metre across, without prediction. Its
/// slot is 40 m behind the leader.
fn scenario() -> Scenario {
    let mut scenario = Scenario::default();
    let control = &mut scenario.control;
    (control.formation_gain, control.slot_gain, control.obstacle_gain_m) = (2.0, 1.0, 100.0);
    (control.heading_gain_rad_per_m, control.dead_reckoning) = (0.01, DeadReckoning::Off);
    (control.gain_fades, control.trust_fades, control.force_limited) = (false, false, false);
    (control.turn_feed_forward, control.ring_closes, control.collision_filter) = (false, false, false);
    scenario.membership.loss_timeout_s = 1.0;
    scenario
}

fn pilot(scenario: &Scenario) -> Pilot {
    Pilot::new(scenario, UavId(1))
}

/// What a UAV that flies east at 15 m/s senses.
fn senses(tick: i64, position_m: [f64; 2], obstacles: &[SensedObstacle]) -> Sensed {
    let mut senses = Sensed {
        tick: Tick(tick),
        position_m,
        heading_rad: 0.0,
        speed_m_s: 15.0,
        turn_rate_rad_s: 0.0,
        uav: UavId(1),
        mode: FlightMode::COMMANDED,
        obstacle_count: obstacles.len() as u32,
        obstacles_omitted: 0,
        obstacles: [SensedObstacle::default(); MAX_SENSED_OBSTACLES],
        position_age_ticks: 0,
        heading_age_ticks: 0,
    };
    senses.obstacles[..obstacles.len()].copy_from_slice(obstacles);
    senses
}

fn mast(position_m: [f64; 2], braking_distance_m: f64) -> SensedObstacle {
    SensedObstacle { position_m, radius_m: 20.0, braking_distance_m, velocity_m_s: [0.0; 2] }
}

fn state(uav: u32, tick: i64, position_m: [f64; 2]) -> UavState {
    UavState { position_m, uav: UavId(uav), ..test_state(tick) }
}

/// The leader at the origin, on its way to the east.
fn leader(tick: i64) -> LeaderState {
    let tick = Tick(tick);
    LeaderState { tick, position_m: [0.0; 2], heading_rad: 0.0, speed_m_s: 15.0, turn_rate_rad_s: 0.0 }
}

fn assert_near(found: [f64; 2], expected: [f64; 2]) {
    let apart = Vector2::from(found) - Vector2::from(expected);
    assert!(apart.norm() < 1e-9, "{found:?} instead of {expected:?}");
}

#[test]
fn an_account_has_every_term_of_the_law() {
    let mut pilot = pilot(&scenario());
    pilot.receive_leader(&leader(0));
    pilot.receive_state(&state(6, 0, [-52.0, -30.0]), Tick(0));
    pilot.receive_state(&state(2, 0, [-52.0, 50.0]), Tick(0));
    pilot.receive_sensed(&senses(0, [-52.0, 0.0], &[mast([-52.0, -45.0], 50.0)]));
    let Decision { account, command, .. } = pilot.fly(Tick(0)).unwrap();
    assert_near(account.slot_m, [-40.0, 0.0]);
    // Ten metres too near to UAV 6, ten too far from UAV 2, twelve too far from the centre and behind the slot.
    assert_near(account.previous_force_m, [0.0, -20.0]);
    assert_near(account.next_force_m, [0.0, -20.0]);
    assert_near(account.centre_force_m, [-24.0, 0.0]);
    assert_near(account.slot_force_m, [-12.0, 0.0]);
    // 100 (50 - 45) / (45 - 20).
    assert_near(account.repulsion_m, [0.0, 20.0]);
    assert!((account.potential_m2 - (100.0 + 100.0 + 144.0 + 72.0)).abs() < 1e-9);
    // 51 m/s, and 0.6 rad/s for 60 m to the left: both are cut.
    assert_eq!((command.speed_m_s, command.turn_rate_rad_s), (25.0, 0.5));
    assert_eq!((account.speed_saturated, account.turn_rate_saturated), (1, 1));
    assert_eq!([account.previous_age.ticks(), account.next_age.ticks()], [Some(0), Some(0)]);
}

#[test]
fn a_command_adds_the_slots_motion_the_pull_of_the_formation_and_the_push_of_an_obstacle() {
    let mut pilot = pilot(&scenario());
    pilot.receive_leader(&leader(0));
    // 100 (46 - 45) / (45 - 20) = 4 m ahead.
    pilot.receive_sensed(&senses(0, [-41.0, 0.0], &[mast([-86.0, 0.0], 46.0)]));
    let Decision { account, command, .. } = pilot.fly(Tick(0)).unwrap();
    assert_near([command.speed_m_s, command.turn_rate_rad_s], [15.0 + 2.0 + 1.0 + 4.0, 0.0]);
    assert_eq!((account.speed_saturated, account.turn_rate_saturated), (0, 0));
    assert_eq!([account.previous_age.ticks(), account.next_age.ticks()], [None, None]);
}

#[test]
fn with_feed_forward_a_uav_in_its_slot_turns_with_the_leader() {
    let turn_rate = |feeds_forward| {
        let mut scenario = scenario();
        scenario.control.turn_feed_forward = feeds_forward;
        let mut pilot = pilot(&scenario);
        pilot.receive_leader(&LeaderState { turn_rate_rad_s: 0.1, ..leader(0) });
        pilot.receive_sensed(&senses(0, [-40.0, 0.0], &[]));
        pilot.fly(Tick(0)).unwrap().command.turn_rate_rad_s
    };
    assert!((turn_rate(true) - 0.1).abs() < 1e-12 && turn_rate(false).abs() < 1e-12);
}

#[test]
fn a_neighbour_whose_data_are_old_pulls_less() {
    let mut scenario = scenario();
    (scenario.control.trust_fades, scenario.control.trust_time_s) = (true, 2.0);
    let mut pilot = pilot(&scenario);
    pilot.receive_state(&state(6, 0, [-40.0, -30.0]), Tick(1));
    pilot.receive_leader(&leader(201));
    pilot.receive_sensed(&senses(201, [-40.0, 0.0], &[]));
    let account = pilot.fly(Tick(201)).unwrap().account;
    assert_eq!(account.previous_age.ticks(), Some(201));
    // A message takes one tick, so this one is two seconds late.
    assert_near(account.previous_force_m, [0.0, -20.0 * (-1.0_f64).exp()]);
}

#[test]
fn a_leader_is_silent_after_more_than_the_loss_timeout() {
    let mut pilot = pilot(&scenario());
    pilot.receive_leader(&leader(0));
    let is_silent = [50, 100, 101].map(|now| {
        pilot.receive_sensed(&senses(now, [-40.0, 0.0], &[]));
        pilot.fly(Tick(now)).unwrap().account.leader_silent
    });
    assert_eq!(is_silent, [0, 0, 1]);
}

/// A controller that notes what it is told.
#[derive(Debug, Default)]
struct Noting {
    times_s: [f64; 2],
    slot_m: Option<Point2<f64>>,
    slot_velocity_m_s: Option<Vector2<f64>>,
    obstacles: Vec<SensedObstacle>,
    aircraft: usize,
    lost: Vec<UavId>,
}

impl Controller for Noting {
    fn step(&mut self, situation: &Situation<'_>) -> Wish {
        *self = Self {
            times_s: [situation.time_s(), situation.age_s(situation.sensed.tick)],
            slot_m: situation.slot_m(),
            slot_velocity_m_s: situation.slot_motion().map(|motion| motion.velocity_m_s),
            obstacles: situation.obstacles().to_vec(),
            aircraft: situation.aircraft().len(),
            lost: situation.membership.lost.to_vec(),
        };
        Wish::new(15.0, 0.0)
    }
}

#[test]
fn a_controller_is_told_the_time_the_slot_and_what_is_sensed() {
    let mut scenario = scenario();
    scenario.control.collision_filter = true;
    let mut pilot = Pilot::steered_by(Guest::new(Noting::default()), &scenario, UavId(1));
    pilot.receive_leader(&LeaderState { position_m: [3.0, 4.0], ..leader(250) });
    let mast = mast([100.0, 0.0], 50.0);
    pilot.receive_sensed(&senses(248, [-40.0, 0.0], &[mast]));
    let mut traffic = Traffic {
        tick: Tick(250),
        uav: UavId(1),
        aircraft_count: 2,
        aircraft_omitted: 0,
        reserved: 0,
        aircraft: Default::default(),
    };
    traffic.aircraft_mut().fill(SensedAircraft { position_m: [500.0, 500.0], ..SensedAircraft::default() });
    pilot.receive_traffic(&traffic);
    pilot.fly(Tick(250)).unwrap();
    let noted = &pilot.steering.controller;
    assert_near(noted.times_s, [2.5, 0.02]);
    assert_near(noted.slot_m.unwrap().into(), [-37.0, 4.0]);
    assert_near(noted.slot_velocity_m_s.unwrap().into(), [15.0, 0.0]);
    assert_eq!((noted.obstacles.as_slice(), noted.aircraft), (&[mast][..], 2));
}

#[test]
fn after_a_loss_a_pilot_knows_who_is_lost_and_moves_the_slots() {
    let mut scenario = scenario();
    scenario.control.ring_closes = true;
    scenario.membership.loss_timeout_s = 0.1;
    let mut pilot = Pilot::steered_by(Guest::new(Noting::default()), &scenario, UavId(1));
    let mut accounts = Vec::new();
    for now in 0..=10 {
        pilot.receive_sensed(&senses(now, [-40.0, 0.0], &[]));
        pilot.receive_state(&state(6, now, [-20.0, -34.6]), Tick(now));
        if now == 0 {
            pilot.receive_state(&state(2, now, [-20.0, 34.6]), Tick(now));
        }
        accounts.push(pilot.fly(Tick(now)).unwrap().account);
    }
    let known = |now: usize| {
        let account = &accounts[now];
        (account.living, account.slots_moving, account.lost_fingerprint != 0)
    };
    assert_eq!((known(9), known(10)), ((6, 0, false), (5, 1, true)), "lost after ten silent ticks");
    assert_eq!(pilot.steering.controller.lost, [UavId(2)]);
}

#[test]
fn an_obstacle_repels_from_where_it_will_be_in_the_air_of_the_uav() {
    let obstacle = SensedObstacle { velocity_m_s: [1.0, 0.5], ..mast([10.0, 0.0], 50.0) };
    let own = Point2::new(-25.0, 4.0);
    let moved = RepulsiveObstacle {
        centre: Point2::new(10.0 + 2.0 * (1.0 - 0.25), 2.0 * (0.5 + 0.5)),
        radius_m: 20.0,
        braking_distance_m: 50.0,
    };
    let force = repulsion_of(&[obstacle, obstacle], 100.0, &own, 2.0, Vector2::new(0.25, -0.5));
    assert!(force.norm() > 1.0 && (force - 2.0 * repulsion(100.0, &moved, &own)).norm() < 1e-9);
}

#[test]
fn senses_of_a_tick_that_is_known_are_no_news_and_late_ones_drift_with_the_wind() {
    let mut own = OwnFlight::default();
    assert!(own.receive(&senses(3, [0.0; 2], &[])) && !own.receive(&senses(3, [0.0; 2], &[])));
    let taken = senses(3, [0.0; 2], &[]);
    let wind_m_s = Vector2::new(0.0, 5.0);
    let then = Pose { position: Point2::origin(), heading_rad: 0.0 };
    let pose = own.pose_at(then, &taken, Tick(5), DeadReckoning::Full, 0.01, wind_m_s);
    assert_near(pose.position.into(), [2.0 * 0.15, 2.0 * 0.05]);
}

#[test]
fn a_slot_that_drifts_with_the_air_has_no_direction_to_turn() {
    let velocity_m_s = Vector2::new(9.0, 12.0);
    let still = SlotMotion { velocity_m_s, turn_rate_rad_s: 0.1 }.in_wind(velocity_m_s);
    assert_eq!(still, SlotMotion { velocity_m_s: Vector2::zeros(), turn_rate_rad_s: 0.0 });
}

#[test]
fn a_controllers_forecast_is_the_arc_that_it_holds() {
    let control = ControlInput { speed_m_s: 15.0, turn_rate_rad_s: 0.2 };
    let arc = Forecast::Arc { heading_rad: 0.3, control, formation_rad_s: -0.05 };
    let own = Pose { position: Point2::new(7.0, -3.0), heading_rad: 0.3 };
    assert!((arc.force(&own, 2.0, &[]) - direction(0.7) * 15.0).norm() < 1e-12);
    assert_eq!(arc.swarm_rad_s(), -0.05);
}

#[test]
fn a_uav_far_from_its_slot_forgets_its_neighbours_as_a_gaussian_does() {
    let mut scenario = scenario();
    (scenario.control.gain_fades, scenario.control.gain_reach_spacings) = (true, 0.25);
    let gains = gains::Gains::new(&scenario);
    // The reach is 10 m.
    for (error_m, share) in [(0.0_f64, 1.0), (10.0, (-1.0_f64).exp()), (20.0, (-4.0_f64).exp())] {
        let gain = gains.formation(&Vector2::new(0.0, error_m));
        assert!((gain - 2.0 * share).abs() < 1e-12, "{error_m} m: {gain}");
    }
}

/// A formation of three in the leader's frame, what UAV 1's forecast asks of a UAV that is
/// `off_m` from its slot after `after_s`, and the velocity of that slot.
fn forecast(
    scenario: &Scenario,
    off_m: Vector2<f64>,
    after_s: f64,
    obstacles: &[SensedObstacle],
) -> (Vector2<f64>, Vector2<f64>) {
    let turn_rate_rad_s = 0.1;
    let gains = gains::Gains::new(scenario);
    let frame = FormationFrame::Leader;
    let here = Pose { position: Point2::origin(), heading_rad: 0.0 };
    let of = |pose, speed_m_s| PeerTrack { tick: Tick(0), pose, speed_m_s, turn_rate_rad_s };
    let leader = EstimatedLeader { track: of(here, 15.0), pose: here, frame_rad: 0.0 };
    let offsets = [Vector2::new(-40.0, 0.0), Vector2::new(20.0, -30.0), Vector2::new(20.0, 30.0)];
    let tracks = offsets.map(|offset| {
        let velocity_m_s = SlotMotion::turning(&leader, frame, offset).velocity_m_s;
        let heading_rad = velocity_m_s.y.atan2(velocity_m_s.x);
        of(Pose { position: Point2::origin() + offset, heading_rad }, velocity_m_s.norm())
    });
    let bond = |track: &PeerTrack| {
        let rest_m = (track.pose.position - tracks[0].pose.position).norm();
        Bond { point: track.pose.position, rest_m, gain: 1.0 }
    };
    let bonds = [Some(bond(&tracks[1])), Some(bond(&tracks[2]))];
    let centre = Bond { point: Point2::origin(), rest_m: 40.0, gain: 2.0 };
    let slot = tracks[0].pose.position;
    let field = crate::law::Field { previous: bonds[0], next: bonds[1], centre, slot, slot_gain: 1.0 };
    let motion = SlotMotion::turning(&leader, frame, offsets[0]);
    let others = [Some(&tracks[1]), Some(&tracks[2])];
    let forecast = forecast::LawForecast::new(&gains, &field, bonds, others, &leader, frame, motion);
    assert!((forecast.turn_rate_rad_s() - turn_rate_rad_s).abs() < 1e-12);
    let turn_rad = turn_rate_rad_s * after_s;
    let position = leader.track.after(after_s).position + turned(offsets[0], turn_rad) + off_m;
    let own = Pose { position, heading_rad: turn_rad };
    (forecast.force(&own, after_s, obstacles), turned(motion.velocity_m_s, turn_rad))
}

#[test]
fn a_formation_that_turns_as_one_stays_so_in_the_forecast() {
    for after_s in [0.0, 1.0, 3.0] {
        let (force, velocity_m_s) = forecast(&scenario(), Vector2::zeros(), after_s, &[]);
        assert!((force - velocity_m_s).norm() < 1e-9, "after {after_s} s: {force}");
    }
}

#[test]
fn the_forecast_of_a_uav_off_its_slot_pulls_it_back_and_away_from_an_obstacle() {
    // 1 m outward: 2 m from the centre's term and 1 m from the slot's; the neighbours' terms add to the pull.
    let (force, velocity_m_s) = forecast(&scenario(), Vector2::new(-1.0, 0.0), 0.0, &[]);
    assert!((force - velocity_m_s).x > 3.0);
    // Another obstacle of the same kind adds its push: 100 (46 - 45) / (45 - 20) to the right.
    let (pushed, _) = forecast(&scenario(), Vector2::new(-1.0, 0.0), 0.0, &[mast([-86.0, 0.0], 46.0)]);
    assert!((pushed - force - Vector2::new(4.0, 0.0)).norm() < 1e-9, "{pushed}");
}

#[test]
fn in_the_forecast_all_but_the_slots_own_term_fade_with_the_distance_from_the_slot() {
    let mut fading = scenario();
    (fading.control.gain_fades, fading.control.gain_reach_spacings) = (true, 0.25);
    let off_m = Vector2::new(-10.0, 0.0);
    let (whole, velocity_m_s) = forecast(&scenario(), off_m, 0.0, &[]);
    let (faded, _) = forecast(&fading, off_m, 0.0, &[]);
    // The distance is the reach of 10 m. The slot's term pulls by just that distance.
    let slot = -off_m;
    let others = whole - velocity_m_s - slot;
    assert!((faded - velocity_m_s - slot - others * (-1.0_f64).exp()).norm() < 1e-9, "{faded}");
}
