//! How UAVs pass an obstacle: their trajectories, distances and repulsion near it.

use super::{
    DRAWN_UAVS, FlightFigure, GREY, LEADER, colour, map::trajectories, name_of, over_time::OverTime, paper,
    points,
};
use crate::review::flight::{Column, LoggedFlight, UavColumns};
use ringwing_drawing::chart::{Chart, Stroke, Symbol};
use ringwing_scenario::ObstacleSection;
use std::ops::RangeInclusive;

/// Time shown before the first and after the last UAV is within the braking distance. Without it, lines would begin and
/// end at the frame.
const MARGIN_S: f64 = 2.0;

/// Half the width and half the height of a close-up, in braking distances of its obstacle. Smaller ones cut off the
/// return to the formation; larger ones make the deflection hard to see.
const CLOSE_UP: (f64, f64) = (4.0, 2.0);

/// Least width of a path in the close-up, as a share of half the width. Shorter ones show nothing of how a UAV passes.
const STUB: f64 = 0.3;

/// A UAV that the obstacle repelled, by its index from 0, with its distance from the obstacle's centre.
struct Repelled {
    uav: usize,
    distance_m: Column,
}

/// The figures of an obstacle, which is the `number`th of the scenario; only the close-up if it repelled no UAV. One that
/// moves has no close-up, because the UAVs pass it in many places.
pub(super) fn figures(flight: &LoggedFlight, number: usize, obstacle: &ObstacleSection) -> Vec<FlightFigure> {
    let repelled = repelled(flight, obstacle);
    let close_up = (!obstacle.moves()).then(|| close_up(flight, number, obstacle));
    let mut figures = Vec::from_iter(close_up);
    if repelled.is_empty() {
        return figures;
    }
    let mut over_time =
        [distances(flight, number, obstacle, &repelled), repulsions(flight, number, obstacle, &repelled)];
    let window_s = window_s(flight, obstacle, &repelled);
    for figure in &mut over_time {
        clip(&mut figure.chart, |(time_s, _)| window_s.contains(&time_s));
        // These few seconds have an axis of their own, and the passage fills it.
        figure.is_over_time = false;
        figure.chart.bands.clear();
    }
    figures.extend(over_time);
    figures
}

fn distances(
    flight: &LoggedFlight,
    number: usize,
    obstacle: &ObstacleSection,
    repelled: &[Repelled],
) -> FlightFigure {
    let columns = repelled.iter().map(|one| (name_of(one.uav), colour(one.uav), one.distance_m.clone()));
    OverTime::of_columns(flight, columns.collect())
        .level("R_obs", obstacle.radius_m)
        .level("L_obs", obstacle.braking_distance_m)
        .figure(
            &format!("obstacle-{number}-distance"),
            &format!("Distance to {}{}", obstacle.name, paper(flight, "Fig. 7b and 8b")),
            "Distance from the obstacle's centre, of the UAVs that it repelled, while any of them was near.",
            "distance, m",
        )
}

fn repulsions(
    flight: &LoggedFlight,
    number: usize,
    obstacle: &ObstacleSection,
    repelled: &[Repelled],
) -> FlightFigure {
    let columns = repelled.iter().map(|one| {
        // Outside the braking distance, any repulsion comes from another obstacle.
        let is_near = |distance: &Option<f64>| distance.is_some_and(|it| it < obstacle.braking_distance_m);
        let repulsions = flight.uavs[one.uav].repulsion_m.iter().zip(&one.distance_m);
        let column =
            repulsions.map(|(repulsion, distance)| repulsion.filter(|_| is_near(distance))).collect();
        (name_of(one.uav), colour(one.uav), column)
    });
    OverTime::of_columns(flight, columns.collect()).figure(
        &format!("obstacle-{number}-repulsion"),
        &format!("Repulsion by {}{}", obstacle.name, paper(flight, "Fig. 7b and 8b")),
        "The length of f_obs, Eq. (13), within the braking distance.",
        "repulsion, m",
    )
}

