//! The paper's figures of a flight, and ours.

use super::{
    flight::{Column, Flight, Track},
    table::Table,
};
use ringwing_drawing::{
    RGBColor,
    chart::{Chart, Curve, Stroke},
    scale::Scale,
};
use ringwing_recorder::palette;
use ringwing_scenario::Obstacle;

/// Larger swarms are drawn by their extremes and their mean.
const DRAWN_UAVS: usize = 12;
/// Points of all lines of a figure.
const DETAIL: usize = 12_000;
const BLACK: RGBColor = RGBColor(0, 0, 0);
const GREY: RGBColor = RGBColor(0x77, 0x77, 0x77);
const LEADER: RGBColor = RGBColor(0x00, 0x80, 0x00);
const ALARM: RGBColor = RGBColor(0xd5, 0x5e, 0x00);
const TIME: &str = "time, s";
/// What is smaller is drawn as this where the axis is logarithmic.
const FLOOR: f64 = 1e-9;

/// A figure, not drawn yet.
pub(super) struct Figure {
    /// Names its files.
    pub(super) name: String,
    pub(super) title: String,
    pub(super) text: String,
    pub(super) chart: Chart,
    pub(super) table: Table,
}

/// All figures of a flight; what the log holds nothing for is left out.
pub(super) fn all(flight: &Flight) -> Vec<Figure> {
    let mut figures = vec![trajectories(flight)];
    figures.extend(distances(flight));
    figures.extend(speeds(flight));
    for (number, obstacle) in (1..).zip(&flight.scenario.obstacles) {
        figures.extend(obstacle_figures(flight, number, obstacle));
    }
    figures.extend([slot_errors(flight), lyapunov(flight), closest(flight), ages(flight)]);
    figures.extend(latency(flight));
    figures.extend(timeline(flight));
    figures
}

fn colour(uav: usize) -> RGBColor {
    let palette::Rgb { red, green, blue } = palette::colour(uav as u32 + 1);
    RGBColor(red, green, blue)
}

fn name_of(uav: usize) -> String {
    format!("uav {}", uav + 1)
}

fn detail(lines: usize) -> usize {
    (DETAIL / lines.max(1)).clamp(150, 2000)
}

fn pairs(x: &[Option<f64>], y: &[Option<f64>]) -> Vec<Option<(f64, f64)>> {
    x.iter().zip(y).map(|(x, y)| Some(((*x)?, (*y)?))).collect()
}

fn level(flight: &Flight, name: &str, value: f64) -> Curve {
    let ends = flight.times_s.first().zip(flight.times_s.last());
    let points = ends.map(|(first, last)| vec![Some((*first, value)), Some((*last, value))]);
    Curve { name: name.into(), colour: GREY, stroke: Stroke::Dashed, points: points.unwrap_or_default() }
}

/// A figure over time, its data a column for each line.
struct OverTime<'f> {
    flight: &'f Flight,
    columns: Vec<(String, RGBColor, Column)>,
    levels: Vec<Curve>,
}

impl<'f> OverTime<'f> {
    /// Of a quantity of each UAV, or of its extremes if they are many.
    fn of_uavs(flight: &'f Flight, get: fn(&Track) -> &Column) -> Self {
        let columns = if flight.uavs.len() <= DRAWN_UAVS {
            let each = flight.uavs.iter().enumerate();
            each.map(|(uav, track)| (name_of(uav), colour(uav), get(track).clone())).collect()
        } else {
            extremes(flight, get)
        };
        Self { flight, columns, levels: Vec::new() }
    }

    fn of(flight: &'f Flight, columns: &[(&str, RGBColor, &Column)]) -> Self {
        let columns =
            columns.iter().map(|(name, colour, column)| ((*name).into(), *colour, (*column).clone()));
        Self { flight, columns: columns.collect(), levels: Vec::new() }
    }

    fn level(mut self, name: &str, value: f64) -> Self {
        self.levels.push(level(self.flight, name, value));
        self
    }

