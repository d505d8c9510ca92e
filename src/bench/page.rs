//! The page of a benchmark: its figures, its tables and its machine in one file that loads nothing.

use super::{
    charts::{self, Figure},
    doctor,
    result::Results,
    table,
};
use crate::drawing::html::{self, escaped};

/// All of it, as HTML.
pub(crate) fn render(results: &Results) -> String {
    let headlines: String =
        table::loads(results).into_iter().map(|load| table::headline(results, load)).collect();
    let cases: String = results.cases.iter().map(table::block).collect();
    let body = [
        format!("<h1>ringwing bench</h1>\n<pre>{}</pre>\n", escaped(table::opening(results).trim_end())),
        warnings(&results.machine.warnings),
        section("Ratios to the floor", &headlines),
        figures(results),
        section("Every case", &(cases + table::LEGEND)),
        section("Where the time goes", &table::budgets(results)),
        section("The machine", &doctor::render(&results.machine)),
    ];
    html::page("bench", &body.concat())
}

fn warnings(warnings: &[String]) -> String {
    if warnings.is_empty() {
        return String::new();
    }
    let item = |warning: &String| format!("<li>{}</li>\n", escaped(warning));
    let items: String = warnings.iter().map(item).collect();
    format!("<p>What spoils these figures on this machine:</p>\n<ul>\n{items}</ul>\n")
}

fn section(title: &str, text: &str) -> String {
    if text.is_empty() {
        return String::new();
    }
    format!("<h2>{title}</h2>\n<pre>{}</pre>\n", escaped(text.trim_end()))
}

fn figures(results: &Results) -> String {
    match charts::all(results) {
        Ok(figures) => figures.iter().map(figure).collect(),
        Err(error) => format!("<p>The figures cannot be drawn: {}</p>\n", escaped(&error.to_string())),
    }
}

fn figure(Figure { title, text, svg }: &Figure) -> String {
    let (title, text) = (escaped(title), escaped(text));
    format!("<figure><h2>{title}</h2>\n{svg}\n<figcaption>{text}</figcaption></figure>\n")
}

#[cfg(test)]
mod tests {
    use super::{super::example, *};

    #[test]
    fn the_page_holds_everything_and_loads_nothing() {
        let mut results = example::results();
        results.command = "ringwing bench <script>".into();
        let page = render(&results);
        assert_eq!(page.matches("<svg").count(), 10);
        for foreign in ["http:", "https:", "src=", "href=", "<script>", "@import", "url("] {
            let named = page.replace("http://www.w3.org/2000/svg", "");
            assert!(!named.contains(foreign), "the page has {foreign}");
        }
        for text in
            ["Example 3000", "the machine is busy", "ringwing bench &lt;script&gt;", "missed deadlines: 6"]
        {
            assert!(page.contains(text), "the page lacks {text}");
        }
    }
}
