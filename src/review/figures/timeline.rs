//! The events of the flight over time, one row for each kind.

use super::{DETAIL, FlightFigure, TIME, colour, level};
use crate::review::{flight::LoggedFlight, table::Table};
use ringwing_drawing::chart::{Chart, Curve, Stroke};

/// Half the height of an event's mark, in rows. At half a row or more, marks of neighbouring rows touch.
const HALF_MARK: f64 = 0.35;
/// Height of the baseline, which gives a timeline of a single event the length of the flight.
const BASELINE: f64 = 0.3;

/// The timeline, if the log has any event.
pub(super) fn figure(flight: &LoggedFlight) -> Option<FlightFigure> {
    let mut kinds: Vec<&str> = flight.events.iter().map(|event| event.name.as_str()).collect();
    kinds.sort_unstable();
    kinds.dedup();
    // The first kind in alphabetical order is on top.
    let row = |name: &str| kinds.len() - kinds.partition_point(|kind| *kind < name);
    let line = |kind: &&str| {
        let events = flight.events.iter().filter(|event| event.name == **kind);
        let mark =
            |time_s: f64, row: f64| [Some((time_s, row - HALF_MARK)), Some((time_s, row + HALF_MARK)), None];
        let points = events.flat_map(|event| mark(event.time_s, row(kind) as f64)).collect();
        Curve { name: (*kind).into(), colour: colour(kinds.len() - row(kind)), stroke: Stroke::Solid, points }
    };
    let mut lines: Vec<Curve> = kinds.iter().map(line).collect();
    lines.push(level(flight, "", BASELINE));
    let chart = Chart { x: TIME, y: "events", is_rows: true, detail: DETAIL, lines, ..Chart::default() };
    // Without events there is only the baseline, which shows nothing.
    (!kinds.is_empty()).then(|| FlightFigure {
        name: "events".into(),
        title: "Events".into(),
        caption: "Each event of the log, by its kind.".into(),
        chart,
        table: Table::of_events(&flight.events),
        is_over_time: true,
    })
}
