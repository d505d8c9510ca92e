//! The page: one file of HTML that loads nothing.

use super::flight::{Flight, Happening};
use std::fmt::Write;

/// Events that the page lists; all are in the table beside it.
const LISTED: usize = 200;

const STYLE: &str = "body{font:15px/1.5 system-ui,sans-serif;color:#222;max-width:1000px;margin:2em auto;padding:0 1em}\
pre{font:13px/1.45 ui-monospace,monospace;background:#f6f6f4;padding:1em;overflow-x:auto;border-radius:6px}\
figure{margin:2.2em 0;border-top:1px solid #ddd;padding-top:.6em}figcaption{color:#555}h2{font-size:1.15em;margin:.3em 0}\
svg{max-width:100%;height:auto}table{border-collapse:collapse;font-size:13px}td{padding:.15em .9em .15em 0;vertical-align:top}\
.number{text-align:right;white-space:nowrap}a{color:#0072b2}";

/// A figure, drawn.
pub(super) struct Drawn {
    pub(super) name: String,
    pub(super) title: String,
    pub(super) text: String,
    pub(super) svg: String,
}

/// The whole page.
pub(super) fn page(flight: &Flight, figures: &[Drawn]) -> String {
    let title = escaped(&flight.scenario.name);
    let mut page = format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>ringwing: {title}</title>\n\
         <style>{STYLE}</style></head>\n<body><h1>{title}</h1>\n<p>{}</p>\n<pre>{}</pre>\n",
        escaped(&flight.scenario.description),
        escaped(&flight.summary.to_string()),
    );
    for figure in figures {
        push_figure(&mut page, figure);
    }
    push_happenings(&mut page, &flight.happenings);
    page + "</body></html>\n"
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

/// `text` as HTML shows it.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
