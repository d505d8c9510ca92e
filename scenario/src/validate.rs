//! Which values are possible: every bound of every quantity, and how quantities bound each other.
//!
//! Never meets a number that is not finite: those have not the shape of a scenario.

use crate::{
    Obstacle, Scenario, StartState,
    flaw::{Flaw, Quantity, quantity},
};
use nalgebra::{Point2, distance};

#[cfg(test)]
mod tests;

/// The smallest ring.
pub const UAVS_MIN: u32 = 3;
/// The largest ring.
pub const UAVS_MAX: u32 = 1024;
const OBSTACLES_MAX: usize = 1000;
/// The most that goes each way beside the messages of a tick.
pub const PAYLOAD_MAX_BYTES: u32 = 65_536;
const RATE_MAX_HZ: f64 = 1000.0;
const DURATION_MAX_S: f64 = 24.0 * 3600.0;
const TIMEOUT_MAX_S: f64 = 3600.0;
const NAME_MAX: usize = 60;
const OBSTACLE_NAME_MAX: usize = 40;

/// All that is impossible about `scenario`.
pub(crate) fn flaws(scenario: &Scenario) -> Vec<Flaw> {
    let mut flaws = Vec::new();
    flaws.extend(texts(scenario));
    flaws.extend(time(scenario));
    flaws.extend(formation(scenario));
    flaws.extend(control(scenario));
    flaws.extend(membership(scenario));
    flaws.extend(leader(scenario));
    flaws.extend(airframe(scenario));
    flaws.extend(georeference(scenario));
    flaws.extend(supervision(scenario));
    flaws.extend(ipc(scenario));
    flaws.extend(requirements(scenario));
    flaws.extend(draw(scenario));
    flaws.extend(obstacles(scenario));
    flaws.extend(starts(scenario));
    flaws.extend(faults(scenario));
    flaws
}

fn texts(scenario: &Scenario) -> impl Iterator<Item = Flaw> {
    let name = name_flaw(&scenario.name).map(|message| Flaw::of("name", message));
    let controlled = scenario.description.chars().any(char::is_control);
    let message = "has a line break or another control character: give one line";
    name.into_iter().chain(controlled.then(|| Flaw::of("description", message)))
}

/// A scenario's name becomes a folder's.
fn name_flaw(name: &str) -> Option<String> {
    let allowed = |c: char| c.is_ascii_alphanumeric() || "-_.".contains(c);
    let flaw: String = if name.is_empty() {
        "is empty".into()
    } else if name.len() > NAME_MAX {
        format!("has more than {NAME_MAX} characters")
    } else if name.starts_with('.') {
        "begins with a point".into()
    } else if !name.chars().all(allowed) {
        "has other characters than letters, digits, \"-\", \"_\" and \".\"".into()
    } else {
        return None;
    };
    Some(format!("{flaw}: give a name for a folder, such as \"paper-4.2\""))
}

fn time(scenario: &Scenario) -> impl Iterator<Item = Flaw> {
    let duration = quantity("time.duration_s", scenario.time.duration_s);
    let rate = quantity("time.rate_hz", scenario.time.rate_hz);
    let possible = duration.above_zero().or_else(|| duration.within(0.0..=DURATION_MAX_S));
    let ticks = (possible.is_none() && scenario.time.rate_hz > 0 && scenario.last_tick() < 1).then(|| {
        let less = format!("{} is less than one tick at {}", duration.measure(), rate.measure());
        let message = format!("{less}: give a longer duration_s or a larger rate_hz");
        Flaw::of(duration.key, message.clone()).or(rate.key, message)
    });
    [possible, rate.within(1.0..=RATE_MAX_HZ), ticks].into_iter().flatten()
}

fn formation(scenario: &Scenario) -> impl Iterator<Item = Flaw> {
    let formation = &scenario.formation;
    let fewest = if scenario.ipc.few_uavs { 1 } else { UAVS_MIN };
    [
        quantity("formation.uavs", formation.uavs).within(f64::from(fewest)..=f64::from(UAVS_MAX)),
        quantity("formation.spacing_m", formation.spacing_m).above_zero(),
        angle("formation.bearing_deg", formation.bearing_deg),
    ]
    .into_iter()
    .flatten()
}

fn angle(key: &str, value_deg: f64) -> Option<Flaw> {
    quantity(key, value_deg).within(-360.0..=360.0)
}

