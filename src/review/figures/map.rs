//! The trajectories of the whole flight from above.

use super::{ALARM, DRAWN_UAVS, FlightFigure, GREY, LEADER, colour, detail, name_of, points, times};
use crate::review::{
    flight::{LoggedFlight, UavColumns},
    table::Table,
};
use ringwing_drawing::{
    RGBColor,
    chart::{Chart, Curve, Stroke},
};
use ringwing_recorder::show::circle;
use ringwing_scenario::ObstacleSection;

/// The trajectories of the whole flight.
pub(super) fn trajectories(flight: &LoggedFlight) -> FlightFigure {
    let columns = flight.uavs.iter().enumerate().flat_map(|(uav, columns)| {
        [
            (format!("uav {} x_m", uav + 1), columns.x_m.clone()),
            (format!("uav {} y_m", uav + 1), columns.y_m.clone()),
        ]
    });
    let leader = [("leader x_m", &flight.leader_x_m), ("leader y_m", &flight.leader_y_m)];
    let leader = leader.map(|(name, column)| (name.to_owned(), column.clone()));
    FlightFigure {
        name: "trajectories".into(),
        title: "Trajectories (the paper's Fig. 3 and 6)".into(),
        caption: "Grey: the ring at the start, halfway and at the end.".into(),
        table: Table::new(&times(flight), columns.chain(leader)),
        chart: Chart {
            x: "x (east), m",
            y: "y (north), m",
            is_map: true,
            detail: detail(flight.uavs.len()),
            lines: lines(flight),
            ..Chart::default()
        },
    }
}

/// Obstacles, paths and rings, in the order of drawing.
fn lines(flight: &LoggedFlight) -> Vec<Curve> {
    // With many UAVs, names would fill the legend.
    let has_names = flight.uavs.len() <= DRAWN_UAVS;
    let mut lines: Vec<Curve> = flight.scenario.obstacles.iter().flat_map(circles).collect();
    lines.extend(flight.uavs.iter().enumerate().map(|(uav, columns)| Curve {
        name: if has_names { name_of(uav) } else { String::new() },
        ..path(colour(uav), points(&columns.x_m, &columns.y_m))
    }));
    // The log holds the leader's position less often than the UAVs', so gaps between its points must not break the
    // line.
    let leader = points(&flight.leader_x_m, &flight.leader_y_m).into_iter().flatten().map(Some).collect();
    lines.push(Curve { name: "leader".into(), stroke: Stroke::Dashed, ..path(LEADER, leader) });
    // One row of the legend is too short for the whole name, so it takes two rows. The legend shows equal names once.
    for (share, name) in [(0.0, "ring, start and"), (0.5, "halfway, end"), (1.0, "halfway, end")] {
        lines.push(Curve { name: name.into(), ..path(GREY, ring(flight, share)) });
    }
    lines
}

fn path(colour: RGBColor, points: Vec<Option<(f64, f64)>>) -> Curve {
    Curve { name: String::new(), colour, stroke: Stroke::Solid, points }
}

/// The closed polygon of ring neighbours after a `share` of the flight, from 0 to 1.
fn ring(flight: &LoggedFlight, share: f64) -> Vec<Option<(f64, f64)>> {
    let tick = (share * flight.times_s.len().saturating_sub(1) as f64) as usize;
    let place = |uav: &UavColumns| Some(((*uav.x_m.get(tick)?)?, (*uav.y_m.get(tick)?)?));
    let mut ring: Vec<_> = flight
        .scenario
        .ring_order()
        .uavs()
        .iter()
        .filter_map(|uav| place(&flight.uavs[uav.index()]))
        .map(Some)
        .collect();
    ring.extend(ring.first().copied());
    ring
}

/// An obstacle's body, and the circle within which it repels.
fn circles(obstacle: &ObstacleSection) -> [Curve; 2] {
    let circle = |radius_m: f64| {
        let corners = circle::polygon(obstacle.position_m.into(), radius_m, circle::CORNERS);
        let mut outline: Vec<_> = corners.map(|corner| Some((corner.x, corner.y))).collect();
        // The first corner again closes the circle.
        outline.extend(outline.first().copied());
        outline
    };
    let line =
        |name: &str, stroke, radius_m| Curve { name: name.into(), stroke, ..path(ALARM, circle(radius_m)) };
    [
        line("obstacle", Stroke::Filled, obstacle.radius_m),
        line("braking distance", Stroke::Dashed, obstacle.braking_distance_m),
    ]
}
