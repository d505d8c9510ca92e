//! Bounds of the aircraft that nobody controls.

use super::{
    angle,
    places::{position, position_key, waypoints},
    violation::{Violation, quantity},
};
use crate::{IntruderSection, Scenario};
use nalgebra::{Point2, distance};

/// Most intruders of a scenario. Every UAV is checked against every intruder in every tick, so many more make the world
/// slow.
const INTRUDERS_MAX: usize = 100;

pub(super) fn intruders(scenario: &Scenario) -> Vec<Violation> {
    let count = scenario.intruders.len();
    let too_many = (count > INTRUDERS_MAX).then(|| {
        Violation::at("intruders", format!("{count} intruders are more than {INTRUDERS_MAX}: remove some"))
    });
    let mut violations: Vec<_> = too_many.into_iter().collect();
    for (index, intruder) in scenario.intruders.iter().enumerate() {
        violations.extend(flight_of(index, intruder));
        violations.extend(start_too_close(scenario, index, intruder));
    }
    violations
}

/// An aircraft cannot stand in the air.
fn flight_of(index: usize, intruder: &IntruderSection) -> Vec<Violation> {
    let key = |name| format!("intruders.{index}.{name}");
    let speed_key = key("speed_m_s");
    let way = waypoints(&key("waypoints_m"), &intruder.waypoints_m, &speed_key, intruder.speed_m_s);
    let speed = quantity(&speed_key, intruder.speed_m_s).above_zero();
    // With waypoints, `waypoints` has reported the speed already.
    let speed = speed.filter(|_| intruder.waypoints_m.is_empty());
    let heading = angle(&key("heading_deg"), intruder.heading_deg);
    way.into_iter().chain(speed).chain(heading).collect()
}

/// A listed start so near to that of an intruder that the flight begins with a collision.
fn start_too_close(
    scenario: &Scenario,
    index: usize,
    intruder: &IntruderSection,
) -> impl Iterator<Item = Violation> {
    let place = Point2::from(intruder.position_m);
    let collision_m = scenario.airframe.collision_distance_m;
    let starts = scenario.start.uavs.iter().enumerate();
    starts.filter(move |(_, start)| distance(&position(start), &place) < collision_m).map(
        move |(uav, start)| {
            let gap_m = distance(&position(start), &place);
            let message = format!(
                "UAV {} starts {gap_m:.2} m from intruder {}, within airframe.collision_distance_m {collision_m} m: move \
                 one of them away",
                uav + 1,
                index + 1
            );
            Violation::at(format!("intruders.{index}.position_m"), &*message)
                .or_at(position_key(uav), &*message)
                .or_at("airframe.collision_distance_m", message)
        },
    )
}
