//! The page about a flight: its summary, its figures and its events.
//!
//! Never loads anything: figures are part of the page, so it can be moved and mailed.

use super::flight::{LoggedFlight, ShownEvent};
use ringwing_drawing::html::{self, escaped};
use std::fmt::Write;

/// Events listed on the page. A flight with many faults has thousands; `events.csv` has all of them.
const LISTED: usize = 200;

/// A figure with its drawing.
pub(super) struct DrawnFigure {
    pub(super) name: String,
    pub(super) title: String,
    pub(super) caption: String,
    pub(super) svg: String,
}

/// The whole page as HTML.
pub(super) fn page(flight: &LoggedFlight, figures: &[DrawnFigure]) -> String {
    let title = &flight.scenario.name;
    let mut body = format!(
        "<h1>{}</h1>\n<p>{}</p>\n<pre>{}</pre>\n",
        escaped(title),
        escaped(&flight.scenario.description),
        escaped(&flight.summary.to_string()),
    );
    for figure in figures {
        push_figure(&mut body, figure);
    }
    push_events(&mut body, &flight.events);
    html::page(title, &body)
}

fn push_figure(page: &mut String, DrawnFigure { name, title, caption, svg }: &DrawnFigure) {
    // Writing to a string cannot fail.
    let _ = writeln!(
        page,
        "<figure id=\"{name}\"><h2>{}</h2>\n{svg}\n<figcaption>{} <a href=\"{name}.svg\">SVG</a> \
         <a href=\"{name}.csv\">CSV</a></figcaption></figure>",
        escaped(title),
        escaped(caption)
    );
}

fn push_events(page: &mut String, events: &[ShownEvent]) {
    page.push_str("<table>\n");
    for ShownEvent { time_s, name, text } in events.iter().take(LISTED) {
        let (name, text) = (escaped(name), escaped(text));
        // Writing to a string cannot fail.
        let _ = writeln!(page, "<tr><td class=\"number\">{time_s:.2} s<td>{name}<td>{text}");
    }
    page.push_str("</table>\n");
    if let Some(more) = events.len().checked_sub(LISTED).filter(|more| *more > 0) {
        let _ = writeln!(page, "<p>and {more} more in <a href=\"events.csv\">events.csv</a></p>");
    }
}