fn control(scenario: &Scenario) -> impl Iterator<Item = Flaw> {
    let control = &scenario.control;
    [
        quantity("control.formation_gain", control.formation_gain).above_zero(),
        quantity("control.slot_gain", control.slot_gain).above_zero(),
        quantity("control.obstacle_gain_m", control.obstacle_gain_m).not_below_zero(),
        quantity("control.heading_gain_rad_per_m", control.heading_gain_rad_per_m).above_zero(),
        timeout("control.trust_time_s", control.trust_time_s),
        quantity("control.gain_reach_spacings", control.gain_reach_spacings).above_zero(),
    ]
    .into_iter()
    .flatten()
}

fn timeout(key: &str, value_s: f64) -> Option<Flaw> {
    let timeout = quantity(key, value_s);
    timeout.above_zero().or_else(|| timeout.within(0.0..=TIMEOUT_MAX_S))
}

fn membership(scenario: &Scenario) -> impl Iterator<Item = Flaw> {
    let membership = &scenario.membership;
    let loss_timeout = quantity("membership.loss_timeout_s", membership.loss_timeout_s);
    [
        timeout(loss_timeout.key, loss_timeout.value).or_else(|| few_ticks(scenario, loss_timeout)),
        quantity("membership.slots_move_s", membership.slots_move_s).within(0.0..=TIMEOUT_MAX_S),
    ]
    .into_iter()
    .flatten()
}

/// What a neighbour sends in one tick is heard in the next, or in the one after: four of them make a silence.
fn few_ticks(scenario: &Scenario, timeout: Quantity<'_>) -> Option<Flaw> {
    let rate = quantity("time.rate_hz", scenario.time.rate_hz);
    (scenario.control.ring_closes && timeout.value < 4.0 * scenario.period_s()).then(|| {
        let short = format!("{} is shorter than 4 ticks at {}", timeout.measure(), rate.beside(timeout.key));
        let long = format!("at {} 4 ticks are longer than {}", rate.measure(), timeout.beside(rate.key));
        Flaw::of(timeout.key, format!("{short}: give a longer one"))
            .or(rate.key, format!("{long}: give a larger one"))
    })
}

/// Assumption 1: the airframes can fly as fast, and as slowly, as the leader.
fn leader(scenario: &Scenario) -> impl Iterator<Item = Flaw> {
    let Scenario { leader, airframe, .. } = scenario;
    let speed = quantity("leader.speed_m_s", leader.speed_m_s);
    [
        angle("leader.heading_deg", leader.heading_deg),
        quantity("airframe.speed_min_m_s", airframe.speed_min_m_s).at_most(speed),
        speed.at_most(quantity("airframe.speed_max_m_s", airframe.speed_max_m_s)),
    ]
    .into_iter()
    .flatten()
}

fn airframe(scenario: &Scenario) -> impl Iterator<Item = Flaw> {
    let airframe = &scenario.airframe;
    let speed_min = quantity("airframe.speed_min_m_s", airframe.speed_min_m_s);
    let collision = quantity("airframe.collision_distance_m", airframe.collision_distance_m);
    [
        speed_min.above_zero(),
        speed_min.below(quantity("airframe.speed_max_m_s", airframe.speed_max_m_s)),
        quantity("airframe.turn_rate_max_rad_s", airframe.turn_rate_max_rad_s).above_zero(),
        command_timeout(scenario),
        collision.not_below_zero(),
        collision.below(quantity("formation.spacing_m", scenario.formation.spacing_m)),
    ]
    .into_iter()
    .flatten()
}

fn command_timeout(scenario: &Scenario) -> Option<Flaw> {
    let timeout = quantity("airframe.command_timeout_s", scenario.airframe.command_timeout_s);
    let rate = quantity("time.rate_hz", scenario.time.rate_hz);
    (timeout.value < scenario.period_s()).then(|| {
        let period = format!("shorter than one tick at {}", rate.beside(timeout.key));
        Flaw::of(timeout.key, format!("{} is {period}: give a longer one", timeout.measure())).or(
            rate.key,
            format!(
                "at {} a tick is longer than {}: give a larger one",
                rate.measure(),
                timeout.beside(rate.key)
            ),
        )
    })
}

