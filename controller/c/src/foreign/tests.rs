//! What callbacks are told, compared with the situation that it comes from.

use super::*;
use ringwing_controller::{Scenario, Tick, UavId};
use ringwing_flight::{AircraftId, IntruderId, Traffic};
use std::ptr;

const OBSTACLE: SensedObstacle = SensedObstacle {
    position_m: [1.0, 2.0],
    radius_m: 3.0,
    braking_distance_m: 4.0,
    velocity_m_s: [5.0, 6.0],
};

fn sensed(obstacles: u32) -> Sensed {
    Sensed {
        tick: Tick(48),
        position_m: [7.0, 8.0],
        heading_rad: 0.5,
        speed_m_s: 15.5,
        turn_rate_rad_s: 0.25,
        uav: UavId(3),
        mode: FlightMode::COMMANDED,
        obstacle_count: obstacles,
        obstacles_omitted: 9,
        obstacles: [OBSTACLE; _],
        position_age_ticks: 0,
        heading_age_ticks: 0,
    }
}

fn traffic() -> Traffic {
    let aircraft = SensedAircraft {
        position_m: [-1.0, -2.0],
        heading_rad: -0.5,
        speed_m_s: 14.0,
        turn_rate_rad_s: -0.25,
        who: AircraftId::intruder(IntruderId(2)),
        is_answering: 0,
    };
    Traffic {
        tick: Tick(48),
        uav: UavId(3),
        aircraft_count: 1,
        aircraft_omitted: 7,
        reserved: 0,
        aircraft: [aircraft; _],
    }
}

fn track_at(tick: i64, x_m: f64) -> PeerTrack {
    let pose = Pose { position: Point2::new(x_m, 20.0), heading_rad: 0.0 };
    PeerTrack { tick: Tick(tick), pose, speed_m_s: 15.0, turn_rate_rad_s: 0.0 }
}

/// A situation at tick 50 in which only the second neighbour was heard.
fn situation<'a>(
    sensed: &'a Sensed,
    traffic: Option<&'a Traffic>,
    heard: &'a PeerTrack,
    leader: Option<EstimatedLeader>,
) -> Situation<'a> {
    let neighbour = |uav, track| Some(RingNeighbour { uav: UavId(uav), rest_m: 40.0, track });
    Situation {
        tick: Tick(50),
        period_s: 0.01,
        uav: UavId(3),
        limits: Limits::new(10.0, 25.0, 0.7).unwrap(),
        own: Pose { position: Point2::new(7.5, 8.5), heading_rad: 0.75 },
        sensed,
        neighbours: [neighbour(1, None), neighbour(4, Some(heard))],
        leader,
        wind_m_s: Vector2::new(3.0, -4.0),
        leader_is_silent: leader.is_none(),
        slot_offset_m: Vector2::new(-30.0, 10.0),
        radius_m: 40.0,
        frame: FormationFrame::Leader,
        traffic,
        membership: Membership { living: 5, lost: &[UavId(2)], lost_fingerprint: 77, slots_are_moving: true },
    }
}

/// What a callback has seen of a tick, with what pointers pointed to.
#[derive(Debug, Default)]
struct Seen {
    told: Option<RingwingSituation>,
    obstacles: Vec<RingwingObstacle>,
    aircraft: Vec<RingwingAircraft>,
    lost: Vec<u32>,
}

#[expect(unsafe_code, reason = "reads what a program in C reads")]
unsafe extern "C-unwind" fn look(user: *mut c_void, told: *const RingwingSituation) -> RingwingWish {
    // SAFETY: the test passes a `Seen`, and everything else is valid during the call.
    unsafe {
        let told = told.read();
        let seen = &mut *user.cast::<Seen>();
        seen.obstacles = std::slice::from_raw_parts(told.obstacles, told.obstacle_count).to_vec();
        seen.aircraft = std::slice::from_raw_parts(told.aircraft, told.aircraft_count).to_vec();
        seen.lost = std::slice::from_raw_parts(told.membership.lost, told.membership.lost_count).to_vec();
        seen.told = Some(told);
    }
    RingwingWish { speed_m_s: 16.0, turn_rate_rad_s: -0.125 }
}

fn stepped(situation: &Situation<'_>) -> (Wish, Seen) {
    let mut seen = Seen::default();
    let user = (&raw mut seen).cast();
    let mut foreign = Foreign { step: look, user, obstacles: Vec::new(), aircraft: Vec::new() };
    (foreign.step(situation), seen)
}

