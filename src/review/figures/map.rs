//! The trajectories of the whole flight from above.

use super::{
    ALARM, DRAWN_UAVS, FlightFigure, GREY, LEADER, WIND, colour, detail, name_of, paper, points, times,
};
use crate::review::{
    flight::{Column, LoggedFlight, UavColumns},
    table::Table,
};
use ringwing_drawing::{
    RGBColor,
    chart::{Chart, Curve, Mark, Stroke, Symbol},
};
use ringwing_flight::{IntruderId, Route, RoutePoint, UavId};
use ringwing_recorder::show::{arrow, circle};
use ringwing_scenario::{IntruderSection, ObstacleSection};

/// Moments at which the formation is drawn, as shares of the flight. More cover each other and the trajectories; with fewer,
/// what is flown between them must be guessed.
const MOMENTS: [f64; 5] = [0.0, 0.25, 0.5, 0.75, 1.0];
/// Largest number of obstacles with their names. More names cover each other.
const NAMED_OBSTACLES: usize = 8;
/// Most collisions that are marked. More marks hide the trajectories; the table of events has all.
const MARKED_COLLISIONS: usize = 40;

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
        title: format!("Trajectories{}", paper(flight, "Fig. 3 and 6")),
        caption: caption(flight).into(),
        table: Table::new(&times(flight), columns.chain(leader)),
        is_over_time: false,
        chart: Chart {
            x: "x (east), m",
            y: "y (north), m",
            is_map: true,
            detail: detail(flight.uavs.len()),
            lines: lines(flight),
            marks: marks(flight),
            ..Chart::default()
        },
    }
}

fn caption(flight: &LoggedFlight) -> &'static str {
    if flight.uavs.len() <= DRAWN_UAVS {
        "Grey: the formation as it is flown, at five moments with their times. Arrows show headings, crosses collisions."
    } else {
        "Grey: the formation as it is flown, at five moments with their times, once everybody is near the slot. Crosses show \
         collisions."
    }
}

/// Obstacles, paths and formations, in the order of drawing.
fn lines(flight: &LoggedFlight) -> Vec<Curve> {
    // With many UAVs, names would fill the legend.
    let has_names = flight.uavs.len() <= DRAWN_UAVS;
    let obstacles = flight.scenario.all_obstacles();
    let mut lines: Vec<Curve> = obstacles.iter().flat_map(|obstacle| shapes(flight, obstacle)).collect();
    lines.extend((1..).zip(&flight.scenario.intruders).map(|(number, intruder)| Curve {
        name: IntruderId(number).to_string(),
        ..path(ALARM, way(flight, &intruder.route()))
    }));
    lines.extend(flight.uavs.iter().enumerate().map(|(uav, columns)| Curve {
        name: if has_names { name_of(uav) } else { String::new() },
        ..path(colour(uav), points(&columns.x_m, &columns.y_m))
    }));
    // The log holds the leader's position less often than the UAVs', so gaps between its points must not break the
    // line.
    let leader = points(&flight.leader_x_m, &flight.leader_y_m).into_iter().flatten().map(Some).collect();
    lines.push(Curve { name: "leader".into(), stroke: Stroke::Dashed, ..path(LEADER, leader) });
    let is_same = flight.scenario.manoeuvres.is_empty();
    let name = if is_same { flight.scenario.formation.shape.name() } else { "formation" };
    lines.extend(
        moments(flight).map(|tick| Curve { name: name.into(), ..path(GREY, formation(flight, tick)) }),
    );
    lines.extend(moments(flight).filter_map(|tick| wind(flight, tick)));
    lines
}

/// The arrow of the mean wind beside the formation at a tick; `None` without a mean wind or a leader.
fn wind(flight: &LoggedFlight, tick: usize) -> Option<Curve> {
    let mean_m_s = flight.scenario.wind.mean_m_s();
    // The log holds the leader's position less often than there are ticks.
    let known = |column: &Column| column.get(..=tick)?.iter().rev().flatten().next().copied();
    let centre = [known(&flight.leader_x_m)?, known(&flight.leader_y_m)?].into();
    (mean_m_s.norm() > 0.0).then(|| {
        let (spacing_m, reach_m) = (flight.scenario.formation.spacing_m, flight.scenario.reach_m());
        let places = arrow::of_wind(mean_m_s, centre, spacing_m, reach_m);
        let points = places.map(|place| Some((place.x, place.y)));
        Curve { name: "mean wind".into(), ..path(WIND, points.into()) }
    })
}

fn path(colour: RGBColor, points: Vec<Option<(f64, f64)>>) -> Curve {
    Curve { name: String::new(), colour, stroke: Stroke::Solid, points }
}

/// The indices of the ticks at which the formation is drawn.
fn moments(flight: &LoggedFlight) -> impl Iterator<Item = usize> {
    let last = flight.times_s.len().saturating_sub(1) as f64;
    MOMENTS.into_iter().map(move |share| (share * last) as usize)
}