/// The tangent plane of [`Georeference`](crate::Georeference) has an east only away from the poles.
fn georeference(scenario: &Scenario) -> impl Iterator<Item = Flaw> {
    let georeference = &scenario.georeference;
    [
        quantity("georeference.latitude_deg", georeference.latitude_deg).within(-85.0..=85.0),
        quantity("georeference.longitude_deg", georeference.longitude_deg).within(-180.0..=180.0),
        quantity("georeference.altitude_m", georeference.altitude_m).within(-500.0..=100_000.0),
    ]
    .into_iter()
    .flatten()
}

fn ipc(scenario: &Scenario) -> Option<Flaw> {
    quantity("ipc.payload_bytes", scenario.ipc.payload_bytes).within(0.0..=f64::from(PAYLOAD_MAX_BYTES))
}

fn supervision(scenario: &Scenario) -> impl Iterator<Item = Flaw> {
    [
        timeout("supervision.start_timeout_s", scenario.supervision.start_timeout_s),
        timeout("supervision.answer_timeout_s", scenario.supervision.answer_timeout_s),
    ]
    .into_iter()
    .flatten()
}

fn requirements(scenario: &Scenario) -> impl Iterator<Item = Flaw> {
    let required = &scenario.requirements;
    [
        ("requirements.clearance_min_m", required.clearance_min_m),
        ("requirements.separation_min_m", required.separation_min_m),
        ("requirements.settling_max_s", required.settling_max_s),
        ("requirements.slot_error_max_m", required.slot_error_max_m),
    ]
    .into_iter()
    .filter_map(|(key, value)| quantity(key, value?).not_below_zero())
}

fn draw(scenario: &Scenario) -> impl Iterator<Item = Flaw> {
    let draw = &scenario.start.draw;
    [
        quantity("start.draw.length_radii", draw.length_radii).above_zero(),
        quantity("start.draw.width_radii", draw.width_radii).above_zero(),
        quantity("start.draw.separation_m", draw.separation_m).not_below_zero(),
        quantity("start.draw.heading_spread_deg", draw.heading_spread_deg).within(0.0..=180.0),
    ]
    .into_iter()
    .flatten()
}

fn obstacles(scenario: &Scenario) -> Vec<Flaw> {
    let count = scenario.obstacles.len();
    let mut flaws = vec![quantity("sensing.range_m", scenario.sensing.range_m).above_zero()];
    flaws.push((count > OBSTACLES_MAX).then(|| {
        Flaw::of("obstacles", format!("{count} obstacles are more than {OBSTACLES_MAX}: leave some out"))
    }));
    for (index, obstacle) in scenario.obstacles.iter().enumerate() {
        let key = |name| format!("obstacles.{index}.{name}");
        let (radius_key, braking_key) = (key("radius_m"), key("braking_distance_m"));
        let radius = quantity(&radius_key, obstacle.radius_m);
        flaws.push(obstacle_name(scenario, index, obstacle));
        flaws.push(radius.above_zero());
        flaws.push(radius.below(quantity(&braking_key, obstacle.braking_distance_m)));
        flaws.push(sensed_too_late(scenario, &radius_key, &braking_key, obstacle));
    }
    flaws.into_iter().flatten().collect()
}

fn obstacle_name(scenario: &Scenario, index: usize, obstacle: &Obstacle) -> Option<Flaw> {
    let key = |index| format!("obstacles.{index}.name");
    let name = &obstacle.name;
    let plain = name.chars().all(|c| c.is_ascii_graphic() || c == ' ');
    if name.trim().is_empty() || name.len() > OBSTACLE_NAME_MAX || !plain {
        let message =
            format!("{name:?} is not 1 to {OBSTACLE_NAME_MAX} plain (ASCII) characters: give such a name");
        return Some(Flaw::of(key(index), message));
    }
    let same = scenario.obstacles[..index].iter().position(|other| other.name == *name)?;
    let message = format!("{name:?} is also the name of obstacles.{same}: give each its own");
    Some(Flaw::of(key(index), message).needs(key(same)))
}

/// An obstacle repels from its braking distance on; sensed later, it would repel later than Eq. (13) says.
fn sensed_too_late(scenario: &Scenario, radius: &str, braking: &str, obstacle: &Obstacle) -> Option<Flaw> {
    let range = quantity("sensing.range_m", scenario.sensing.range_m);
    let from_edge = quantity(braking, obstacle.braking_distance_m - obstacle.radius_m);
    let (name, needed) = (&obstacle.name, from_edge.measure());
    (range.value < from_edge.value).then(|| {
        let short =
            format!("{} is less than the {needed} from its edge at which {name:?} repels", range.measure());
        let far =
            format!("{name:?} repels {needed} from its edge, where {} does not reach", range.beside(braking));
        Flaw::of(range.key, format!("{short}: give a larger one"))
            .or(braking, format!("{far}: give a smaller one or a larger range"))
            .needs(radius)
    })
}

