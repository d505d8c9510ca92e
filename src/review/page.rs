//! The page about a flight: its verdict and figures of merit, its charts and its events.
//!
//! Never loads anything: the page holds its charts and the library that draws them, so it can be moved and mailed.

use super::{
    figures::FlightFigure,
    flight::{LoggedFlight, ShownEvent},
};
use crate::summary::SummaryText;
use ringwing_drawing::html::{self, PageFigure, escaped};
use serde_json::Value;
use std::fmt::Write;

/// Events listed on the page. A flight with many faults has thousands; `events.csv` has all of them.
const LISTED: usize = 200;
/// The figures of merit on the tiles: the summary's field, what it is called, its unit, and its decimals.
const TILES: [(&str, &str, &str, usize); 7] = [
    ("/slot_error_max_m", "largest slot error at the end", "m", 2),
    ("/closest_pair_m", "closest pair", "m", 1),
    ("/settling_s", "settled after", "s", 1),
    ("/recovery_max_s", "longest recovery", "s", 1),
    ("/collisions", "collisions", "", 0),
    ("/faults", "faults", "", 0),
    ("/latency/p99_us", "p99 of a tick", "us", 0),
];

/// The whole page as HTML, about `flights`: one, or two that are laid over each other.
pub(super) fn page(flights: &[(String, &LoggedFlight)], figures: &[FlightFigure]) -> String {
    let mut body = String::new();
    let mut titles = Vec::new();
    for (name, flight) in flights {
        let title = if name.is_empty() {
            flight.scenario.name.clone()
        } else {
            format!("{name}: {}", flight.scenario.name)
        };
        // Writing to a string cannot fail.
        let _ = writeln!(
            body,
            "<h1>{}</h1>\n<p class=\"about\">{}</p>",
            escaped(&title),
            escaped(&flight.scenario.description)
        );
        push_tiles(&mut body, flight);
        titles.push(title);
    }
    for figure in figures {
        push_place(&mut body, figure);
    }
    for ((_, flight), title) in flights.iter().zip(&titles) {
        let _ = writeln!(
            body,
            "<details><summary>{}: the whole summary</summary><pre>{}</pre></details>",
            escaped(title),
            escaped(&SummaryText(&flight.summary).to_string())
        );
        push_events(&mut body, &flight.events);
    }
    let drawn = figures.iter().map(|figure| PageFigure {
        id: figure.name.clone(),
        figure: figure.chart.figure(),
        is_over_time: figure.is_over_time,
    });
    html::interactive_page(&titles.join(" and "), &body, drawn.collect())
}

/// The verdict with its reasons, and the figures that people ask for first.
fn push_tiles(page: &mut String, flight: &LoggedFlight) {
    let summary = serde_json::to_value(&flight.summary).unwrap_or_default();
    let verdict = summary["verdict"].as_str().unwrap_or_default();
    page.push_str("<div class=\"tiles\">");
    let _ = write!(page, "<div class=\"tile {verdict}\"><b>{verdict}</b><span>verdict</span></div>");
    for (field, name, unit, decimals) in TILES {
        // A value that does not exist has no tile: an empty one would read as zero.
        if let Some(value) = summary.pointer(field).and_then(Value::as_f64) {
            let _ =
                write!(page, "<div class=\"tile\"><b>{value:.decimals$} {unit}</b><span>{name}</span></div>");
        }
    }
    page.push_str("</div>\n");
    let reasons =
        ["failures", "violations"].map(|field| summary[field].as_array().cloned().unwrap_or_default());
    // Failures come first: a flight that did not end says little about its requirements.
    let reasons: Vec<Value> = reasons.concat();
    if !reasons.is_empty() {
        let items =
            reasons.iter().filter_map(Value::as_str).map(|reason| format!("<li>{}</li>", escaped(reason)));
        let _ = writeln!(page, "<ul>{}</ul>", items.collect::<String>());
    }
}

fn push_place(page: &mut String, FlightFigure { name, title, caption, chart, .. }: &FlightFigure) {
    let kind = if chart.is_map { "plot map" } else { "plot" };
    let _ = writeln!(
        page,
        "<figure id=\"{name}\"><h2>{}</h2>\n<div class=\"{kind}\" id=\"plot-{name}\"></div>\n<figcaption>{} \
         <a href=\"{name}.svg\">SVG</a> <a href=\"{name}.csv\">CSV</a></figcaption></figure>",
        escaped(title),
        escaped(caption)
    );
}

fn push_events(page: &mut String, events: &[ShownEvent]) {
    page.push_str("<table>\n");
    for ShownEvent { time_s, name, text, .. } in events.iter().take(LISTED) {
        let (name, text) = (escaped(name), escaped(text));
        // Writing to a string cannot fail.
        let _ = writeln!(page, "<tr><td class=\"number\">{time_s:.2} s<td>{name}<td>{text}");
    }
    page.push_str("</table>\n");
    if let Some(more) = events.len().checked_sub(LISTED).filter(|more| *more > 0) {
        let _ = writeln!(page, "<p>and {more} more in <a href=\"events.csv\">events.csv</a></p>");
    }
}
