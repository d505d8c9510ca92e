//! Lays the figures of a second flight over those of the first.
//!
//! Never mixes up the flights: the legend says which one a line belongs to, and the lines of the second are dashed.

use super::figures::FlightFigure;
use ringwing_drawing::chart::{Curve, Stroke};

/// Adds `figure` of the flight called `flight` to those of the flights before it; the only flight has no name.
pub(super) fn add(figures: &mut Vec<FlightFigure>, mut figure: FlightFigure, flight: &str) {
    let same = figures.iter_mut().find(|before| before.name == figure.name);
    let is_second = same.is_some();
    for line in figure.chart.lines.iter_mut().filter(|_| !flight.is_empty()) {
        rename(line, flight);
        // Obstacles keep their shape: both flights have them in the same place, or it matters where they differ.
        if is_second && line.stroke == Stroke::Solid {
            line.stroke = Stroke::Dashed;
        }
    }
    match same {
        // The table of this flight is not added: it is a file of its own already.
        Some(before) => {
            before.chart.lines.append(&mut figure.chart.lines);
            before.chart.marks.append(&mut figure.chart.marks);
            before.chart.bands.append(&mut figure.chart.bands);
        }
        None => figures.push(figure),
    }
}

fn rename(line: &mut Curve, flight: &str) {
    if !line.name.is_empty() {
        line.name = format!("{flight}: {}", line.name);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::review::table::Table;
    use ringwing_drawing::{RGBColor, chart::Chart};

    fn figure(name: &str) -> FlightFigure {
        let line = |name: &str| Curve {
            name: name.into(),
            colour: RGBColor(0, 0, 0),
            stroke: Stroke::Solid,
            points: vec![Some((0.0, 0.0))],
        };
        FlightFigure {
            name: name.into(),
            title: String::new(),
            caption: String::new(),
            chart: Chart { lines: vec![line("uav 1"), line("")], ..Chart::default() },
            table: Table::of_events(&[]),
            is_over_time: true,
        }
    }

    #[test]
    fn the_second_flight_is_dashed_and_named() {
        let mut figures = Vec::new();
        add(&mut figures, figure("speeds"), "A");
        add(&mut figures, figure("speeds"), "B");
        add(&mut figures, figure("ages"), "B");
        let drawn = |figure: &FlightFigure| -> Vec<(String, Stroke)> {
            figure.chart.lines.iter().map(|line| (line.name.clone(), line.stroke)).collect()
        };
        assert_eq!(figures.len(), 2);
        let names = [
            ("A: uav 1", Stroke::Solid),
            ("", Stroke::Solid),
            ("B: uav 1", Stroke::Dashed),
            ("", Stroke::Dashed),
        ];
        assert_eq!(drawn(&figures[0]), names.map(|(name, stroke)| (name.to_owned(), stroke)));
        assert_eq!(figures[1].chart.lines[0].stroke, Stroke::Solid, "only the second flight has this figure");
    }

    #[test]
    fn a_single_flight_keeps_its_names() {
        let mut figures = Vec::new();
        add(&mut figures, figure("speeds"), "");
        assert_eq!(figures[0].chart.lines[0].name, "uav 1");
    }
}