fn starts(scenario: &Scenario) -> Vec<Flaw> {
    let states = &scenario.start.uavs;
    let mut flaws = vec![number_of_starts(scenario)];
    for (index, state) in states.iter().enumerate() {
        let (heading, place) = (format!("start.uavs.{index}.heading_deg"), position_key(index));
        flaws.push(angle(&heading, state.heading_deg));
        flaws.extend(start_speed(scenario, index, state));
        flaws.push(too_close(scenario, index, &place));
        flaws.extend(inside(scenario, index, &place));
    }
    flaws.into_iter().flatten().collect()
}

fn position_key(index: usize) -> String {
    format!("start.uavs.{index}.position_m")
}

fn number_of_starts(scenario: &Scenario) -> Option<Flaw> {
    let (listed, uavs) = (scenario.start.uavs.len(), scenario.formation.uavs);
    (listed != 0 && listed != uavs as usize).then(|| {
        let list = format!("{listed} starts are listed, but formation.uavs is {uavs}: list {uavs}, or none");
        let number = format!("{uavs} UAVs, but start.uavs lists {listed}: list {uavs}, or none");
        Flaw::of("start.uavs", format!("{list} to have them drawn"))
            .or("formation.uavs", format!("{number} to have them drawn"))
    })
}

fn start_speed(scenario: &Scenario, index: usize, state: &StartState) -> [Option<Flaw>; 2] {
    let key = format!("start.uavs.{index}.speed_m_s");
    let speed = quantity(&key, state.speed_m_s);
    [
        quantity("airframe.speed_min_m_s", scenario.airframe.speed_min_m_s).at_most(speed),
        speed.at_most(quantity("airframe.speed_max_m_s", scenario.airframe.speed_max_m_s)),
    ]
}

/// Names only the first of those that a UAV is too close to: all of them would be a page.
fn too_close(scenario: &Scenario, index: usize, key: &str) -> Option<Flaw> {
    let place = |state: &StartState| Point2::from(state.position_m);
    let states = &scenario.start.uavs;
    let collision = quantity("airframe.collision_distance_m", scenario.airframe.collision_distance_m);
    let gap = |other: &StartState| distance(&place(other), &place(&states[index]));
    let other = states[..index].iter().position(|other| gap(other) < collision.value)?;
    let close = format!("UAV {} begins {:.2} m from UAV {}", index + 1, gap(&states[other]), other + 1);
    let within = format!("{close}, within {}", collision.beside(key));
    Some(
        Flaw::of(key, format!("{within}: move it away"))
            .or(position_key(other), format!("{within}: move it away"))
            .or(collision.key, format!("{within}: give a smaller one")),
    )
}

fn inside(scenario: &Scenario, index: usize, key: &str) -> Vec<Option<Flaw>> {
    let place = Point2::from(scenario.start.uavs[index].position_m);
    let is_in =
        |obstacle: &Obstacle| distance(&place, &Point2::from(obstacle.position_m)) <= obstacle.radius_m;
    let flaw = |(number, obstacle): (usize, &Obstacle)| {
        let message = format!("UAV {} begins inside {:?}: move it out", index + 1, obstacle.name);
        let obstacle_key = |name| format!("obstacles.{number}.{name}");
        is_in(obstacle).then(|| {
            Flaw::of(key, &*message)
                .or(obstacle_key("position_m"), &*message)
                .or(obstacle_key("radius_m"), &*message)
                .needs(obstacle_key("name"))
        })
    };
    scenario.obstacles.iter().enumerate().map(flaw).collect()
}

/// One that comes after the end of the flight never happens, and is none.
fn faults(scenario: &Scenario) -> impl Iterator<Item = Flaw> {
    scenario.faults.iter().enumerate().flat_map(move |(index, fault)| {
        let (at, what) = (format!("faults.{index}.at_s"), format!("faults.{index}.do"));
        let refusal = fault.action.refusal(scenario.formation.uavs);
        let refusal = refusal.map(|why| Flaw::of(what, &*why).or("formation.uavs", why));
        [quantity(&at, fault.at_s).not_below_zero(), refusal].into_iter().flatten().collect::<Vec<_>>()
    })
}