/// The line through the UAVs that fly on command at a tick, in the order of their slots; closed where the shape goes round
/// its centre.
fn formation(flight: &LoggedFlight, tick: usize) -> Vec<Option<(f64, f64)>> {
    // Lines between dozens of UAVs that are still on their way to their slots would hide the trajectories.
    if flight.uavs.len() > DRAWN_UAVS && !is_formed(flight, tick) {
        return Vec::new();
    }
    let time_s = flight.times_s.get(tick).copied().unwrap_or_default();
    let ring = flight.scenario.ring_at(flight.scenario.tick_at(time_s));
    let in_order = ring.in_formation().map(|number| &flight.uavs[UavId(number).index()]);
    let members = in_order.filter(|uav| uav.commanded.get(tick) == Some(&true));
    let mut line: Vec<_> = members.filter_map(|uav| place(uav, tick)).map(Some).collect();
    if !ring.formation().shape().is_path() {
        line.extend(line.first().copied());
    }
    line
}

/// Whether every UAV that flies on command is nearer to its slot than the slots are to each other.
fn is_formed(flight: &LoggedFlight, tick: usize) -> bool {
    flight.uavs.iter().all(|uav| {
        let error_m = uav.slot_error_m.get(tick).copied().flatten();
        uav.commanded.get(tick) != Some(&true)
            || error_m.is_some_and(|error_m| error_m < flight.scenario.formation.spacing_m)
    })
}

fn place(uav: &UavColumns, tick: usize) -> Option<(f64, f64)> {
    Some(((*uav.x_m.get(tick)?)?, (*uav.y_m.get(tick)?)?))
}

fn marks(flight: &LoggedFlight) -> Vec<Mark> {
    let obstacles = flight.scenario.all_obstacles();
    // The names of a whole field would hide it.
    let named = if obstacles.len() <= NAMED_OBSTACLES { &*obstacles } else { &[] };
    let names = named.iter().map(|obstacle| {
        let [x, y] = obstacle.position_m;
        Mark { at: (x, y), text: obstacle.name.clone(), symbol: Symbol::Text, colour: ALARM }
    });
    let collisions = flight.events.iter().filter_map(|event| event.position_m).take(MARKED_COLLISIONS);
    let collisions = collisions.map(|[x, y]| Mark {
        at: (x, y),
        text: String::new(),
        symbol: Symbol::Cross,
        colour: ALARM,
    });
    let headings = moments(flight).flat_map(|tick| headings(flight, tick));
    names.chain(intruders(flight)).chain(headings).chain(collisions).collect()
}

/// An arrow at every intruder, at each of the moments.
fn intruders(flight: &LoggedFlight) -> Vec<Mark> {
    let times_s: Vec<f64> = moments(flight).filter_map(|tick| flight.times_s.get(tick).copied()).collect();
    let arrow = |point: RoutePoint| {
        let [x, y] = point.pose.position.into();
        let symbol = Symbol::Arrow(point.pose.heading_rad);
        Mark { at: (x, y), text: String::new(), symbol, colour: ALARM }
    };
    let routes = flight.scenario.intruders.iter().map(IntruderSection::route);
    routes
        .flat_map(|route| times_s.iter().map(|time_s| arrow(route.at(*time_s))).collect::<Vec<_>>())
        .collect()
}

/// An arrow at every UAV of a small swarm at a tick, and the time at the first one.
fn headings(flight: &LoggedFlight, tick: usize) -> Vec<Mark> {
    let mut time = flight.times_s.get(tick).map(|time_s| format!("{time_s:.0} s")).unwrap_or_default();
    let mut marks = Vec::new();
    for (uav, columns) in flight.uavs.iter().enumerate() {
        let heading = columns.heading_rad.get(tick).copied().flatten();
        let (Some(at), Some(heading)) = (place(columns, tick), heading) else { continue };
        let is_drawn = flight.uavs.len() <= DRAWN_UAVS;
        let symbol = if is_drawn { Symbol::Arrow(heading) } else { Symbol::Text };
        // The time is written once, at the first UAV that is in the sky.
        let text = std::mem::take(&mut time);
        if is_drawn || !text.is_empty() {
            let colour = if is_drawn { colour(uav) } else { GREY };
            marks.push(Mark { at, text, symbol, colour });
        }
    }
    marks
}

/// An obstacle, or if it moves, its way and where it is at the moments at which the ring is drawn.
fn shapes(flight: &LoggedFlight, obstacle: &ObstacleSection) -> Vec<Curve> {
    let route = obstacle.route();
    if !obstacle.moves() {
        return circles(obstacle, obstacle.position_m).into();
    }
    let name = "way of an obstacle".into();
    let line = Curve { name, stroke: Stroke::Dashed, ..path(ALARM, way(flight, &route)) };
    let times_s = moments(flight).filter_map(|tick| flight.times_s.get(tick));
    let bodies = times_s.flat_map(|time_s| circles(obstacle, route.at(*time_s).pose.position.into()));
    bodies.chain([line]).collect()
}

/// Where something is that moves by itself, over the flight.
fn way(flight: &LoggedFlight, route: &Route) -> Vec<Option<(f64, f64)>> {
    let place = |time_s: &f64| {
        let [x, y] = route.at(*time_s).pose.position.into();
        Some((x, y))
    };
    flight.times_s.iter().map(place).collect()
}

/// An obstacle's body with its centre there, and the circle within which it repels.
fn circles(obstacle: &ObstacleSection, centre_m: [f64; 2]) -> [Curve; 2] {
    let circle = |radius_m: f64| {
        let corners = circle::polygon(centre_m.into(), radius_m, circle::CORNERS);
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
