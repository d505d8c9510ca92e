//! Bounds of the wind, and whether the airframes can follow the leader in it.
//!
//! A slot that moves at v over the ground in a wind w needs an airspeed of |v - w|. Never judges gusts: what they ask for passes,
//! and a swarm that has to catch up needs a reserve beyond these bounds all the same.

use super::{
    angle,
    violation::{Violation, quantity},
};
use crate::{PathKind, Scenario, key};
use nalgebra::Vector2;
use ringwing_flight::PathMotion;

/// Fastest wind, in m/s. A faster one is a mistake: no airframe of this kind flies in a hurricane.
const SPEED_MAX_M_S: f64 = 60.0;
/// The heights for which MIL-F-8785C has gusts of low altitude: 10 to 1000 feet.
const HEIGHTS_M: std::ops::RangeInclusive<f64> = 3.048..=304.8;
/// Moments of the flight at which a leader that turns is checked. With fewer, a short leg against the wind could be missed.
const MOMENTS: u32 = 1024;
/// Share of a limit that rounding may exceed, so that the bound itself is feasible.
const ROUNDING: f64 = 1e-9;
/// Steps in which the strongest feasible wind is found: to a thousandth of the given one.
const STEPS: u32 = 10;

/// The bounds of each quantity by itself.
pub(super) fn quantities(scenario: &Scenario) -> impl Iterator<Item = Violation> {
    let wind = &scenario.wind;
    [
        quantity("wind.mean_speed_m_s", wind.mean_speed_m_s).within(0.0..=SPEED_MAX_M_S),
        angle("wind.from_deg", wind.from_deg),
        quantity("wind.turbulence_m_s", wind.turbulence_m_s).within(0.0..=SPEED_MAX_M_S),
        quantity("wind.height_m", wind.height_m).within(HEIGHTS_M),
    ]
    .into_iter()
    .flatten()
}

/// Refuses a mean wind in which some UAV in its slot would need an airspeed or a turn rate that its airframe cannot fly.
pub(super) fn through_the_air(scenario: &Scenario) -> Option<Violation> {
    let mean_m_s = scenario.wind.mean_m_s();
    if mean_m_s == Vector2::zeros() {
        return None;
    }
    let motions = leader_motions(scenario);
    let (time_s, refusal) = refusal(scenario, &motions, mean_m_s)?;
    let remedy = match strongest_share(scenario, &motions, mean_m_s) {
        Some(share) => {
            let most_m_s = (share * scenario.wind.mean_speed_m_s * 10.0).floor() / 10.0;
            format!("give at most {most_m_s} m/s from there, or another direction")
        }
        None => "no wind from there will do: give another direction".into(),
    };
    let message = format!("at {time_s:.2} s {refusal}: {remedy}");
    let violation = Violation::at("wind.mean_speed_m_s", &*message);
    let keys = [
        "wind.from_deg",
        "leader.speed_m_s",
        "leader.heading_deg",
        "leader.path.kind",
        "airframe.speed_min_m_s",
        "airframe.speed_max_m_s",
        "airframe.turn_rate_max_rad_s",
    ];
    Some(keys.iter().fold(violation, |violation, key| violation.or_at(*key, &*message)))
}

/// How the leader moves at moments of the flight, each with its time in seconds.
fn leader_motions(scenario: &Scenario) -> Vec<(f64, PathMotion)> {
    let path = scenario.leader_path();
    // All moments of a straight path are the same.
    let moments = if scenario.leader.path.kind == PathKind::Straight { 0 } else { MOMENTS };
    let time_s = |moment| scenario.time.duration_s * f64::from(moment) / f64::from(MOMENTS);
    (0..=moments).map(|moment| (time_s(moment), path.at(time_s(moment)))).collect()
}

/// The share of the wind that can be flown in, below 1; `None` if only still air can.
fn strongest_share(
    scenario: &Scenario,
    motions: &[(f64, PathMotion)],
    mean_m_s: Vector2<f64>,
) -> Option<f64> {
    let (mut feasible, mut refused) = (0.0, 1.0);
    for _ in 0..STEPS {
        let share: f64 = f64::midpoint(feasible, refused);
        match refusal(scenario, motions, mean_m_s * share) {
            None => feasible = share,
            Some(_) => refused = share,
        }
    }
    (feasible > 0.0).then_some(feasible)
}