    fn figure(self, name: &str, title: &str, text: &str, y: &'static str) -> Figure {
        let times: Column = self.flight.times_s.iter().copied().map(Some).collect();
        let line = |(name, colour, column): &(String, RGBColor, Column)| Curve {
            name: name.clone(),
            colour: *colour,
            stroke: Stroke::Solid,
            points: pairs(&times, column),
        };
        let lines: Vec<Curve> = self.columns.iter().map(line).chain(self.levels.clone()).collect();
        let chart = Chart { x: TIME, y, detail: detail(self.columns.len()), lines, ..Chart::default() };
        let table = Table::new(&times, self.columns.into_iter().map(|(name, _, column)| (name, column)));
        Figure { name: name.into(), title: title.into(), text: text.into(), chart, table }
    }
}

/// The largest, the mean and the smallest of all UAVs.
fn extremes(flight: &Flight, get: fn(&Track) -> &Column) -> Vec<(String, RGBColor, Column)> {
    let of = |tick: usize| flight.uavs.iter().filter_map(move |track| *get(track).get(tick)?);
    let ticks = || 0..flight.times_s.len();
    let mean = |tick| {
        let (count, sum) = of(tick).fold((0_u32, 0.0), |(count, sum), value| (count + 1, sum + value));
        (count > 0).then(|| sum / f64::from(count))
    };
    vec![
        ("largest".into(), colour(5), ticks().map(|tick| of(tick).reduce(f64::max)).collect()),
        ("mean".into(), BLACK, ticks().map(mean).collect()),
        ("smallest".into(), colour(1), ticks().map(|tick| of(tick).reduce(f64::min)).collect()),
    ]
}

fn trajectories(flight: &Flight) -> Figure {
    let few = flight.uavs.len() <= DRAWN_UAVS;
    let mut lines: Vec<Curve> = flight.scenario.obstacles.iter().flat_map(circles).collect();
    lines.extend(flight.uavs.iter().enumerate().map(|(uav, track)| Curve {
        name: if few { name_of(uav) } else { String::new() },
        ..path(colour(uav), pairs(&track.x_m, &track.y_m))
    }));
    let led = pairs(&flight.leader_x_m, &flight.leader_y_m).into_iter().flatten().map(Some).collect();
    lines.push(Curve { name: "leader".into(), stroke: Stroke::Dashed, ..path(LEADER, led) });
    for (share, name) in [(0.0, "ring, start and"), (0.5, "halfway, end"), (1.0, "halfway, end")] {
        lines.push(Curve { name: name.into(), ..path(GREY, ring(flight, share)) });
    }
    let times: Column = flight.times_s.iter().copied().map(Some).collect();
    let columns = flight.uavs.iter().enumerate().flat_map(|(uav, track)| {
        [
            (format!("uav {} x_m", uav + 1), track.x_m.clone()),
            (format!("uav {} y_m", uav + 1), track.y_m.clone()),
        ]
    });
    let leader = [("leader x_m", &flight.leader_x_m), ("leader y_m", &flight.leader_y_m)];
    let leader = leader.map(|(name, column)| (name.to_owned(), column.clone()));
    Figure {
        name: "trajectories".into(),
        title: "Trajectories (the paper's Fig. 3 and 6)".into(),
        text: "Grey: the ring at the start, halfway and at the end.".into(),
        table: Table::new(&times, columns.chain(leader)),
        chart: Chart {
            x: "x (east), m",
            y: "y (north), m",
            is_map: true,
            detail: detail(flight.uavs.len()),
            lines,
            ..Chart::default()
        },
    }
}

fn path(colour: RGBColor, points: Vec<Option<(f64, f64)>>) -> Curve {
    Curve { name: String::new(), colour, stroke: Stroke::Solid, points }
}

