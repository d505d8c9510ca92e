//! Whether the airframes can follow the leader's path in formation.
//!
//! A turn of radius rho at speed v turns every UAV at v / rho. If the formation turns with its leader, the outermost UAV,
//! R from the centre in whatever shape, flies at v (1 + R / rho), and the innermost one at v (1 - R / rho). Never flies: it looks at the
//! path alone, and a swarm that is still on its way to its slots needs a reserve beyond these bounds.

use super::{
    UAVS_MAX, manoeuvres,
    violation::{Violation, quantity},
};
use crate::{PathKind, Scenario, ShapeName, key};
use ringwing_flight::{FormationFrame, PathMotion, WaypointError};

/// Share of a limit that rounding may exceed, so that the bound itself is feasible. A larger one would let airframes fall
/// behind by more than rounding.
const ROUNDING: f64 = 1e-9;
/// Moments between two points of a track at which it is checked. Between two of them, a cubic bends little; fewer could
/// miss the tightest place.
const MOMENTS: u32 = 16;

/// Most points of a track. All of them are written into the log and sent to every process: a much larger limit makes both
/// slow. At one point a second, this is an hour and a half.
const POINTS_MAX: usize = 5000;

/// Everything about the path that is impossible by itself or for the airframes.
pub(super) fn leader_path(scenario: &Scenario) -> Vec<Violation> {
    let path = &scenario.leader.path;
    let radius = quantity("leader.path.radius_m", path.radius_m);
    let mut violations = Vec::new();
    match path.kind {
        PathKind::Straight => {}
        PathKind::Circle | PathKind::FigureEight => violations.extend(radius.above_zero()),
        PathKind::Racetrack => {
            violations.extend(radius.above_zero());
            violations.extend(quantity("leader.path.length_m", path.length_m).above_zero());
        }
        PathKind::Waypoints => violations.extend(radius.above_zero().or_else(|| waypoints(scenario))),
        PathKind::Track => violations.extend(points(scenario)),
    }
    // What is wrong in itself has a message already, and would spoil the figures of another one.
    if violations.is_empty() && has_formation(scenario) {
        violations.extend(match path.kind {
            PathKind::Straight => None,
            PathKind::Track => track(scenario),
            _ => radius_of_turns(scenario),
        });
    }
    violations.extend(unused_file(scenario));
    violations
}

/// Whether the numbers that a formation's size and speed follow from are possible.
fn has_formation(scenario: &Scenario) -> bool {
    let Scenario { formation, leader, airframe, .. } = scenario;
    let speeds = airframe.speed_min_m_s > 0.0 && airframe.speed_max_m_s > airframe.speed_min_m_s;
    // With another number of offsets than UAVs there is no formation; that has a message of its own.
    let is_listed =
        formation.shape != ShapeName::Offsets || formation.offsets.len() == formation.uavs as usize;
    // Slots of a formation of any shape take memory for each UAV.
    let is_counted = (1..=UAVS_MAX).contains(&formation.uavs);
    let is_spaced = formation.spacing_m > 0.0 && manoeuvres::quantities(scenario).is_empty();
    is_counted && is_spaced && is_listed && leader.speed_m_s > 0.0 && speeds
}

/// A file that nothing reads is a mistake: the user expects its path to be flown.
fn unused_file(scenario: &Scenario) -> Option<Violation> {
    let path = &scenario.leader.path;
    let message = "a file is given, but kind is not \"track\": give kind = \"track\", or no file";
    let is_unused = path.kind != PathKind::Track && !path.file.is_empty();
    is_unused.then(|| Violation::at("leader.path.file", message).or_at("leader.path.kind", message))
}

fn waypoints(scenario: &Scenario) -> Option<Violation> {
    // A wrong speed has a message of its own, and the geometry does not depend on it.
    let error = scenario.leader.try_path().err()?;
    let place = |index| format!("leader.path.waypoints.{index}.position_m");
    Some(match error {
        WaypointError::None => {
            let message = format!("{error}: give a [[leader.path.waypoints]] section for each");
            Violation::at("leader.path.waypoints", message.clone()).or_at("leader.path.kind", message)
        }
        WaypointError::Coincident { index } => {
            let message = format!("{error}: give another place");
            Violation::at(place(index), message.clone()).or_at("leader.start_m", message)
        }
        WaypointError::NoRoom { index, radius_max_m, .. } => {
            let message = format!(
                "{error} at a radius of {} m: move the waypoint, or give a radius_m of at most {} m",
                scenario.leader.path.radius_m,
                rounded_down(radius_max_m)
            );
            Violation::at(place(index), message.clone())
                .or_at("leader.path.radius_m", message.clone())
                .or_at("leader.start_m", message)
        }
    })
}