/// The first moment at which a slot asks too much of an airframe, and what.
fn refusal(
    scenario: &Scenario,
    motions: &[(f64, PathMotion)],
    wind_m_s: Vector2<f64>,
) -> Option<(f64, String)> {
    let at = |(time_s, motion): &(f64, PathMotion)| Some((*time_s, refusal_at(scenario, motion, wind_m_s)?));
    motions.iter().find_map(at)
}

fn refusal_at(scenario: &Scenario, motion: &PathMotion, wind_m_s: Vector2<f64>) -> Option<String> {
    let airframe = &scenario.airframe;
    let velocity_m_s = motion.velocity_m_s();
    let air_m_s = velocity_m_s - wind_m_s;
    let airspeed_m_s = air_m_s.norm();
    // Slots go round the leader in its frame: outer ones add to its velocity in all directions in turn.
    let round_m_s =
        scenario.formation.frame.turn_rate_rad_s(motion.turn_rate_rad_s).abs() * scenario.reach_m();
    // The velocity over the ground turns at omega. That through the air turns slower with the wind from ahead.
    let turn_rate_rad_s = motion.turn_rate_rad_s.abs() * air_m_s.dot(&velocity_m_s) / air_m_s.norm_squared();
    let (fastest, slowest) = (airspeed_m_s + round_m_s, airspeed_m_s - round_m_s);
    let sentence = |flown: f64, relation: &str, key: &str, limit: f64| {
        let (flown, limit) =
            (key::with_unit(key, (flown * 1000.0).round() / 1000.0), key::with_unit(key, limit));
        format!("the wind asks for {flown} through the air, {relation} {key} {limit}")
    };
    if fastest > airframe.speed_max_m_s * (1.0 + ROUNDING) {
        Some(sentence(fastest, "above", "airframe.speed_max_m_s", airframe.speed_max_m_s))
    } else if slowest < airframe.speed_min_m_s * (1.0 - ROUNDING) {
        Some(sentence(slowest, "below", "airframe.speed_min_m_s", airframe.speed_min_m_s))
    } else if turn_rate_rad_s > airframe.turn_rate_max_rad_s * (1.0 + ROUNDING) {
        let limit = airframe.turn_rate_max_rad_s;
        Some(sentence(turn_rate_rad_s, "above", "airframe.turn_rate_max_rad_s", limit))
    } else {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is wrong with a wind of this speed from this angle, for a leader that flies `kind` to the east at 15 m/s with
    /// airframes of 12 to 25 m/s.
    fn refused(speed_m_s: f64, from_deg: f64, kind: PathKind) -> Option<String> {
        let mut scenario = Scenario::default();
        (scenario.wind.mean_speed_m_s, scenario.wind.from_deg) = (speed_m_s, from_deg);
        scenario.leader.path.kind = kind;
        Some(through_the_air(&scenario)?.blames[0].message.clone())
    }

    #[test]
    fn a_wind_from_ahead_or_behind_may_use_up_the_range_of_speeds_and_no_more() {
        assert_eq!(refused(10.0, 0.0, PathKind::Straight), None);
        assert_eq!(refused(3.0, 180.0, PathKind::Straight), None);
        let message = refused(11.0, 0.0, PathKind::Straight).unwrap();
        assert!(message.contains("26 m/s through the air, above airframe.speed_max_m_s 25 m/s"), "{message}");
        assert!(message.contains("give at most 9.9 m/s from there"), "{message}");
        let message = refused(4.0, 180.0, PathKind::Straight).unwrap();
        assert!(message.contains("11 m/s through the air, below airframe.speed_min_m_s 12 m/s"), "{message}");
    }

    #[test]
    fn a_wind_from_the_side_needs_the_airspeed_of_the_wind_triangle() {
        // 20^2 + 15^2 = 25^2.
        assert_eq!(refused(20.0, 90.0, PathKind::Straight), None);
        assert!(refused(20.1, 90.0, PathKind::Straight).is_some());
    }

    #[test]
    fn a_leader_that_circles_meets_the_wind_from_all_sides() {
        assert_eq!(refused(2.9, 90.0, PathKind::Circle), None);
        assert!(refused(3.1, 90.0, PathKind::Circle).unwrap().contains("below airframe.speed_min_m_s"));
    }

    #[test]
    fn where_the_leader_is_as_slow_as_the_airframes_no_wind_from_behind_will_do() {
        let mut scenario = Scenario::default();
        scenario.leader.speed_m_s = 12.0;
        scenario.wind.mean_speed_m_s = 2.0;
        let message = &through_the_air(&scenario).unwrap().blames[0].message;
        assert!(message.ends_with("no wind from there will do: give another direction"), "{message}");
    }
}
