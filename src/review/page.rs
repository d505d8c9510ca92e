//! The page of a flight: what is said of it, its figures, and what happened.

use super::flight::{Flight, Happening};
use ringwing_drawing::html::{self, escaped};
use std::fmt::Write;

/// Events that the page lists; all are in the table beside it.
const LISTED: usize = 200;

/// A figure, drawn.
pub(super) struct Drawn {
    pub(super) name: String,
    pub(super) title: String,
    pub(super) text: String,
    pub(super) svg: String,
}

/// The whole page.
pub(super) fn page(flight: &Flight, figures: &[Drawn]) -> String {
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
    push_happenings(&mut body, &flight.happenings);
    html::page(title, &body)
}

fn push_figure(page: &mut String, Drawn { name, title, text, svg }: &Drawn) {
    // Writing to a string cannot fail.
    let _ = writeln!(
        page,
        "<figure id=\"{name}\"><h2>{}</h2>\n{svg}\n<figcaption>{} <a href=\"{name}.svg\">SVG</a> \
         <a href=\"{name}.csv\">CSV</a></figcaption></figure>",
        escaped(title),
        escaped(text)
    );
}

fn push_happenings(page: &mut String, happenings: &[Happening]) {
    page.push_str("<table>\n");
    for Happening { time_s, name, text } in happenings.iter().take(LISTED) {
        let (name, text) = (escaped(name), escaped(text));
        // Writing to a string cannot fail.
        let _ = writeln!(page, "<tr><td class=\"number\">{time_s:.2} s<td>{name}<td>{text}");
    }
    page.push_str("</table>\n");
    if let Some(more) = happenings.len().checked_sub(LISTED).filter(|more| *more > 0) {
        let _ = writeln!(page, "<p>and {more} more in <a href=\"events.csv\">events.csv</a></p>");
    }
}
