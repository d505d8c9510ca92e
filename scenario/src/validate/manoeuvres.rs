//! Bounds of manoeuvres: their quantities, their order in time, and what the airframes can follow.
//!
//! Never plans a manoeuvre from values that are wrong: `follow` runs only if nothing else is.

use super::{
    TIMEOUT_MAX_S, angle, formation,
    violation::{Violation, quantity},
};
use crate::{ManoeuvreSection, PathKind, Scenario};
use ringwing_flight::{FrameMotion, Manoeuvre, Slot, SpeedRange, UavId};
use std::ops::Range;

/// Seconds by which a manoeuvre may be shorter than it should: the shortest time is computed with rounding.
const ROUNDING_S: f64 = 1e-6;
/// Moments of the leader's path at which a manoeuvre is checked. With fewer, a short turn could be missed; more only make
/// the check slower.
const LEADER_MOMENTS: u32 = 64;

/// The bounds of each quantity by itself, and the order in time.
pub(super) fn quantities(scenario: &Scenario) -> Vec<Violation> {
    let mut violations = Vec::new();
    let mut flown = scenario.formation.clone();
    for (index, manoeuvre) in scenario.manoeuvres.iter().enumerate() {
        let key = |name: &str| format!("manoeuvres.{index}.{name}");
        violations.extend(quantity(&key("at_s"), manoeuvre.at_s).not_below_zero());
        violations.extend(quantity(&key("over_s"), manoeuvre.over_s).timeout(TIMEOUT_MAX_S));
        violations.extend(manoeuvre.spacing_m.and_then(|m| quantity(&key("spacing_m"), m).above_zero()));
        violations.extend(manoeuvre.bearing_deg.and_then(|deg| angle(&key("bearing_deg"), deg)));
        flown = manoeuvre.applied_to(&flown);
        violations.extend(formation::shape(scenario, &flown, &format!("manoeuvres.{index}")));
        violations.extend(index.checked_sub(1).and_then(|before| too_early(scenario, before, manoeuvre)));
    }
    violations
}

/// A manoeuvre that begins before the one before it has ended.
fn too_early(scenario: &Scenario, before: usize, manoeuvre: &ManoeuvreSection) -> Option<Violation> {
    let earlier = &scenario.manoeuvres[before];
    let end_s = earlier.at_s + earlier.over_s;
    (manoeuvre.at_s < end_s).then(|| {
        let (at, index) = (manoeuvre.at_s, before + 1);
        let message = format!("begins at {at} s, but manoeuvres.{before} ends at {end_s} s: begin it later");
        Violation::at(format!("manoeuvres.{index}.at_s"), &*message)
            .or_at(format!("manoeuvres.{before}.over_s"), &*message)
            .or_at(format!("manoeuvres.{before}.at_s"), message)
    })
}

/// Manoeuvres that are faster than the airframes, or in which two UAVs would collide.
///
/// A slot moves at a constant rate, so its velocity is that of its place in the formation plus its own. Airframes need that velocity
/// less the mean wind.
pub(super) fn follow(scenario: &Scenario) -> Vec<Violation> {
    let (formation, order) = (scenario.formation(), scenario.ring_order());
    let uavs = || UavId::all(formation.count());
    let mut slots: Vec<Slot> = uavs().map(|uav| formation.place(order.slot(uav))).collect();
    let mut violations = Vec::new();
    for (index, manoeuvre) in scenario.planned_manoeuvres().iter().enumerate() {
        violations.extend(too_fast(scenario, index, manoeuvre, &slots));
        violations.extend(too_near(scenario, index, manoeuvre, &slots));
        slots = uavs().map(|uav| manoeuvre.slot(uav)).collect();
    }
    violations
}

fn too_fast(scenario: &Scenario, index: usize, manoeuvre: &Manoeuvre, before: &[Slot]) -> Option<Violation> {
    let airframe = &scenario.airframe;
    let speeds = SpeedRange { min_m_s: airframe.speed_min_m_s, max_m_s: airframe.speed_max_m_s };
    let needed = |during: Range<f64>| {
        let motions = leader_motions(scenario, during);
        let shortest = |(uav, from): (UavId, &Slot)| {
            (uav, manoeuvre.shortest_s(uav, from, &motions, speeds).unwrap_or(f64::INFINITY))
        };
        let slots = UavId::all(before.len() as u32).zip(before).map(shortest);
        slots.max_by(|one, other| one.1.total_cmp(&other.1))
    };
    let planned = &scenario.manoeuvres[index];
    let end_s = planned.at_s + planned.over_s;
    let (uav, least_s) = needed(planned.at_s..end_s)?;
    let over_key = format!("manoeuvres.{index}.over_s");
    let over = quantity(&over_key, planned.over_s);
    if over.value >= least_s - ROUNDING_S {
        return None;
    }
    // A longer manoeuvre may last into the leader's next turn, so the advice counts every turn from here on.
    let (_, advised_s) = needed(planned.at_s..scenario.time.duration_s.max(end_s))?;
    let limits = format!("{} to {} m/s", speeds.min_m_s, speeds.max_m_s);
    let remedy = if advised_s.is_finite() {
        // Rounded up, so that the advice works.
        format!("give {:.1} s or more", (advised_s * 10.0).ceil() / 10.0)
    } else {
        format!("no time is long enough at a leader's speed of {} m/s", scenario.leader.speed_m_s)
    };
    let message = format!("in {}, the slot of {uav} needs speeds outside {limits}: {remedy}", over.measure());
    let violation = Violation::at(over.key, &*message)
        .or_at(format!("manoeuvres.{index}.shape"), &*message)
        .or_at(format!("manoeuvres.{index}.spacing_m"), &*message)
        .or_at(format!("manoeuvres.{index}.bearing_deg"), &*message)
        .or_at("leader.path.kind", &*message);
    Some(violation.or_at("leader.speed_m_s", message))
}

/// How the leader moves through the air at moments `during` this time in seconds, seen in the formation's frame.
fn leader_motions(scenario: &Scenario, during: Range<f64>) -> Vec<FrameMotion> {
    let (path, frame) = (scenario.leader_path(), scenario.formation.frame);
    let wind_m_s = scenario.wind.mean_m_s();
    // All moments of a straight path are the same.
    let moments = if scenario.leader.path.kind == PathKind::Straight { 0 } else { LEADER_MOMENTS };
    let at = |moment: u32| {
        let share = f64::from(moment) / f64::from(LEADER_MOMENTS);
        FrameMotion::new(frame, &path.at(during.start + share * (during.end - during.start)), wind_m_s)
    };
    (0..=moments).map(at).collect()
}

fn too_near(scenario: &Scenario, index: usize, manoeuvre: &Manoeuvre, before: &[Slot]) -> Option<Violation> {
    let passing = manoeuvre.closest_passing(before)?;
    let least = quantity("airframe.collision_distance_m", scenario.airframe.collision_distance_m);
    (passing.apart_m <= least.value).then(|| {
        let [one, other] = passing.uavs;
        let message = format!(
            "the slots of {one} and {other} come within {:.2} m of each other, which is not above {} {}: give order = \
             \"nearest\"",
            passing.apart_m,
            least.key,
            least.measure()
        );
        Violation::at(format!("manoeuvres.{index}.order"), &*message).or_at(least.key, message)
    })
}