/// The polygon of ring neighbours at a share of the flight.
fn ring(flight: &Flight, share: f64) -> Vec<Option<(f64, f64)>> {
    let tick = (share * flight.times_s.len().saturating_sub(1) as f64) as usize;
    let place = |track: &Track| Some(((*track.x_m.get(tick)?)?, (*track.y_m.get(tick)?)?));
    let mut ring: Vec<_> = flight.uavs.iter().filter_map(place).map(Some).collect();
    ring.extend(ring.first().copied());
    ring
}

fn circles(obstacle: &Obstacle) -> [Curve; 2] {
    let round = |radius_m: f64| {
        let at = |step: i32| {
            let (sin, cos) = (f64::from(step) / 36.0 * std::f64::consts::PI).sin_cos();
            Some((obstacle.position_m[0] + radius_m * cos, obstacle.position_m[1] + radius_m * sin))
        };
        (0..=72).map(at).collect()
    };
    let line =
        |name: &str, stroke, radius_m| Curve { name: name.into(), stroke, ..path(ALARM, round(radius_m)) };
    [
        line("obstacle", Stroke::Filled, obstacle.radius_m),
        line("braking distance", Stroke::Dashed, obstacle.braking_distance_m),
    ]
}

fn distances(flight: &Flight) -> [Figure; 2] {
    let formation = flight.scenario.formation();
    let neighbours =
        OverTime::of_uavs(flight, |track| &track.next_distance_m).level("L", formation.spacing_m());
    let leader = OverTime::of_uavs(flight, |track| &track.leader_distance_m).level("R", formation.radius_m());
    [
        neighbours.figure(
            "neighbour-distances",
            "Distance to the next ring neighbour (Fig. 4a)",
            "Each UAV to the one after it; they should come to L.",
            "distance, m",
        ),
        leader.figure(
            "leader-distances",
            "Distance to the leader (Fig. 4b)",
            "They should come to R.",
            "distance, m",
        ),
    ]
}

fn speeds(flight: &Flight) -> [Figure; 2] {
    let limits = &flight.scenario.airframe;
    let linear = OverTime::of_uavs(flight, |track| &track.speed_m_s)
        .level("v_min, v_max", limits.speed_min_m_s)
        .level("v_min, v_max", limits.speed_max_m_s);
    let angular = OverTime::of_uavs(flight, |track| &track.turn_rate_rad_s)
        .level("omega_max", limits.turn_rate_max_rad_s)
        .level("omega_max", -limits.turn_rate_max_rad_s);
    [
        linear.figure(
            "speeds",
            "Linear speeds (Fig. 5a)",
            "As flown, with the limits of Eq. (2).",
            "speed, m/s",
        ),
        angular.figure(
            "turn-rates",
            "Angular speeds (Fig. 5b)",
            "As flown, with the limits of Eq. (2).",
            "turn rate, rad/s",
        ),
    ]
}

/// The UAVs that an obstacle repelled, with their distances from its centre.
fn repelled(flight: &Flight, obstacle: &Obstacle) -> Vec<(usize, Column)> {
    let [x, y] = obstacle.position_m;
    let distance = |track: &Track| -> Column {
        let places = pairs(&track.x_m, &track.y_m).into_iter();
        places.map(|place| place.map(|(east, north)| (east - x).hypot(north - y))).collect()
    };
    let mut near: Vec<(usize, f64, Column)> = Vec::new();
    for (uav, track) in flight.uavs.iter().enumerate() {
        let column = distance(track);
        let closest = column.iter().flatten().copied().fold(f64::INFINITY, f64::min);
        if closest < obstacle.braking_distance_m {
            near.push((uav, closest, column));
        }
    }
    near.sort_by(|a, b| a.1.total_cmp(&b.1));
    near.truncate(DRAWN_UAVS);
    near.sort_by_key(|(uav, ..)| *uav);
    near.into_iter().map(|(uav, _, column)| (uav, column)).collect()
}

