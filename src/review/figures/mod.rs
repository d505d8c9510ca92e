//! All figures of a flight: those of the paper, and those of ringwing.
//!
//! Never measures anything: every value comes from the columns of the flight.

mod bands;
mod latency;
mod map;
mod obstacle;
mod over_time;
mod timeline;

use super::{
    flight::{Column, LoggedFlight},
    table::Table,
};
use over_time::OverTime;
use ringwing_drawing::{
    BLACK, RGBColor,
    chart::{Chart, Curve, Stroke},
};
use ringwing_recorder::{metrics::OFF_COURSE_M, show::palette};
use ringwing_scenario::Law;

/// Largest swarm whose UAVs have a line each. Larger swarms are drawn by their extremes and their mean, because more
/// lines can no longer be told apart.
const DRAWN_UAVS: usize = 12;
/// Points of all lines of a figure together. More make the page slow to open; fewer flatten short peaks.
const DETAIL: usize = 12_000;
/// Fewest and most points of one line. A smaller minimum draws the lines of large swarms with corners; a larger
/// maximum only makes the page slower to open.
const LINE_DETAIL: (usize, usize) = (150, 2000);
const GREY: RGBColor = RGBColor(0x77, 0x77, 0x77);
// Green, as in Fig. 3 of the paper.
const LEADER: RGBColor = RGBColor(0x00, 0x80, 0x00);
/// The wind: a blue that none of the first UAVs has on white paper.
const WIND: RGBColor = RGBColor(0x1f, 0x5f, 0xbf);
pub(super) const ALARM: RGBColor = RGBColor(0xd5, 0x5e, 0x00);
const TIME: &str = "time, s";
/// The scenarios of the paper's simulations.
const PAPERS: [&str; 2] = ["paper-4.1", "paper-4.2"];

/// A figure that is not drawn yet.
pub(super) struct FlightFigure {
    /// Name of its files, without their extension.
    pub(super) name: String,
    pub(super) title: String,
    pub(super) caption: String,
    pub(super) chart: Chart,
    pub(super) table: Table,
    /// Whether the horizontal axis is the time of the flight.
    pub(super) is_over_time: bool,
}

/// All figures of a flight, without those that the log holds no data for.
pub(super) fn all(flight: &LoggedFlight) -> Vec<FlightFigure> {
    // What people look for first: where everybody flew, what happened, and how far the formation was from its slots.
    let mut figures = vec![map::trajectories(flight)];
    figures.extend(timeline::figure(flight));
    figures.push(slot_errors(flight));
    figures.extend(flight.summary.deviation.as_ref().map(|_| deviations(flight)));
    figures.extend(distances(flight));
    figures.extend(speeds(flight));
    if !flight.scenario.wind.is_still() {
        figures.extend(wind(flight));
    }
    // Where agents know exactly where their UAVs are, there is nothing to draw.
    let measured = flight.summary.flight.as_ref().and_then(|flown| flown.estimate_error_rms_m);
    figures.extend(measured.map(|_| estimate_errors(flight)));
    // Drawn circles have none of their own: there may be dozens.
    for (number, obstacle) in (1..).zip(&flight.scenario.obstacles) {
        figures.extend(obstacle::figures(flight, number, obstacle));
    }
    figures.extend([closest_pairs(flight), ages(flight), lyapunov(flight)]);
    figures.extend(latency::figures(flight));
    figures
}

/// ` (Fig. 3)`, if the flight is one of the paper's; otherwise its figure shows something else.
fn paper(flight: &LoggedFlight, figure: &str) -> String {
    let is_papers =
        flight.scenario.control.law == Law::Paper && PAPERS.contains(&flight.scenario.name.as_str());
    if is_papers { format!(" ({figure})") } else { String::new() }
}

/// The colour of the UAV with this index, from 0.
pub(super) fn colour(uav: usize) -> RGBColor {
    let palette::Rgb { red, green, blue } = palette::colour(uav as u32 + 1);
    RGBColor(red, green, blue)
}

/// The name of the UAV with this index, from 0.
fn name_of(uav: usize) -> String {
    format!("uav {}", uav + 1)
}

/// Points of each line in a figure of this many lines.
fn detail(lines: usize) -> usize {
    let (fewest, most) = LINE_DETAIL;
    (DETAIL / lines.max(1)).clamp(fewest, most)
}

/// Points of a line; a point needs both coordinates.
fn points(x: &[Option<f64>], y: &[Option<f64>]) -> Vec<Option<(f64, f64)>> {
    x.iter().zip(y).map(|(x, y)| Some(((*x)?, (*y)?))).collect()
}

/// A dashed line at `value` over the whole flight.
fn level(flight: &LoggedFlight, name: &str, value: f64) -> Curve {
    // Two points are enough for a straight line, and use none of the detail of the others.
    let ends = flight.times_s.first().zip(flight.times_s.last());
    let points = ends.map(|(first, last)| vec![Some((*first, value)), Some((*last, value))]);
    Curve { name: name.into(), colour: GREY, stroke: Stroke::Dashed, points: points.unwrap_or_default() }
}