/// The UAVs that an obstacle repelled, by ascending number. Of many, only those that came closest.
fn repelled(flight: &LoggedFlight, obstacle: &ObstacleSection) -> Vec<Repelled> {
    let route = obstacle.route();
    let centres: Vec<_> = flight.times_s.iter().map(|time_s| route.at(*time_s).pose.position).collect();
    let distance = |uav: &UavColumns| -> Column {
        let places = points(&uav.x_m, &uav.y_m).into_iter().zip(&centres);
        places.map(|(place, centre)| place.map(|(x, y)| (x - centre.x).hypot(y - centre.y))).collect()
    };
    let mut near: Vec<(f64, Repelled)> = Vec::new();
    for (uav, columns) in flight.uavs.iter().enumerate() {
        let distance_m = distance(columns);
        let closest_m = distance_m.iter().flatten().copied().fold(f64::INFINITY, f64::min);
        if closest_m < obstacle.braking_distance_m {
            near.push((closest_m, Repelled { uav, distance_m }));
        }
    }
    near.sort_by(|a, b| a.0.total_cmp(&b.0));
    near.truncate(DRAWN_UAVS);
    near.sort_by_key(|(_, one)| one.uav);
    near.into_iter().map(|(_, one)| one).collect()
}

/// The time during which any UAV was within the braking distance, with a margin.
fn window_s(flight: &LoggedFlight, obstacle: &ObstacleSection, repelled: &[Repelled]) -> RangeInclusive<f64> {
    let is_any_near = |tick: &usize| {
        let is_near =
            |one: &Repelled| one.distance_m[*tick].is_some_and(|it| it < obstacle.braking_distance_m);
        repelled.iter().any(is_near)
    };
    // Each repelled UAV was near in some tick, so both searches succeed.
    let first = (0..flight.times_s.len()).find(is_any_near).unwrap_or_default();
    let last = (0..flight.times_s.len()).rfind(is_any_near).unwrap_or_default();
    flight.times_s[first] - MARGIN_S..=flight.times_s[last] + MARGIN_S
}

/// The trajectories near an obstacle.
fn close_up(flight: &LoggedFlight, number: usize, obstacle: &ObstacleSection) -> FlightFigure {
    let [x, y] = obstacle.position_m;
    let half_width_m = CLOSE_UP.0 * obstacle.braking_distance_m;
    let half_height_m = CLOSE_UP.1 * obstacle.braking_distance_m;
    let is_near =
        |(east, north): (f64, f64)| (east - x).abs() <= half_width_m && (north - y).abs() <= half_height_m;
    let mut figure = trajectories(flight);
    clip(&mut figure.chart, is_near);
    // Leave out the rings and the leader's path, which would hide the trajectories. Only their colours tell them
    // apart.
    figure.chart.lines.retain(|line| line.colour != GREY && line.colour != LEADER);
    // A path that only touches the corner of the close-up would show as a stub.
    figure.chart.lines.retain(|line| {
        let x = || line.points.iter().flatten().filter(|point| is_near(**point)).map(|(x, _)| *x);
        let width = x().fold(f64::NEG_INFINITY, f64::max) - x().fold(f64::INFINITY, f64::min);
        width > STUB * half_width_m || line.stroke != Stroke::Solid && width > 0.0
    });
    figure.chart.marks.retain(|mark| mark.symbol == Symbol::Cross && is_near(mark.at));
    FlightFigure {
        name: format!("obstacle-{number}"),
        title: format!("{}{}", obstacle.name, paper(flight, "Fig. 7a and 8a")),
        caption: "The trajectories near the obstacle.".into(),
        ..figure
    }
}

/// Removes the points that are not shown, and shortens dashed levels to what is left.
fn clip(chart: &mut Chart, is_shown: impl Fn((f64, f64)) -> bool) {
    for line in chart.lines.iter_mut().filter(|line| line.stroke == Stroke::Solid) {
        for point in &mut line.points {
            *point = point.filter(|point| is_shown(*point));
        }
        // Thinning counts points. Long breaks must not use up the detail of what is shown.
        line.points.dedup_by(|one, other| one.is_none() && other.is_none());
    }
    let solid = chart.lines.iter().filter(|line| line.stroke == Stroke::Solid);
    let times = || solid.clone().flat_map(|line| line.points.iter().flatten().map(|(x, _)| *x));
    let (first, last) = (times().fold(f64::INFINITY, f64::min), times().fold(f64::NEG_INFINITY, f64::max));
    // Levels are the dashed lines of two points; dashed circles have more.
    for line in chart.lines.iter_mut().filter(|line| line.stroke == Stroke::Dashed && line.points.len() == 2)
    {
        for (point, end) in line.points.iter_mut().zip([first, last]) {
            *point = point.map(|(_, y)| (end, y)).filter(|_| end.is_finite());
        }
    }
}
