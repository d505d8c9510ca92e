//! The HTML page of a benchmark: what people came for first, then pictures, tables and the machine, in one file that loads
//! nothing.
//!
//! Must never compute a figure itself.

use crate::{
    case::{Carrier, Load},
    cells,
    charts::{Drawing, Picture},
    label, machine, quantity,
    result::{Measured, Results},
    table,
};
use ringwing_drawing::html::{self, PageFigure, escaped};
use std::fmt::Write;

/// Most tiles. With more, the first picture is below the first screen.
const TILES: usize = 12;

/// The whole page. The pictures have their files in the folder `charts` beside the page.
pub(crate) fn render(results: &Results, pictures: &[Picture], charts: &str) -> String {
    let loads = table::loads(results);
    let headlines: String = loads.iter().map(|load| headline(results, *load)).collect();
    let body = [
        opening(results),
        tiles(results),
        warnings(&results.machine.warnings),
        pictures.iter().map(|picture| place(picture, charts)).collect(),
        headlines,
        budgets(results),
        results.cases.iter().map(case).collect(),
        format!("<p class=\"about\">{}</p>\n", escaped(table::LEGEND.trim_end())),
        format!(
            "<h2>The machine</h2>\n<pre>{}</pre>\n",
            escaped(machine::render(&results.machine).trim_end())
        ),
    ];
    let drawn = pictures.iter().filter_map(|picture| match &picture.drawing {
        Drawing::Chart(chart) => {
            Some(PageFigure { id: picture.name(), figure: chart.figure(), is_over_time: false })
        }
        // A strip stands in the page as SVG already, so the script has nothing to draw for it.
        Drawing::Strip(_) => None,
    });
    html::interactive_page("bench", &body.concat(), drawn.collect())
}

/// What was measured and when.
fn opening(results: &Results) -> String {
    let Results { ringwing, began, seed, command, interrupted, .. } = results;
    let interrupted =
        if *interrupted { "<br>Interrupted: these are the cases measured until then." } else { "" };
    format!(
        "<h1>ringwing bench</h1>\n<p class=\"about\">Version {}, begun {}, seed {seed}{interrupted}<br><code>{}</code></p>\n",
        escaped(ringwing),
        escaped(began),
        escaped(command)
    )
}

/// How long a tick of the swarm takes: that is what people came for.
fn tiles(results: &Results) -> String {
    // A case that failed before its first repeat has no time to show.
    let swarm =
        |measured: &&Measured| measured.case.carrier == Carrier::Swarm && !measured.repeats.is_empty();
    let tile = |measured: &Measured| {
        let [_, _, ratio, time, _] = cells::headline(results, measured);
        // The ranges are in the table.
        let median = |text: &str| text.split(" (").next().unwrap_or_default().to_owned();
        let floor = match median(&ratio).as_str() {
            "-" => String::new(),
            ratio => format!("; {ratio} times the floor"),
        };
        let what = match measured.case.load {
            Load::Closed => "from tick to tick",
            Load::Paced(_) => "for a tick",
        };
        let (time, case) = (median(&time), escaped(&label::case(&measured.case)));
        format!("<div class=\"tile\"><b>{time} us</b><span>{what}: {case}{floor}</span></div>")
    };
    let tiles: String = results.cases.iter().filter(swarm).take(TILES).map(tile).collect();
    format!("<div class=\"tiles\">{tiles}</div>\n")
}

fn warnings(warnings: &[String]) -> String {
    if warnings.is_empty() {
        return String::new();
    }
    let item = |warning: &String| format!("<li>{}</li>\n", escaped(warning));
    let items: String = warnings.iter().map(item).collect();
    format!("<p>What spoils measurements on this machine:</p>\n<ul>\n{items}</ul>\n")
}

/// The place of a picture, with its text and a link to its file.
fn place(picture: &Picture, charts: &str) -> String {
    let name = picture.name();
    let drawing = match &picture.drawing {
        Drawing::Chart(_) => format!("<div class=\"plot\" id=\"plot-{name}\"></div>"),
        Drawing::Strip(svg) => svg.clone(),
    };
    let (title, caption) = (escaped(&picture.title), escaped(&picture.caption));
    format!(
        "<figure id=\"{name}\"><h2>{title}</h2>\n{drawing}\n<figcaption>{caption} <a href=\"{charts}/{name}.svg\">SVG</a>\
         </figcaption></figure>\n"
    )
}

