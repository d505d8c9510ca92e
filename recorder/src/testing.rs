//! Synthetic flights for the tests of this crate.

use crate::{
    log::Opening,
    metrics::{AirframeSample, Frame, TickSamples},
    process::recording::Recording,
};
use nalgebra::Point2;
use ringwing_flight::{
    Account, AgeTicks, Command, FlightMode, LeaderState, Sensed, SensedObstacle, Tick, Truth, UavId,
};
use ringwing_scenario::{FormationSection, IntruderSection, ObstacleSection, Scenario};
use std::{
    borrow::Cow,
    path::{Path, PathBuf},
};

/// The scenario's text in the logs of these tests.
pub(crate) const TEXT: &str = "name = \"synthetic\"\n";

/// A swarm of `uavs`, `spacing_m` apart, and nothing in its way.
pub(crate) fn ring_of(uavs: u32, spacing_m: f64) -> Scenario {
    let formation = FormationSection { uavs, spacing_m, ..FormationSection::default() };
    Scenario { name: "synthetic".into(), formation, ..Scenario::default() }
}

/// Three UAVs at 4 Hz: every other tick begins with a flush.
pub(crate) fn slow_ring() -> Scenario {
    let mut scenario = ring_of(3, 40.0);
    scenario.time.rate_hz = 4;
    scenario
}

/// An obstacle of 10 m radius that repels from 30 m.
pub(crate) fn obstacle(position_m: [f64; 2]) -> ObstacleSection {
    ObstacleSection::standing("tower", position_m, 10.0, 30.0)
}

/// An intruder on its way north.
pub(crate) fn intruder(position_m: [f64; 2]) -> IntruderSection {
    IntruderSection {
        position_m,
        heading_deg: 90.0,
        speed_m_s: 20.0,
        cooperative: true,
        turn_rate_rad_s: 0.0,
        waypoints_m: Vec::new(),
        repeat: false,
    }
}

/// What begins the log of `scenario`, without wall-clock times.
pub(crate) fn opening(scenario: &Scenario) -> Opening<'_> {
    Opening { scenario, text: TEXT, timing: false, started_at: None }
}

/// A UAV on its way east at 15 m/s.
pub(crate) fn sensed(tick: i64, uav: u32, position_m: [f64; 2]) -> Sensed {
    Sensed {
        tick: Tick(tick),
        position_m,
        heading_rad: 0.0,
        speed_m_s: 15.0,
        turn_rate_rad_s: 0.0,
        uav: UavId(uav),
        mode: FlightMode::COMMANDED,
        obstacle_count: 0,
        obstacles_omitted: 0,
        obstacles: [SensedObstacle::default(); 8],
        position_age_ticks: 0,
        heading_age_ticks: 0,
    }
}

/// The truth of a UAV with perfect sensors that sense this, in still air.
pub(crate) fn truth(sensed: &Sensed) -> Truth {
    Truth {
        position_m: sensed.position_m,
        heading_rad: sensed.heading_rad,
        speed_m_s: sensed.speed_m_s,
        turn_rate_rad_s: sensed.turn_rate_rad_s,
        wind_m_s: [0.0; 2],
    }
}

/// The account of a command to keep this course.
pub(crate) fn account(tick: i64, uav: u32) -> Account {
    let command = Command::new(Tick(tick), UavId(uav), 15.0, 0.0);
    Account::without_leader(&command)
}

/// The leader at `position_m`, on its way east.
pub(crate) fn leader(tick: i64, position_m: [f64; 2]) -> LeaderState {
    LeaderState { tick: Tick(tick), position_m, heading_rad: 0.0, speed_m_s: 15.0, turn_rate_rad_s: 0.0 }
}

