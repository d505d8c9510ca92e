//! The flight as an animated picture, seen by somebody who flies above the leader.
//!
//! Never shows what the log does not have: a leader that is gone is thought to fly on.

use super::{
    figures::{ALARM, colour},
    flight::{LoggedFlight, ShownEvent, UavColumns},
};
use ringwing_drawing::animation::{Animation, Caption, Disc, Mover, Place};
use ringwing_flight::{IntruderId, Pose, Route};
use ringwing_scenario::{IntruderSection, ObstacleSection};

/// Frames of the picture. More make the file longer; with fewer, turns become corners.
const FRAMES: usize = 200;
/// Seconds of the flight in one second of the picture.
const SPEEDUP: f64 = 5.0;
/// Seconds of the flight for which a caption must stay. More puts events into one caption that have nothing to do with each
/// other.
const READING_S: f64 = 2.0;
/// Most captions. More cannot be read in the time; the table of events has all.
const CAPTIONS: usize = 12;

/// The tick that a frame shows, and where the leader is then.
type Frame = (usize, (f64, f64));

/// The flight as an SVG that moves.
pub(super) fn svg(flight: &LoggedFlight) -> String {
    let last = flight.times_s.len().saturating_sub(1);
    // One less than the frames, so that the last frame shows the last tick.
    let ticks: Vec<usize> = (0..FRAMES).map(|frame| frame * last / (FRAMES - 1)).collect();
    let centres: Vec<(f64, f64)> = ticks.iter().map(|tick| leader(flight, *tick)).collect();
    let frames: Vec<_> = ticks.iter().copied().zip(centres.iter().copied()).collect();
    let duration_s = flight.times_s.last().copied().unwrap_or_default();
    Animation {
        movers: movers(flight, &frames),
        discs: discs(flight, &frames),
        outline: frames.iter().map(|(tick, centre)| ring(flight, *tick, *centre)).collect(),
        // The picture moves with the leader, so the ground moves the other way.
        ground: centres.iter().map(|(x, y)| (-x, -y)).collect(),
        captions: captions(flight, duration_s),
        clock: ticks
            .iter()
            .map(|tick| format!("{:.0} s", flight.times_s.get(*tick).unwrap_or(&0.0).floor()))
            .collect(),
        seconds: duration_s / SPEEDUP,
    }
    .svg()
}

/// Where the leader is at `tick`, or where it would be if it had flown on since it was last seen.
fn leader(flight: &LoggedFlight, tick: usize) -> (f64, f64) {
    let seen = |tick: usize| {
        Some(((*flight.leader_x_m.get(tick)?)?, (*flight.leader_y_m.get(tick)?)?, *flight.times_s.get(tick)?))
    };
    let path = flight.scenario.leader_path();
    let planned = |time_s: f64| path.at(time_s).pose.position;
    let now_s = flight.times_s.get(tick).copied().unwrap_or_default();
    let there = planned(now_s);
    // A leader that was paused is behind its plan, and stays behind by as much.
    let behind = (0..=tick).rev().find_map(seen).map(|(x, y, at_s)| {
        let then = planned(at_s);
        (x - then.x, y - then.y)
    });
    let (x, y) = behind.unwrap_or_default();
    (there.x + x, there.y + y)
}

/// The UAVs, and what flies by itself.
fn movers(flight: &LoggedFlight, frames: &[Frame]) -> Vec<Mover> {
    let uavs = (0..).zip(&flight.uavs).map(|(uav, columns)| mover(uav, columns, frames));
    let intruders = (1..).zip(&flight.scenario.intruders);
    uavs.chain(intruders.map(|(number, one)| intruder(flight, number, one, frames))).collect()
}

fn mover(uav: usize, columns: &UavColumns, frames: &[Frame]) -> Mover {
    let place = |(tick, centre): &Frame| {
        let (x, y) = place(columns, *tick, *centre)?;
        let heading_rad = columns.heading_rad.get(*tick).copied().flatten()?;
        Some(Place { x, y, heading_rad })
    };
    let is_full = |(tick, _): &Frame| columns.commanded.get(*tick) == Some(&true);
    Mover {
        name: (uav + 1).to_string(),
        colour: colour(uav),
        places: frames.iter().map(place).collect(),
        is_full: frames.iter().map(is_full).collect(),
    }
}