fn obstacle_figures(flight: &Flight, number: usize, obstacle: &Obstacle) -> Vec<Figure> {
    let near = repelled(flight, obstacle);
    let mut figures = vec![close_up(flight, number, obstacle)];
    if near.is_empty() {
        return figures;
    }
    let distances = near.iter().map(|(uav, column)| (name_of(*uav), colour(*uav), column.clone()));
    let repulsions = near.iter().map(|(uav, distances)| {
        let within = |distance: &Option<f64>| distance.is_some_and(|it| it < obstacle.braking_distance_m);
        let repulsion = flight.uavs[*uav].repulsion_m.iter().zip(distances);
        let column = repulsion.map(|(force, distance)| force.filter(|_| within(distance))).collect();
        (name_of(*uav), colour(*uav), column)
    });
    let over_time = |columns| OverTime { flight, columns, levels: Vec::new() };
    let (name, window) = (&obstacle.name, window(flight, obstacle, &near));
    let mut distance = over_time(distances.collect())
        .level("R_obs", obstacle.radius_m)
        .level("L_obs", obstacle.braking_distance_m)
        .figure(
            &format!("obstacle-{number}-distance"),
            &format!("Distance to {name} (Fig. 7b and 8b)"),
            "From its centre, of the UAVs that it repelled, while they were near.",
            "distance, m",
        );
    let mut repulsion = over_time(repulsions.collect()).figure(
        &format!("obstacle-{number}-repulsion"),
        &format!("Repulsion by {name} (Fig. 7b and 8b)"),
        "The length of f_obs, Eq. (13), within the braking distance.",
        "repulsion, m",
    );
    for figure in [&mut distance, &mut repulsion] {
        clip(&mut figure.chart, |(time, _)| window.contains(&time));
    }
    figures.extend([distance, repulsion]);
    figures
}

/// When somebody was within the braking distance, and two seconds more on both sides.
fn window(flight: &Flight, obstacle: &Obstacle, near: &[(usize, Column)]) -> std::ops::RangeInclusive<f64> {
    let is_near = |tick: &usize| {
        let close = |column: &Column| column[*tick].is_some_and(|it| it < obstacle.braking_distance_m);
        near.iter().any(|(_, column)| close(column))
    };
    let first = (0..flight.times_s.len()).find(is_near).unwrap_or_default();
    let last = (0..flight.times_s.len()).rfind(is_near).unwrap_or_default();
    flight.times_s[first] - 2.0..=flight.times_s[last] + 2.0
}

/// Leaves out what is not shown; dashed levels are cut to the rest.
fn clip(chart: &mut Chart, is_shown: impl Fn((f64, f64)) -> bool) {
    for line in chart.lines.iter_mut().filter(|line| line.stroke == Stroke::Solid) {
        for point in &mut line.points {
            *point = point.filter(|point| is_shown(*point));
        }
        // A break is a break, however long: what is left is thinned by what there is to see.
        line.points.dedup_by(|one, other| one.is_none() && other.is_none());
    }
    let solid = chart.lines.iter().filter(|line| line.stroke == Stroke::Solid);
    let times = || solid.clone().flat_map(|line| line.points.iter().flatten().map(|(x, _)| *x));
    let (first, last) = (times().fold(f64::INFINITY, f64::min), times().fold(f64::NEG_INFINITY, f64::max));
    for line in chart.lines.iter_mut().filter(|line| line.stroke == Stroke::Dashed && line.points.len() == 2)
    {
        for (point, end) in line.points.iter_mut().zip([first, last]) {
            *point = point.map(|(_, y)| (end, y)).filter(|_| end.is_finite());
        }
    }
}

fn close_up(flight: &Flight, number: usize, obstacle: &Obstacle) -> Figure {
    let [x, y] = obstacle.position_m;
    let reach = 2.5 * obstacle.braking_distance_m;
    let mut figure = trajectories(flight);
    clip(&mut figure.chart, |(east, north)| {
        (east - x).abs() <= 1.6 * reach && (north - y).abs() <= 0.8 * reach
    });
    figure.chart.lines.retain(|line| {
        let is_here =
            |point: &(f64, f64)| (point.0 - x).abs() <= 1.6 * reach && (point.1 - y).abs() <= 0.8 * reach;
        line.points.iter().flatten().any(is_here) && line.colour != GREY && line.colour != LEADER
    });
    Figure {
        name: format!("obstacle-{number}"),
        title: format!("{} (Fig. 7a and 8a)", obstacle.name),
        text: "The trajectories near it.".into(),
        ..figure
    }
}