#[test]
fn a_callback_sees_the_whole_situation_and_its_wish_comes_back() {
    let (sensed, traffic, heard) = (sensed(2), traffic(), track_at(46, 12.0));
    let leader = EstimatedLeader {
        track: track_at(45, 100.0),
        pose: Pose { position: Point2::new(100.75, 20.0), heading_rad: 0.0 },
        frame_rad: 0.125,
    };
    let (wish, seen) = stepped(&situation(&sensed, Some(&traffic), &heard, Some(leader)));
    assert_eq!(wish, Wish::new(16.0, -0.125));
    let told = seen.told.unwrap();
    assert_eq!((told.size_bytes, told.tick, told.time_s, told.uav), (536, 50, 0.5, 3));
    assert_eq!((told.own.position_m.x, told.own.heading_rad), (7.5, 0.75));
    assert_eq!((told.sensed.tick, told.sensed.age_s, told.sensed.speed_m_s), (48, 0.02, 15.5));
    assert_eq!((told.limits.speed_min_m_s, told.limits.turn_rate_max_rad_s), (10.0, 0.7));
    assert_eq!((told.leader.pose.position_m.x, told.leader.frame_rad), (100.75, 0.125));
    assert_eq!((told.leader.is_heard, told.leader.is_silent), (true, false));
    assert_eq!((told.slot.position_m.x, told.slot.position_m.y), (70.75, 30.0));
    assert_eq!((told.slot.velocity_m_s.x, told.slot.offset_m.x, told.slot.radius_m), (15.0, -30.0, 40.0));
    let [unheard, neighbour] = told.neighbours;
    assert_eq!((unheard.uav, unheard.is_heard, unheard.rest_m), (1, false, 40.0));
    assert_eq!((neighbour.uav, neighbour.is_heard, neighbour.track.pose.position_m.x), (4, true, 12.0));
    assert_eq!((told.membership.living, told.membership.lost_fingerprint), (5, 77));
    assert_eq!(seen.lost, [2]);
    assert_eq!((told.obstacles_omitted, told.aircraft_omitted), (9, 7));
    assert!(told.membership.slots_are_moving && told.formation_turns && told.senses_aircraft);
    assert!(told.is_commanded);
    assert_eq!((told.wind_m_s.x, told.wind_m_s.y), (3.0, -4.0));
    let obstacle = seen.obstacles[1];
    assert_eq!((obstacle.velocity_m_s.y, obstacle.radius_m, obstacle.braking_distance_m), (6.0, 3.0, 4.0));
    let [intruder] = seen.aircraft[..] else { panic!("{seen:?}") };
    assert_eq!((intruder.number, intruder.is_intruder, intruder.is_answering), (2, true, false));
}

#[expect(unsafe_code, reason = "notes as a program in C does")]
unsafe extern "C-unwind" fn note_something(_: *mut c_void, _: *const RingwingSituation) -> RingwingWish {
    // SAFETY: each name ends with a zero.
    let taken = [c"slot_error_m", c"slot error", c"gain", c"na\xFFme"]
        .map(|name| unsafe { crate::ringwing_note(name.as_ptr(), 1.5) });
    // SAFETY: NULL stands for no name.
    let nameless = unsafe { crate::ringwing_note(ptr::null(), 1.5) };
    assert_eq!((taken, nameless), ([true, false, true, false], false));
    RingwingWish { speed_m_s: 16.0, turn_rate_rad_s: 0.0 }
}

#[test]
fn what_a_callback_notes_comes_with_its_wish_and_outside_of_step_nothing_is_noted() {
    let (sensed, heard) = (sensed(0), track_at(46, 12.0));
    let situation = situation(&sensed, None, &heard, None);
    let (step, user) = (note_something as Step, ptr::null_mut());
    let mut foreign = Foreign { step, user, obstacles: Vec::new(), aircraft: Vec::new() };
    for _ in 0..2 {
        let notes = foreign.step(&situation).notes;
        assert_eq!(notes.iter().collect::<Vec<_>>(), [("slot_error_m", 1.5), ("gain", 1.5)]);
        assert_eq!(notes.refused().unwrap().0, "slot error");
        assert!(!note("outside", 1.0));
    }
    foreign.step = look;
    let mut seen = Seen::default();
    foreign.user = (&raw mut seen).cast();
    assert!(foreign.step(&situation).notes.is_empty(), "the notes of the tick before are gone");
}

#[test]
fn what_is_not_known_is_zero_and_marked() {
    let (sensed, heard) = (sensed(0), track_at(46, 12.0));
    let mut empty = situation(&sensed, None, &heard, None);
    empty.neighbours[0] = None;
    empty.membership.lost = &[];
    let (_, seen) = stepped(&empty);
    let told = seen.told.unwrap();
    assert_eq!(told.neighbours[0], RingwingNeighbour::default());
    assert_eq!(told.leader, RingwingLeader { is_silent: true, ..RingwingLeader::default() });
    assert_eq!(told.slot.position_m, RingwingVector::default());
    assert_eq!(told.slot.radius_m, 40.0, "the place relative to the leader is known");
    assert!(!told.senses_aircraft && seen.obstacles.is_empty() && seen.aircraft.is_empty());
    assert!(seen.lost.is_empty());
}

#[expect(unsafe_code, reason = "reads what a program in C reads")]
unsafe extern "C-unwind" fn note_start(user: *mut c_void, told: *const RingwingStart) {
    // SAFETY: the test passes a text, and everything else is valid during the call.
    unsafe {
        let told = told.read();
        let scenario = std::ffi::CStr::from_ptr(told.scenario_toml).to_str().unwrap();
        let read = Scenario::resolved(scenario).unwrap();
        let of = (told.uav, told.uavs, told.argument_count, told.seed, told.period_s);
        *user.cast::<String>() = format!("{of:?} {}", read.name);
    }
}

#[test]
fn a_program_may_know_its_uav_and_the_whole_scenario_before_the_flight() {
    let scenario = Scenario { name: "mine".into(), seed: 17, ..Scenario::default() };
    let start = Start { uav: UavId(3), scenario: &scenario, arguments: &["--gain".into(), "2".into()] };
    let mut text = String::new();
    let callbacks = RingwingCallbacks { size_bytes: 24, start: Some(note_start), step: Some(look) };
    Foreign::new(&callbacks, look, (&raw mut text).cast(), &start, ptr::null());
    assert_eq!(text, "(3, 6, 2, 17, 0.01) mine");
}