/// The payloads of a tick in which the UAVs swing about their slots by `swing_m`.
fn samples(scenario: &Scenario, tick: i64, swing_m: f64) -> TickSamples {
    let uavs = scenario.formation.uavs;
    let time_s = tick as f64 * scenario.period_s();
    let centre = Point2::new(15.0 * time_s, 0.0);
    let mut samples = TickSamples::new(uavs as usize);
    (samples.tick, samples.leader) = (tick, Some(leader(tick, centre.into())));
    for uav in UavId::all(uavs) {
        let slot = scenario.formation().slot(uav.0, centre);
        // A phase of its own for each UAV: swinging alike, they would keep their distances.
        let phase = time_s + f64::from(uav.0);
        let place = [slot.x + swing_m * phase.sin(), slot.y + swing_m * (1.3 * phase).cos()];
        let heading_rad = (0.1 * phase).sin() * swing_m;
        let sensed = Sensed { heading_rad, ..sensed(tick, uav.0, place) };
        samples.airframes[uav.index()] = Some(AirframeSample::new(&sensed, &truth(&sensed)));
        let age = AgeTicks::between(Tick(tick - 1), Tick(tick));
        samples.accounts[uav.index()] = Some(Account {
            slot_m: slot.into(),
            estimate_m: place,
            estimate_heading_rad: heading_rad,
            previous_force_m: [phase.sin() * swing_m, phase.cos() * swing_m],
            next_force_m: [phase.cos() * swing_m, (2.0 * phase).sin() * swing_m],
            centre_force_m: [(0.7 * phase).sin() * swing_m, (0.7 * phase).cos() * swing_m],
            slot_force_m: [place[0] - slot.x, place[1] - slot.y],
            potential_m2: 1.0 + phase.sin(),
            previous_age: age,
            next_age: age,
            leader_age: age,
            ..account(tick, uav.0)
        });
    }
    samples
}

/// The frames of a flight in which the UAVs swing about their slots.
pub(crate) fn flight(scenario: &Scenario, ticks: std::ops::Range<i64>) -> Vec<Frame> {
    frames(scenario, ticks, 0.3)
}

/// The frame of a formation whose every UAV is in its slot.
pub(crate) fn at_rest(scenario: &Scenario, tick: i64) -> Frame {
    frames(scenario, tick..tick + 1, 0.0).remove(0)
}

fn frames(scenario: &Scenario, ticks: std::ops::Range<i64>, swing_m: f64) -> Vec<Frame> {
    let mut frame = Frame::new(scenario);
    let frame_of = |tick| {
        frame.refill(&samples(scenario, tick, swing_m), scenario.time.rate_hz);
        frame.clone()
    };
    ticks.map(frame_of).collect()
}

/// Starts a recording at `path`, or continues the one there.
pub(crate) fn recording(path: &Path, scenario: &Scenario) -> Recording {
    Recording::begin(Some(path), &opening(scenario), true).unwrap()
}

/// Records some frames.
pub(crate) fn observe(recording: &mut Recording, frames: &[Frame]) {
    for frame in frames {
        recording.observe(frame, None).unwrap();
    }
}

/// Records a flight up to its end.
pub(crate) fn record(path: &Path, scenario: &Scenario, frames: &[Frame]) {
    let mut recording = recording(path, scenario);
    observe(&mut recording, frames);
    recording.finish(None).unwrap();
}

/// Records frames and dies, which loses everything after the last flush.
pub(crate) fn record_and_die(path: &Path, scenario: &Scenario, frames: &[Frame]) {
    let mut recording = recording(path, scenario);
    observe(&mut recording, frames);
    // Dropped, the writer would still finish the file, which a process that is killed cannot do.
    std::mem::forget(recording);
}

/// The bytes of a log of twelve ticks and several chunks: finished by `record`, or cut short by `record_and_die`.
pub(crate) fn small_log(make: fn(&Path, &Scenario, &[Frame])) -> Vec<u8> {
    let (_folder, path) = place();
    let scenario = slow_ring();
    make(&path, &scenario, &flight(&scenario, 0..12));
    std::fs::read(&path).unwrap()
}

/// A path for a log in a temporary folder.
pub(crate) fn place() -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    (folder, path)
}

/// A message as a reader sees it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Seen {
    pub(crate) topic: String,
    pub(crate) tick: u32,
    pub(crate) log_time: u64,
    pub(crate) data: Vec<u8>,
}

/// All messages that mcap's own reader finds in a file, its end included.
pub(crate) fn messages(file: &[u8]) -> Vec<Seen> {
    let stream = mcap::MessageStream::new(file).unwrap();
    let seen = |message: mcap::Message| Seen {
        topic: message.channel.topic.clone(),
        tick: message.sequence,
        log_time: message.log_time,
        data: Cow::into_owned(message.data),
    };
    stream.map(|message| seen(message.unwrap())).collect()
}