/// The same figure with a logarithmic axis; its table keeps the values.
fn on_log_axis(mut figure: Figure) -> Figure {
    figure.chart.y_scale = Scale::Powers;
    for line in &mut figure.chart.lines {
        for point in line.points.iter_mut().flatten() {
            point.1 = point.1.max(FLOOR).log10();
        }
    }
    figure
}

fn slot_errors(flight: &Flight) -> Figure {
    on_log_axis(OverTime::of_uavs(flight, |track| &track.slot_error_m).figure(
        "slot-errors",
        "Distance from the slot",
        "On a logarithmic axis; the formation stands when all are within 1 m.",
        "slot error, m",
    ))
}

fn lyapunov(flight: &Flight) -> Figure {
    on_log_axis(OverTime::of(flight, &[("V", BLACK, &flight.lyapunov_m2)]).figure(
        "lyapunov",
        "Lyapunov value, Eq. (7)",
        "On a logarithmic axis. It falls wherever nobody is saturated or repelled.",
        "V, m^2",
    ))
}

fn closest(flight: &Flight) -> Figure {
    let columns = [
        ("ring neighbours", colour(0), &flight.closest_adjacent_m),
        ("all others", colour(4), &flight.closest_other_m),
    ];
    OverTime::of(flight, &columns).level("collision", flight.scenario.airframe.collision_distance_m).figure(
        "closest-pair",
        "Closest pair",
        "The closest two ring neighbours, and the closest two that are none.",
        "distance, m",
    )
}

fn ages(flight: &Flight) -> Figure {
    OverTime::of_uavs(flight, |track| &track.age_s).figure(
        "ages",
        "Age of the data flown on",
        "The oldest of what each agent had of its two neighbours and of the leader.",
        "age, s",
    )
}

fn latency(flight: &Flight) -> Option<Figure> {
    flight.round_trip_us.iter().flatten().next()?;
    let figure = OverTime::of(flight, &[("round trip", BLACK, &flight.round_trip_us)]).figure(
        "latency",
        "Latency of a tick",
        "From the opening of the tick to the last answer, by the wall clock, on a logarithmic axis.",
        "latency, us",
    );
    Some(on_log_axis(figure))
}

fn timeline(flight: &Flight) -> Option<Figure> {
    let mut kinds: Vec<&str> = flight.happenings.iter().map(|one| one.name.as_str()).collect();
    kinds.sort_unstable();
    kinds.dedup();
    let row = |name: &str| kinds.len() - kinds.partition_point(|kind| *kind < name);
    let line = |kind: &&str| {
        let here = flight.happenings.iter().filter(|one| one.name == **kind);
        let mark = |time_s: f64, row: f64| [Some((time_s, row - 0.35)), Some((time_s, row + 0.35)), None];
        let points = here.flat_map(|one| mark(one.time_s, row(kind) as f64)).collect();
        Curve { name: (*kind).into(), colour: colour(kinds.len() - row(kind)), stroke: Stroke::Solid, points }
    };
    let mut lines: Vec<Curve> = kinds.iter().map(line).collect();
    lines.push(Curve { name: String::new(), ..level(flight, "", 0.3) });
    let chart = Chart { x: TIME, y: "events", is_rows: true, detail: DETAIL, lines, ..Chart::default() };
    (!kinds.is_empty()).then(|| Figure {
        name: "events".into(),
        title: "What happened".into(),
        text: "Each line of /log, by its kind.".into(),
        chart,
        table: Table::of_happenings(&flight.happenings),
    })
}