/// What is wrong with the points of a track, apart from what the airframes can follow.
fn points(scenario: &Scenario) -> Option<Violation> {
    let points = &scenario.leader.path.points;
    let time_key = |index| format!("leader.path.points.{index}.time_s");
    if points.len() < 2 {
        let message = "a track needs two points or more: give a file, or [[leader.path.points]] sections";
        return Some(Violation::at("leader.path.points", message).depending_on("leader.path.file"));
    }
    if points.len() > POINTS_MAX {
        let message = format!("{} points are more than {POINTS_MAX}: leave some out", points.len());
        return Some(Violation::at("leader.path.points", message));
    }
    let first_s = points[0].time_s;
    if first_s != 0.0 {
        let message = format!("the first point is at {first_s} s: begin the track at 0 s");
        return Some(Violation::at(time_key(0), message));
    }
    let index = 1 + points.windows(2).position(|pair| pair[1].time_s <= pair[0].time_s)?;
    let (before_s, time_s) = (points[index - 1].time_s, points[index].time_s);
    Some(Violation::at(time_key(index), format!("{time_s} s is not after {before_s} s: give a later time")))
}

/// The first place of a track that is not smooth enough for the airframes.
fn track(scenario: &Scenario) -> Option<Violation> {
    let (path, points) = (scenario.leader_path(), &scenario.leader.path.points);
    points.windows(2).enumerate().find_map(|(index, pair)| {
        let duration_s = pair[1].time_s - pair[0].time_s;
        (0..=MOMENTS).find_map(|moment| {
            // The end itself belongs to the next two points, which may turn at another rate.
            let share = (f64::from(moment) / f64::from(MOMENTS)).min(1.0 - ROUNDING);
            let time_s = pair[0].time_s + share * duration_s;
            let refusal = refusal(scenario, &path.at(time_s))?;
            let message = format!(
                "at {time_s:.2} s {refusal}: move the point, or give more time, so that the path is smooth enough"
            );
            let key = format!("leader.path.points.{index}");
            Some(Violation::at(key, message).depending_on("leader.path.file"))
        })
    })
}

/// Refuses a radius that is too small for the airframes.
fn radius_of_turns(scenario: &Scenario) -> Option<Violation> {
    // All turns of such a path are equally tight. Which way it turns does not matter.
    let (radius_m, speed_m_s) = (scenario.leader.path.radius_m, scenario.leader.speed_m_s);
    let pose = scenario.leader_path().at(0.0).pose;
    let turning = PathMotion { pose, speed_m_s, turn_rate_rad_s: speed_m_s / radius_m };
    let refusal = refusal(scenario, &turning)?;
    let remedy = scenario.turn_radius_min_m().map_or_else(
        || "no radius will do: give the leader a speed between those of the airframes".into(),
        |least_m| format!("give a radius of at least {} m", rounded_up(least_m)),
    );
    let message = format!("in a turn of {radius_m} m at {speed_m_s} m/s {refusal}: {remedy}");
    let keys = [
        "leader.speed_m_s",
        "leader.path.kind",
        "formation.frame",
        "formation.shape",
        "formation.uavs",
        "formation.spacing_m",
        "airframe.speed_min_m_s",
        "airframe.speed_max_m_s",
        "airframe.turn_rate_max_rad_s",
    ];
    let violation = Violation::at("leader.path.radius_m", message.clone());
    Some(keys.iter().fold(violation, |violation, key| violation.or_at(*key, message.clone())))
}

