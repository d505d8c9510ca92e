//! How long ticks took by the wall clock: how often, and when.

use super::{BLACK, FlightFigure, LEADER, colour, over_time::OverTime};
use crate::review::{
    flight::{Column, LoggedFlight},
    table::Table,
};
use ringwing_drawing::{
    RGBColor,
    chart::{Chart, Curve, Stroke},
    scale::Scale,
};

/// Points of the distribution. More are closer together than pixels.
const DISTRIBUTION_POINTS: usize = 400;

/// The figures of the latency, if the log holds wall-clock times.
pub(super) fn figures(flight: &LoggedFlight) -> Vec<FlightFigure> {
    let mut sorted: Vec<f64> =
        flight.round_trip_us.iter().flatten().copied().filter(|us| *us > 0.0).collect();
    if sorted.is_empty() {
        return Vec::new();
    }
    sorted.sort_by(f64::total_cmp);
    vec![distribution(&sorted), seconds(flight)]
}

/// The latency that a share of the ticks does not exceed. The axis stretches the largest shares, because these matter.
fn distribution(sorted_us: &[f64]) -> FlightFigure {
    let count = sorted_us.len() as f64;
    // Half a rank less than the whole: the slowest tick would otherwise be infinitely far along the axis.
    let nines = |rank: usize| -(1.0 - (rank as f64 + 0.5) / count).log10();
    // At equal distances along the axis, so that the few slowest ticks are all there.
    let step = nines(sorted_us.len() - 1) / DISTRIBUTION_POINTS as f64;
    let mut points: Vec<Option<(f64, f64)>> = Vec::new();
    let (mut shares, mut latencies): (Column, Column) = (Vec::new(), Vec::new());
    let mut next = 0.0;
    for (rank, us) in sorted_us.iter().enumerate() {
        if nines(rank) >= next || rank + 1 == sorted_us.len() {
            points.push(Some((nines(rank), us.log10())));
            shares.push(Some((rank as f64 + 0.5) / count));
            latencies.push(Some(*us));
            next = nines(rank) + step;
        }
    }
    let line = Curve { name: "round trip".into(), colour: LEADER, stroke: Stroke::Solid, points };
    FlightFigure {
        name: "latency-distribution".into(),
        title: "Latency of a tick: how often".into(),
        caption: "The share of ticks that took at most this long, from opening the tick to the last answer."
            .into(),
        chart: Chart {
            x: "share of ticks",
            y: "latency, us",
            x_scale: Scale::Shares,
            y_scale: Scale::Log,
            detail: DISTRIBUTION_POINTS,
            lines: vec![line],
            ..Chart::default()
        },
        table: Table::with("share", &shares, [("latency_us".to_owned(), latencies)].into_iter()),
        is_over_time: false,
    }
}

/// The median, the 99th percentile and the maximum of each second.
fn seconds(flight: &LoggedFlight) -> FlightFigure {
    let rate = flight.scenario.time.rate_hz as usize;
    let mut columns: [Column; 3] = Default::default();
    for second in flight.round_trip_us.chunks(rate.max(1)) {
        let mut sorted: Vec<f64> = second.iter().flatten().copied().filter(|us| *us > 0.0).collect();
        sorted.sort_by(f64::total_cmp);
        // The smallest latency that at least this share of the ticks does not exceed.
        let at = |share: f64| sorted.get(((sorted.len() as f64 * share).ceil() as usize).saturating_sub(1));
        for (column, share) in columns.iter_mut().zip([0.5, 0.99, 1.0]) {
            // One value for the whole second keeps the column as long as the others.
            column.extend(std::iter::repeat_n(at(share).copied(), second.len()));
        }
    }
    let [median, p99, max] = &columns;
    let lines: [(&str, RGBColor, &Column); 3] =
        [("p50", LEADER, median), ("p99", colour(0), p99), ("max", BLACK, max)];
    let figure = OverTime::of(flight, &lines).figure(
        "latency",
        "Latency of a tick: when",
        "Of the ticks of each second: median, 99th percentile and maximum, on a logarithmic axis.",
        "latency, us",
    );
    figure.on_log_axis()
}
