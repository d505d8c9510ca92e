//! Figures over time: a line for each column, and dashed levels.

use super::{
    BLACK, DRAWN_UAVS, FlightFigure, GREY, TIME, bands::bands, colour, detail, level, name_of, points, times,
};
use crate::review::{
    flight::{Column, LoggedFlight, UavColumns},
    table::Table,
};
use ringwing_drawing::{
    RGBColor,
    chart::{Chart, Curve, Stroke},
    scale::Scale,
};

/// Smallest value on a logarithmic axis, in the unit of the axis; smaller values, 0 included, are drawn here. A larger
/// floor hides how far errors fall, a smaller one stretches the axis over errors that nobody can measure.
const FLOOR: f64 = 1e-3;

/// A figure over time under construction.
pub(super) struct OverTime<'f> {
    flight: &'f LoggedFlight,
    columns: Vec<(String, RGBColor, Column)>,
    levels: Vec<Curve>,
}

impl<'f> OverTime<'f> {
    /// Shows one quantity of every UAV, or its extremes and mean if there are many UAVs.
    pub(super) fn of_uavs(flight: &'f LoggedFlight, get: fn(&UavColumns) -> &Column) -> Self {
        let columns = if flight.uavs.len() <= DRAWN_UAVS {
            let each = flight.uavs.iter().enumerate();
            each.map(|(uav, columns)| (name_of(uav), colour(uav), get(columns).clone())).collect()
        } else {
            extremes(flight, get)
        };
        Self::of_columns(flight, columns)
    }

    /// Shows quantities of the swarm.
    pub(super) fn of(flight: &'f LoggedFlight, columns: &[(&str, RGBColor, &Column)]) -> Self {
        let columns =
            columns.iter().map(|(name, colour, column)| ((*name).into(), *colour, (*column).clone()));
        Self::of_columns(flight, columns.collect())
    }

    /// Shows columns with their names and colours.
    pub(super) fn of_columns(flight: &'f LoggedFlight, columns: Vec<(String, RGBColor, Column)>) -> Self {
        Self { flight, columns, levels: Vec::new() }
    }

    /// Adds a dashed level.
    pub(super) fn level(mut self, name: &str, value: f64) -> Self {
        self.levels.push(level(self.flight, name, value));
        self
    }

    /// Adds a dashed line for a value that the others should reach and that changes with the ring. Where it never exists,
    /// as in most shapes, there is no line.
    pub(super) fn reference(mut self, name: &str, column: &Column) -> Self {
        if column.iter().any(Option::is_some) {
            let points = points(&times(self.flight), column);
            self.levels.push(Curve { name: name.into(), colour: GREY, stroke: Stroke::Dashed, points });
        }
        self
    }

    /// Completes the figure; `y` names the quantity and its unit.
    pub(super) fn figure(self, name: &str, title: &str, caption: &str, y: &'static str) -> FlightFigure {
        let times = times(self.flight);
        let line = |(name, colour, column): &(String, RGBColor, Column)| Curve {
            name: name.clone(),
            colour: *colour,
            stroke: Stroke::Solid,
            points: points(&times, column),
        };
        let lines: Vec<Curve> = self.columns.iter().map(line).chain(self.levels.clone()).collect();
        // A level has two points, so only the columns share the detail.
        let detail = detail(self.columns.len());
        let chart = Chart { x: TIME, y, detail, lines, bands: bands(self.flight), ..Chart::default() };
        let table = Table::new(&times, self.columns.into_iter().map(|(name, _, column)| (name, column)));
        FlightFigure {
            name: name.into(),
            title: title.into(),
            caption: caption.into(),
            chart,
            table,
            is_over_time: true,
        }
    }
}

impl FlightFigure {
    /// The same figure with an axis from 0 on.
    pub(super) fn on_axis_from_zero(mut self) -> Self {
        self.chart.from_zero = true;
        self
    }

    /// The same figure with a logarithmic axis; its table keeps the values.
    pub(super) fn on_log_axis(mut self) -> Self {
        self.chart.y_scale = Scale::Powers;
        for line in &mut self.chart.lines {
            for point in line.points.iter_mut().flatten() {
                point.1 = point.1.max(FLOOR).log10();
            }
        }
        self
    }
}

/// Columns with the largest value, the mean and the smallest value of all UAVs.
fn extremes(flight: &LoggedFlight, get: fn(&UavColumns) -> &Column) -> Vec<(String, RGBColor, Column)> {
    // A UAV without a value in a tick does not count in that tick.
    let of = |tick: usize| flight.uavs.iter().filter_map(move |uav| *get(uav).get(tick)?);
    let ticks = || 0..flight.times_s.len();
    let mean = |tick| {
        let (count, sum) = of(tick).fold((0_u32, 0.0), |(count, sum), value| (count + 1, sum + value));
        // A tick without any value is a gap in the line. 0 / 0 would be NaN.
        (count > 0).then(|| sum / f64::from(count))
    };
    vec![
        ("largest".into(), colour(5), ticks().map(|tick| of(tick).reduce(f64::max)).collect()),
        ("mean".into(), BLACK, ticks().map(mean).collect()),
        ("smallest".into(), colour(1), ticks().map(|tick| of(tick).reduce(f64::min)).collect()),
    ]
}