fn distances(flight: &LoggedFlight) -> [FlightFigure; 2] {
    let neighbours =
        OverTime::of_uavs(flight, |uav| &uav.next_distance_m).reference("L", &flight.ring_spacing_m);
    let leader =
        OverTime::of_uavs(flight, |uav| &uav.leader_distance_m).reference("R", &flight.ring_radius_m);
    [
        neighbours.figure(
            "neighbour-distances",
            &format!("Distance to the next ring neighbour{}", paper(flight, "Fig. 4a")),
            "From each UAV to the next one in the ring. The distances should converge to those of the formation: to L in a ring.",
            "distance, m",
        ),
        leader.figure(
            "leader-distances",
            &format!("Distance to the leader{}", paper(flight, "Fig. 4b")),
            "Of the UAVs that fly on command. The distances should converge to those of the formation: to R in a ring.",
            "distance, m",
        ),
    ]
}

fn speeds(flight: &LoggedFlight) -> [FlightFigure; 2] {
    let limits = &flight.scenario.airframe;
    // The two levels of each figure have one name, so that they share a row of the legend.
    let linear = OverTime::of_uavs(flight, |uav| &uav.speed_m_s)
        .level("v_min, v_max", limits.speed_min_m_s)
        .level("v_min, v_max", limits.speed_max_m_s);
    let angular = OverTime::of_uavs(flight, |uav| &uav.turn_rate_rad_s)
        .level("omega_max", limits.turn_rate_max_rad_s)
        .level("omega_max", -limits.turn_rate_max_rad_s);
    [
        linear.figure(
            "speeds",
            &format!("Linear speeds{}", paper(flight, "Fig. 5a")),
            "As flown, with the limits of Eq. (2).",
            "speed, m/s",
        ),
        angular.figure(
            "turn-rates",
            &format!("Angular speeds{}", paper(flight, "Fig. 5b")),
            "As flown, with the limits of Eq. (2).",
            "turn rate, rad/s",
        ),
    ]
}

fn wind(flight: &LoggedFlight) -> [FlightFigure; 2] {
    [
        OverTime::of_uavs(flight, |uav| &uav.wind_m_s)
            .level("mean", flight.scenario.wind.mean_speed_m_s)
            .figure("wind", "Wind", "The speed of the air at each UAV, gusts included.", "wind, m/s"),
        OverTime::of_uavs(flight, |uav| &uav.wind_error_m_s).figure(
            "wind-errors",
            "Error of the wind that agents know",
            "How far the wind that each agent is told or estimates is from that at its UAV, as a difference of velocities.",
            "error, m/s",
        ),
    ]
    .map(FlightFigure::on_axis_from_zero)
}

fn estimate_errors(flight: &LoggedFlight) -> FlightFigure {
    OverTime::of_uavs(flight, |uav| &uav.estimate_error_m)
        .figure(
            "estimate-errors",
            "Own-position error",
            "How far each UAV is from where its agent believes that it is, because of its sensors or of late data.",
            "error, m",
        )
        .on_axis_from_zero()
}

fn slot_errors(flight: &LoggedFlight) -> FlightFigure {
    OverTime::of_uavs(flight, |uav| &uav.slot_error_m)
        .figure(
            "slot-errors",
            "Distance from the slot",
            "On a logarithmic axis. The formation has settled when every error is below 1 m.",
            "slot error, m",
        )
        .on_log_axis()
}

fn deviations(flight: &LoggedFlight) -> FlightFigure {
    OverTime::of_uavs(flight, |uav| &uav.deviation_m)
        .level("off course", OFF_COURSE_M)
        .figure(
            "deviations",
            "Deviation from the flight without faults",
            "From where each UAV would be without the faults, while it flies on command.",
            "deviation, m",
        )
        .on_axis_from_zero()
}

fn lyapunov(flight: &LoggedFlight) -> FlightFigure {
    OverTime::of(flight, &[("V", BLACK, &flight.lyapunov_m2)])
        .figure(
            "lyapunov",
            "Lyapunov value, Eq. (7)",
            "On a logarithmic axis. It falls while no UAV is saturated or repelled.",
            "V, m^2",
        )
        .on_log_axis()
}

fn closest_pairs(flight: &LoggedFlight) -> FlightFigure {
    let columns = [
        ("ring neighbours", colour(0), &flight.closest_adjacent_m),
        ("all others", colour(4), &flight.closest_other_m),
    ];
    OverTime::of(flight, &columns).level("collision", flight.scenario.airframe.collision_distance_m).figure(
        "closest-pair",
        "Closest pairs",
        "The closest two ring neighbours, and the closest two UAVs that are not ring neighbours.",
        "distance, m",
    )
}

fn ages(flight: &LoggedFlight) -> FlightFigure {
    let figure = OverTime::of_uavs(flight, |uav| &uav.age_s).figure(
        "ages",
        "Age of the data used",
        "The oldest data that each agent used of its two neighbours and the leader.",
        "age, s",
    );
    figure.on_axis_from_zero()
}

/// The times of the flight as a column.
fn times(flight: &LoggedFlight) -> Column {
    flight.times_s.iter().copied().map(Some).collect()
}