/// Which limits of the airframe a formation breaks whose leader moves like this; `None` if it keeps all of them.
fn refusal(scenario: &Scenario, motion: &PathMotion) -> Option<String> {
    let Scenario { airframe, formation, .. } = scenario;
    let (speed_m_s, turn_rate_rad_s) = (motion.speed_m_s, motion.turn_rate_rad_s.abs());
    let reach_m = scenario.reach_m();
    // 0 in a fixed frame: that formation does not turn, so every UAV flies at the speed of the leader.
    let round_m_s = formation.frame.turn_rate_rad_s(turn_rate_rad_s) * reach_m;
    let (outer, inner) = match formation.frame {
        FormationFrame::Fixed => ("every UAV".to_owned(), "every UAV".to_owned()),
        FormationFrame::Leader => (
            format!("the outermost UAV, R = {reach_m:.1} m,"),
            format!("the innermost UAV, R = {reach_m:.1} m,"),
        ),
    };
    let above = |value: f64, limit: f64| value > limit * (1.0 + ROUNDING);
    let limits = [
        (outer, speed_m_s + round_m_s, "above", "airframe.speed_max_m_s", airframe.speed_max_m_s, 1.0),
        (inner, speed_m_s - round_m_s, "below", "airframe.speed_min_m_s", airframe.speed_min_m_s, -1.0),
        (
            "every UAV".into(),
            turn_rate_rad_s,
            "above",
            "airframe.turn_rate_max_rad_s",
            airframe.turn_rate_max_rad_s,
            1.0,
        ),
    ];
    let broken =
        limits.into_iter().filter(
            |(.., value, _, _, limit, sign)| {
                if *sign > 0.0 { above(*value, *limit) } else { above(*limit, *value) }
            },
        );
    let sentences: Vec<String> = broken
        .map(|(who, value, relation, key, limit, _)| {
            let (flown, limit) = (rounded(value), key::with_unit(key, limit));
            format!("{who} would fly at {}, {relation} {key} {limit}", key::with_unit(key, flown))
        })
        .collect();
    (!sentences.is_empty()).then(|| sentences.join(", and "))
}

/// To a thousandth, as a message shows it.
fn rounded(value: f64) -> f64 {
    (value * 1000.0).round() / 1000.0
}

/// Up to the next tenth of a metre, so that the radius that a message recommends is feasible.
fn rounded_up(radius_m: f64) -> f64 {
    (radius_m * (1.0 - ROUNDING) * 10.0).ceil() / 10.0
}

