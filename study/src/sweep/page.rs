//! The page of a sweep: its maps, and the flights of the cell that somebody chooses.
//!
//! One file that loads nothing. Must never put text into the page without escaping it.

use super::{
    cells::Cell,
    definition::{Definition, Manifest},
    maps::Map,
    row::Row,
};
use crate::{
    figure::{FIGURES, Figure},
    shell::quoted,
};
use ringwing_drawing::html::{escaped, page_with_style};
use serde_json::{Value, json};

/// Colours for dark screens, and a layout that also fits a phone.
const STYLE: &str = "body{max-width:1020px}figure{overflow-x:auto}figure svg{max-width:none;background:none}h1{font-size:1.4em}\
.cell{cursor:pointer}.cell:hover rect,.cell:focus rect,.chosen rect{stroke:#d55e00;stroke-width:3}\
.cell:hover circle,.cell:focus circle,.chosen circle{stroke:#d55e00;stroke-width:4}.cell:focus{outline:none}\
#flights{border:1px solid #bbb;border-radius:8px;padding:.4em 1em;margin:1.2em 0;overflow-x:auto;position:sticky;bottom:0;\
background:#fff;max-height:45vh;overflow-y:auto}#flights h2{margin:.4em 0}#flights table{width:100%}\
#flights th{text-align:left;font-weight:600;padding:.15em .9em .15em 0;white-space:nowrap}#flights code{font-size:12px;white-space:nowrap}\
#flights td code{user-select:all}.passed{color:#00704f}.violated,.failed{color:#b34700}\
@media(max-width:600px){body{margin:1em auto;font-size:14px}figure{margin:1.2em 0}}\
@media(prefers-color-scheme:dark){body{background:#16181b;color:#ddd}pre{background:#22262b}figure{border-color:#444}\
figcaption{color:#aaa}a{color:#6cb6ff}.ink{fill:#ddd}.grid{stroke:#3a3f45}#flights{background:#1d2024;border-color:#555}\
.passed{color:#4fc9a0}.violated,.failed{color:#ff9d5c}}";

/// Shows the flights of the cell that is chosen with mouse, finger or keyboard.
const SCRIPT: &str = r#"
const data = JSON.parse(document.getElementById("data").textContent);
const place = document.getElementById("flights");
const add = (parent, tag, text, name) => {
  const element = parent.appendChild(document.createElement(tag));
  if (text !== undefined) element.textContent = text;
  if (name) element.className = name;
  return element;
};
function choose(number) {
  document.querySelectorAll(".chosen").forEach(cell => cell.classList.remove("chosen"));
  document.querySelectorAll(`[data-cell="${number}"]`).forEach(cell => cell.classList.add("chosen"));
  const cell = data.cells[number];
  place.replaceChildren();
  if (!cell) { add(place, "p", "The flights of this cell are in flights.csv only."); return; }
  add(place, "h2", cell.title);
  const shown = cell.flights.length;
  add(place, "p", `${cell.passed} of ${cell.all} flights passed` + (shown < cell.all ? `; these are ${shown} of them, those that did not pass first.` : "."));
  const table = add(place, "table"), head = add(table, "tr");
  ["seed", "verdict", ...data.figures, "fly it again, recorded"].forEach(text => add(head, "th", text));
  for (const flight of cell.flights) {
    const row = add(table, "tr");
    add(row, "td", flight.seed);
    add(row, "td", flight.verdict + (flight.why ? ": " + flight.why : ""), flight.verdict);
    flight.figures.forEach(value => add(row, "td", value, "number"));
    add(add(row, "td"), "code", flight.command);
  }
}
// A link may name a cell: index.html#12.
const open = () => { if (location.hash.length > 1) choose(location.hash.slice(1)); };
addEventListener("hashchange", open);
open();
document.querySelectorAll("[data-cell]").forEach(cell => {
  cell.addEventListener("click", () => { location.hash = cell.dataset.cell; });
  cell.addEventListener("keydown", event => { if (event.key === "Enter" || event.key === " ") { event.preventDefault(); location.hash = cell.dataset.cell; } });
});
"#;

/// The page of a sweep with these maps and cells; `figures` are those of the flights' table.
pub fn page(manifest: &Manifest, maps: &[Map], cells: &[Cell], figures: &[&Figure]) -> String {
    let sweep = &manifest.sweep;
    let mut body = format!("<h1>{}</h1>\n<p>{}</p>\n", escaped(&sweep.name), escaped(&sweep.description));
    body.push_str(&introduction(manifest, cells));
    if maps.is_empty() {
        body.push_str(
            "<p>There is no map: no axis has several values, or there are too many cells to see one.</p>\n",
        );
    }
    for map in maps {
        let title = escaped(&map.title);
        body.extend(["<figure><figcaption>", &title, "</figcaption>\n", &map.svg, "</figure>\n"]);
    }
    body.push_str(
        "<section id=\"flights\" aria-live=\"polite\"><p>Choose a cell to see its flights.</p></section>\n",
    );
    // A script ends at the first closing tag, even within a text.
    let data = data(manifest, cells, figures).to_string().replace("</", "<\\/");
    body.extend(["<script type=\"application/json\" id=\"data\">", &data, "</script>\n"]);
    body.extend(["<script>", SCRIPT, "</script>\n"]);
    page_with_style(&sweep.name, STYLE, &body)
}

