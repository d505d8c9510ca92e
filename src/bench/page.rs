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
    let mut body =
        format!("<h1>ringwing bench</h1>\n<pre>{}</pre>\n", escaped(table::opening(results).trim_end()));
    push_warnings(&mut body, &results.machine.warnings);
    let headlines: Vec<String> =
        table::loads(results).into_iter().map(|load| table::headline(results, load)).collect();
    push_text(&mut body, "Ratios to the floor", &headlines.concat());
    match charts::all(results) {
        Ok(figures) => figures.iter().for_each(|figure| push_figure(&mut body, figure)),
        Err(error) => {
            body += &format!("<p>The figures cannot be drawn: {}</p>\n", escaped(&error.to_string()))
        }
    }
    let blocks: Vec<String> = results.cases.iter().map(table::block).collect();
    push_text(&mut body, "Every case", &(blocks.concat() + table::LEGEND));
    push_text(&mut body, "Where the time goes", &table::budgets(results));
    push_text(&mut body, "The machine", &doctor::render(&results.machine));
    html::page("bench", &body)
}

fn push_warnings(body: &mut String, warnings: &[String]) {
    if warnings.is_empty() {
        return;
    }
    body.push_str("<p>What spoils these figures on this machine:</p>\n<ul>\n");
    warnings.iter().for_each(|warning| *body += &format!("<li>{}</li>\n", escaped(warning)));
    body.push_str("</ul>\n");
}

fn push_text(body: &mut String, title: &str, text: &str) {
    if !text.is_empty() {
        *body += &format!("<h2>{title}</h2>\n<pre>{}</pre>\n", escaped(text.trim_end()));
    }
}

fn push_figure(body: &mut String, Figure { title, text, svg }: &Figure) {
    *body += &format!(
        "<figure><h2>{}</h2>\n{svg}\n<figcaption>{}</figcaption></figure>\n",
        escaped(title),
        escaped(text)
    );
}

#[cfg(test)]
mod tests {
    use super::{super::example, *};

    #[test]
    fn the_page_holds_everything_and_loads_nothing() {
        let mut results = example::results();
        results.command = "ringwing bench <script>".into();
        let page = render(&results);
        if let Ok(path) = std::env::var("RINGWING_BENCH_PAGE") {
            std::fs::write(path, &page).unwrap();
        }
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
