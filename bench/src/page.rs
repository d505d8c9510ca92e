//! The HTML page of a benchmark: charts, tables and the machine, in one file that loads nothing.
//!
//! Must never compute a figure itself.

use crate::{
    charts::{self, Picture},
    machine,
    result::Results,
    table,
};
use ringwing_drawing::html::{self, escaped};

/// The whole page.
pub(crate) fn render(results: &Results) -> String {
    let headlines: String =
        table::loads(results).into_iter().map(|load| table::headline(results, load)).collect();
    let cases: String = results.cases.iter().map(table::block).collect();
    let body = [
        format!("<h1>ringwing bench</h1>\n<pre>{}</pre>\n", escaped(table::opening(results).trim_end())),
        warnings(&results.machine.warnings),
        section("Tick times over the floor", &headlines),
        pictures(results),
        section("All cases", &(cases + table::LEGEND)),
        section("Where the time goes", &table::budgets(results)),
        section("The machine", &machine::render(&results.machine)),
    ];
    html::page("bench", &body.concat())
}

fn warnings(warnings: &[String]) -> String {
    if warnings.is_empty() {
        return String::new();
    }
    let item = |warning: &String| format!("<li>{}</li>\n", escaped(warning));
    let items: String = warnings.iter().map(item).collect();
    format!("<p>What spoils measurements on this machine:</p>\n<ul>\n{items}</ul>\n")
}

fn section(title: &str, text: &str) -> String {
    if text.is_empty() {
        return String::new();
    }
    format!("<h2>{title}</h2>\n<pre>{}</pre>\n", escaped(text.trim_end()))
}

fn pictures(results: &Results) -> String {
    match charts::all(results) {
        Ok(pictures) => pictures.iter().map(picture).collect(),
        // The tables are useful without the charts.
        Err(error) => format!("<p>{}</p>\n", escaped(&error.to_string())),
    }
}

fn picture(Picture { title, caption, svg }: &Picture) -> String {
    let (title, caption) = (escaped(title), escaped(caption));
    format!("<figure><h2>{title}</h2>\n{svg}\n<figcaption>{caption}</figcaption></figure>\n")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::example;

    #[test]
    fn the_page_shows_everything_and_loads_nothing() {
        let mut results = example::results();
        results.command = "ringwing bench <script>".into();
        let page = render(&results);
        assert_eq!(page.matches("<svg").count(), 10);
        for foreign in ["http:", "https:", "src=", "href=", "<script>", "@import", "url("] {
            let named = page.replace("http://www.w3.org/2000/svg", "");
            assert!(!named.contains(foreign), "the page has {foreign}");
        }
        for text in ["Example 3000", "60 % busy", "ringwing bench &lt;script&gt;", "missed deadlines: 6"] {
            assert!(page.contains(text), "the page lacks {text}");
        }
    }
}