fn introduction(manifest: &Manifest, cells: &[Cell]) -> String {
    let (flights, passed) =
        cells.iter().fold((0, 0), |(all, passed), cell| (all + cell.flights, passed + cell.passed));
    let how = if manifest.by_processes { "by real processes" } else { "in the simulation" };
    let axes: Vec<_> = manifest.sweep.design.axes.iter().map(|axis| axis.name.as_str()).collect();
    format!(
        "<p>{flights} flights of {} cells {how}, {passed} passed. Scenario {}, axes {}. ringwing {}, build {}. \
         Bands around a share are its interval of 95 % (Wilson); bands around a median reach to the worst tenth of the flights. All flights are in \
         <a href=\"flights.csv\">flights.csv</a> and <a href=\"flights.parquet\">flights.parquet</a>.</p>\n",
        cells.len(),
        escaped(&manifest.sweep.scenario),
        escaped(&axes.join(", ")),
        escaped(&manifest.version),
        escaped(&manifest.build)
    )
}

/// What the script shows, by the number of the cell.
fn data(manifest: &Manifest, cells: &[Cell], figures: &[&Figure]) -> Value {
    let cell = |cell: &Cell| {
        let flights: Vec<_> = cell.kept.iter().map(|row| flight(manifest, row, figures)).collect();
        let title = title(&manifest.sweep, cell);
        (
            cell.cell.to_string(),
            json!({ "title": title, "all": cell.flights, "passed": cell.passed, "flights": flights }),
        )
    };
    let names: Vec<_> = figures.iter().map(|figure| figure.name).collect();
    let cells: serde_json::Map<String, Value> =
        cells.iter().filter(|cell| !cell.kept.is_empty()).map(cell).collect();
    json!({ "figures": names, "cells": cells })
}

fn title(sweep: &Definition, cell: &Cell) -> String {
    let axes = sweep.design.axes.iter().zip(&cell.values);
    axes.map(|(axis, value)| format!("{} {value}", axis.name)).collect::<Vec<_>>().join(", ")
}

fn flight(manifest: &Manifest, row: &Row, figures: &[&Figure]) -> Value {
    let value = |figure: &&Figure| {
        let place = FIGURES.iter().position(|other| other.name == figure.name);
        let value = place.and_then(|place| row.figures[place]);
        value.map_or_else(|| "-".to_owned(), |value| format!("{value:.3}"))
    };
    let why = row.failure.clone().unwrap_or_else(|| row.violated.join(", "));
    json!({
        // As text, because a script's numbers end at 2^53.
        "seed": row.seed.to_string(),
        "verdict": row.verdict.name(),
        "why": why,
        "figures": figures.iter().map(value).collect::<Vec<_>>(),
        "command": command(manifest, row.cell, row.seed),
    })
}

/// The command that flies one flight again and records it.
pub fn command(manifest: &Manifest, cell: u64, seed: u64) -> String {
    let mut words = vec!["ringwing".to_owned(), "run".to_owned()];
    words.extend(manifest.sweep.arguments(cell));
    words.extend(["--seed".to_owned(), seed.to_string()]);
    words.extend((!manifest.by_processes).then(|| "--simulated".to_owned()));
    words.iter().map(|word| quoted(word)).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sweep::{Draft, row::tests::row};
    use ringwing_recorder::metrics::Verdict;

    fn manifest() -> Manifest {
        let text = "name = \"x\"\nscenario = \"paper-4.1\"\nfaults = [\"at 1 s link all delay {delay} s\"]\n[axes]\ndelay = [0.5, 1]";
        Manifest {
            sweep: Draft::parse("x", text).unwrap().finish().unwrap(),
            version: "1".into(),
            build: "b".into(),
            by_processes: false,
            has_baseline: false,
        }
    }

    #[test]
    fn a_flight_has_the_command_that_flies_it_again() {
        assert_eq!(
            command(&manifest(), 1, 7),
            "ringwing run paper-4.1 --fault 'at 1 s link all delay 1 s' --seed 7 --simulated"
        );
    }

    #[test]
    fn text_of_a_flight_never_ends_the_script() {
        let mut flight = row(0, 1, "0.5", Verdict::Failed);
        flight.failure = Some("</script><b>".into());
        let cell = Cell {
            cell: 0,
            values: vec!["0.5".into()],
            flights: 1,
            passed: 0,
            figures: Vec::new(),
            kept: vec![flight],
        };
        let page = page(&manifest(), &[], &[cell], &[]);
        assert_eq!(page.matches("</script>").count(), 2);
        let data = page.split("id=\"data\">").nth(1).unwrap().split("</script>").next().unwrap();
        let data: Value = serde_json::from_str(data).unwrap();
        assert_eq!(data["cells"]["0"]["flights"][0]["why"], "</script><b>");
    }
}