/// Where a UAV is at `tick`, seen from the leader.
fn place(columns: &UavColumns, tick: usize, (x, y): (f64, f64)) -> Option<(f64, f64)> {
    Some(((*columns.x_m.get(tick)?)? - x, (*columns.y_m.get(tick)?)? - y))
}

/// The line through the UAVs that fly on command, in ring order. One that does not has the corner of the one before it, so
/// that the line always has equally many corners.
fn ring(flight: &LoggedFlight, tick: usize, centre: (f64, f64)) -> Vec<(f64, f64)> {
    let order = flight.scenario.ring_order();
    let in_order: Vec<_> = order.uavs().iter().map(|uav| &flight.uavs[uav.index()]).collect();
    let corner = |columns: &&UavColumns| {
        let is_member = columns.commanded.get(tick) == Some(&true);
        is_member.then(|| place(columns, tick, centre)).flatten()
    };
    let corners: Vec<_> = in_order.iter().map(corner).collect();
    // The line goes round, so a missing first corner takes that of the last UAV.
    let mut last = corners.iter().flatten().next_back().copied().unwrap_or_default();
    let mut line: Vec<_> = corners
        .into_iter()
        .map(|corner| {
            last = corner.unwrap_or(last);
            last
        })
        .collect();
    // The picture closes the line, so one that is open goes back the way that it came.
    if flight.scenario.formation().shape().is_path() {
        line.extend(line.clone().into_iter().rev());
    }
    line
}

fn discs(flight: &LoggedFlight, frames: &[Frame]) -> Vec<Disc> {
    let obstacles = flight.scenario.all_obstacles();
    let disc = |obstacle: &ObstacleSection| {
        let route = obstacle.route();
        let centre = |frame: &Frame| {
            let Pose { position, .. } = at(flight, &route, *frame);
            (position.x, position.y)
        };
        Disc { radius: obstacle.radius_m, colour: ALARM, centres: frames.iter().map(centre).collect() }
    };
    obstacles.iter().map(disc).collect()
}

/// An aircraft that nobody controls; it is never full, so that the picture does not grow to show it.
fn intruder(flight: &LoggedFlight, number: u32, intruder: &IntruderSection, frames: &[Frame]) -> Mover {
    let route = intruder.route();
    let place = |frame: &Frame| {
        let Pose { position, heading_rad } = at(flight, &route, *frame);
        Some(Place { x: position.x, y: position.y, heading_rad })
    };
    Mover {
        name: IntruderId(number).to_string(),
        colour: ALARM,
        places: frames.iter().map(place).collect(),
        is_full: vec![false; frames.len()],
    }
}

/// Where something is that moves by itself, seen from the leader.
fn at(flight: &LoggedFlight, route: &Route, (tick, (x, y)): Frame) -> Pose {
    let mut pose = route.at(flight.times_s.get(tick).copied().unwrap_or_default()).pose;
    pose.position.x -= x;
    pose.position.y -= y;
    pose
}

/// The first events of the flight. Those that follow each other closely share a caption, because nobody could read the first.
fn captions(flight: &LoggedFlight, duration_s: f64) -> Vec<Caption> {
    // Events of the approach and after the last tick have no frame.
    let events = flight.events.iter().filter(|event| event.time_s >= 0.0 && event.time_s <= duration_s);
    let events: Vec<&ShownEvent> = events.collect();
    let groups = events.chunk_by(|one, next| next.time_s - one.time_s < READING_S);
    let caption = |group: &[&ShownEvent]| {
        let texts: Vec<&str> = group.iter().map(|event| event.text.as_str()).collect();
        let time_s = group.first().map_or(0.0, |event| event.time_s);
        Caption {
            // A log of a single tick lasts 0 s, and 0 / 0 would be NaN.
            at: time_s / duration_s.max(f64::MIN_POSITIVE),
            text: format!("{time_s:.1} s: {}", texts.join("; ")),
        }
    };
    groups.map(caption).take(CAPTIONS).collect()
}