/// The tick times of a load over the floor.
fn headline(results: &Results, load: Load) -> String {
    let title = format!("Tick time, {}: {}", label::load(load), cells::tick_time(load));
    let rows = cells::by_size(results, load).into_iter().map(|case| cells::headline(results, case).to_vec());
    let floor = escaped(table::FLOOR);
    format!(
        "<h2>{}</h2>\n{}<p class=\"about\">{floor}</p>\n",
        escaped(&title),
        grid(cells::HEADLINE, 2, rows)
    )
}

/// Where the CPU time goes, if that was measured.
fn budgets(results: &Results) -> String {
    let row = |measured: &Measured| {
        let cells = cells::budget(measured)?;
        Some([label::case(&measured.case)].into_iter().chain(cells).collect())
    };
    let rows: Vec<Vec<String>> = results.cases.iter().filter_map(row).collect();
    if rows.is_empty() {
        return String::new();
    }
    let heads: Vec<String> =
        cells::BUDGET.iter().map(|(first, second)| format!("{first} {second}")).collect();
    let heads = ["case"].into_iter().chain(heads.iter().map(String::as_str));
    format!("<h2>{}</h2>\n{}", escaped(table::BUDGETS), grid(heads, 1, rows))
}

/// A case: its rate, the distributions of its hops, what was missed, and why it is incomplete.
fn case(measured: &Measured) -> String {
    let mut text = format!("<h2>{}</h2>\n", escaped(&label::case(&measured.case)));
    if !measured.repeats.is_empty() {
        let rows = quantity::hops(measured)
            .into_iter()
            .map(|hop| cells::distribution(hop, &quantity::all_samples(measured, hop)));
        // Writing to a string cannot fail.
        let _ = write!(
            text,
            "<p>{}</p>\n{}",
            escaped(&cells::rate(measured)),
            grid(cells::distribution_heads(), 1, rows)
        );
    }
    for line in [cells::misses(measured), measured.failure.as_ref().map(|why| format!("incomplete: {why}"))] {
        text.extend(line.map(|line| format!("<p>{}</p>\n", escaped(&line))));
    }
    text
}

/// A table whose first `names` columns are words and the others numbers.
fn grid<'a>(
    heads: impl IntoIterator<Item = &'a str>,
    names: usize,
    rows: impl IntoIterator<Item = Vec<String>>,
) -> String {
    let line = |cells: &mut dyn Iterator<Item = String>, tag: &str| {
        // HTML ends rows and cells without closing tags, which would take more room than most of the numbers.
        let mut line = "<tr>".to_owned();
        for (column, cell) in cells.enumerate() {
            let class = if column < names { "" } else { " class=\"number\"" };
            // Writing to a string cannot fail.
            let _ = write!(line, "<{tag}{class}>{}", escaped(&cell));
        }
        line + "\n"
    };
    let heads = line(&mut heads.into_iter().map(Into::into), "th");
    let rows: String = rows.into_iter().map(|cells| line(&mut cells.into_iter(), "td")).collect();
    format!("<div class=\"wide\"><table>\n{heads}{rows}</table></div>\n")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{charts, example};

    #[test]
    fn the_page_shows_everything_and_loads_nothing() {
        let mut results = example::results();
        results.command = "ringwing bench <script>".into();
        let pictures = charts::all(&results).unwrap();
        let page = render(&results, &pictures, "charts");
        // The library that draws the charts names addresses, and loads none of them.
        let (own, _) = page.split_once("<script").expect("the charts need a script");
        assert_eq!(own.matches("<figure").count(), 10);
        assert_eq!(own.matches("class=\"plot\"").count(), 8);
        assert_eq!(own.matches("<svg").count(), 2, "strips are drawn already");
        for foreign in ["http:", "https:", "src=", "<script>", "@import", "url("] {
            let named = own.replace("http://www.w3.org/2000/svg", "");
            assert!(!named.contains(foreign), "the page has {foreign}");
        }
        for picture in &pictures {
            assert!(own.contains(&format!("href=\"charts/{}.svg\"", picture.name())));
        }
        for text in [
            "Example 3000",
            "60 % busy",
            "ringwing bench &lt;script&gt;",
            "missed deadlines: 6",
            "<td class=\"number\">1.40 (1.40 to 1.40)",
        ] {
            assert!(own.contains(text), "the page lacks {text}");
        }
        assert!(own.contains(
            "<b>14.7 us</b><span>from tick to tick: swarm, 6 UAVs, closed loop; 1.40 times the floor"
        ));
    }
}