/// Down to a tenth of a metre, so that arcs of this radius fit.
fn rounded_down(radius_m: f64) -> f64 {
    (radius_m * 10.0).floor() / 10.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::WaypointSection;
    use ringwing_flight::TrackPoint;

    fn messages(change: impl FnOnce(&mut Scenario)) -> Vec<String> {
        let mut scenario = Scenario::default();
        change(&mut scenario);
        let line = |violation: Violation| {
            let blame = &violation.blames[0];
            format!("{}: {}", blame.key, blame.message)
        };
        leader_path(&scenario).into_iter().map(line).collect()
    }

    /// A circle of this radius in this frame, with the default R = 40 m, 15 m/s, and limits of 12 and 25 m/s.
    fn circle(frame: FormationFrame, radius_m: f64) -> Vec<String> {
        messages(|scenario| {
            scenario.formation.frame = frame;
            (scenario.leader.path.kind, scenario.leader.path.radius_m) = (PathKind::Circle, radius_m);
        })
    }

    #[test]
    fn a_turn_may_be_as_tight_as_the_innermost_uav_can_fly_it() {
        // 15 (1 - 40 / 200) = 12 m/s.
        assert_eq!(circle(FormationFrame::Leader, 200.0), [""; 0]);
        assert_eq!(
            circle(FormationFrame::Leader, 199.0),
            [
                "leader.path.radius_m: in a turn of 199 m at 15 m/s the innermost UAV, R = 40.0 m, would fly at 11.985 m/s, \
              below airframe.speed_min_m_s 12 m/s: give a radius of at least 200 m"
            ]
        );
    }

    #[test]
    fn a_turn_may_be_as_tight_as_the_outermost_uav_can_fly_it() {
        let circle = |radius_m: f64| {
            messages(|scenario| {
                scenario.formation.frame = FormationFrame::Leader;
                (scenario.airframe.speed_min_m_s, scenario.airframe.speed_max_m_s) = (1.0, 17.0);
                (scenario.leader.path.kind, scenario.leader.path.radius_m) = (PathKind::Circle, radius_m);
            })
        };
        // 15 (1 + 40 / 300) = 17 m/s.
        assert_eq!(circle(300.0), [""; 0]);
        let [refused] = &circle(299.0)[..] else { panic!("one problem") };
        assert!(refused.contains("the outermost UAV") && refused.ends_with("at least 300 m"), "{refused}");
    }

    #[test]
    fn in_a_fixed_frame_the_turn_rate_is_the_only_bound() {
        // 15 m/s / 30 m = 0.5 rad/s.
        assert_eq!(circle(FormationFrame::Fixed, 30.0), [""; 0]);
        assert_eq!(
            circle(FormationFrame::Fixed, 29.0),
            ["leader.path.radius_m: in a turn of 29 m at 15 m/s every UAV would fly at 0.517 rad/s, above \
              airframe.turn_rate_max_rad_s 0.5 rad/s: give a radius of at least 30 m"]
        );
        assert!(circle(FormationFrame::Fixed, 0.0)[0].contains("is not above 0"));
    }

    #[test]
    fn a_leader_at_a_limit_of_the_speed_cannot_turn_its_formation() {
        let refused = messages(|scenario| {
            scenario.formation.frame = FormationFrame::Leader;
            (scenario.leader.path.kind, scenario.leader.speed_m_s) = (PathKind::Circle, 12.0);
        });
        assert!(
            refused[0].ends_with("no radius will do: give the leader a speed between those of the airframes")
        );
    }

    #[test]
    fn waypoints_without_room_for_their_arcs_are_named_with_the_radius_that_fits() {
        let path = |radius_m: f64| {
            messages(|scenario| {
                let path = &mut scenario.leader.path;
                (path.kind, path.radius_m) = (PathKind::Waypoints, radius_m);
                path.waypoints = [[300.0, 0.0], [300.0, 150.0], [0.0, 150.0]]
                    .map(|position_m| WaypointSection { position_m })
                    .into();
            })
        };
        assert_eq!(path(75.0), [""; 0]);
        assert_eq!(
            path(100.0),
            [
                "leader.path.waypoints.1.position_m: the leg to waypoint 1 is 150.0 m long, and its turns need 200.0 m of it \
              at a radius of 100 m: move the waypoint, or give a radius_m of at most 75 m"
            ]
        );
        let none = messages(|scenario| scenario.leader.path.kind = PathKind::Waypoints);
        assert!(
            none[0].starts_with("leader.path.waypoints: a path of waypoints needs at least one"),
            "{none:?}"
        );
    }

    fn track(points: &[(f64, [f64; 2])]) -> Vec<String> {
        messages(|scenario| {
            let path = &mut scenario.leader.path;
            path.kind = PathKind::Track;
            path.points = points
                .iter()
                .map(|(time_s, position_m)| TrackPoint { time_s: *time_s, position_m: *position_m })
                .collect();
        })
    }

    #[test]
    fn a_track_begins_at_0_and_goes_on_in_time() {
        let east = |time_s: f64| (time_s, [15.0 * time_s, 0.0]);
        assert_eq!(track(&[east(0.0), east(5.0), east(9.0)]), [""; 0]);
        assert!(track(&[east(0.0)])[0].starts_with("leader.path.points: a track needs two points"));
        assert!(
            track(&[east(1.0), east(2.0)])[0]
                .starts_with("leader.path.points.0.time_s: the first point is at 1 s")
        );
        assert_eq!(
            track(&[east(0.0), east(2.0), east(2.0)]),
            ["leader.path.points.2.time_s: 2 s is not after 2 s: give a later time"]
        );
    }

    #[test]
    fn a_track_with_a_corner_or_a_wrong_speed_is_refused_where_it_is_not_smooth() {
        let corner =
            track(&[(0.0, [0.0, 0.0]), (4.0, [60.0, 0.0]), (8.0, [120.0, 0.0]), (12.0, [120.0, 60.0])]);
        assert_eq!(corner.len(), 1);
        assert!(
            corner[0].starts_with("leader.path.points.") && corner[0].contains("smooth enough"),
            "{corner:?}"
        );
        let slow = track(&[(0.0, [0.0, 0.0]), (10.0, [100.0, 0.0])]);
        assert!(slow[0].contains("at 0.00 s every UAV would fly at 10 m/s, below"), "{slow:?}");
    }

    #[test]
    fn a_file_that_no_path_reads_is_a_mistake() {
        let unused = messages(|scenario| scenario.leader.path.file = "track.csv".into());
        assert!(
            unused[0].starts_with("leader.path.file: a file is given, but kind is not \"track\""),
            "{unused:?}"
        );
    }
}
