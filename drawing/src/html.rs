//! The HTML frame of a page: one file that loads nothing.
//!
//! Must never put text into a page without escaping it.

use crate::interactive::plotly_script;
use serde_json::{Map, Value, json};

const STYLE: &str = include_str!("page.css");
/// Draws the figures with Plotly.
const DRAW: &str = include_str!("page.js");

/// A figure of an interactive page.
pub struct PageFigure {
    /// Its place in the page is the element `plot-` followed by this id.
    pub id: String,
    /// In Plotly's format, with `data` and `layout`.
    pub figure: Value,
    /// Whether its horizontal axis is the time, which all such figures of a page share.
    pub is_over_time: bool,
}

/// A complete page. `title` is plain text; `body` is HTML.
#[must_use]
pub fn page(title: &str, body: &str) -> String {
    page_with_style(title, "", body)
}

/// A complete page with more rules of style, which win over those of every page.
#[must_use]
pub fn page_with_style(title: &str, style: &str, body: &str) -> String {
    format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"><title>ringwing: {title}</title>\n\
         <style>{STYLE}{style}</style></head>\n<body>{body}</body></html>\n",
        title = escaped(title)
    )
}

/// A complete page whose `body` has places for `figures`: elements of class `plot`.
#[must_use]
pub fn interactive_page(title: &str, body: &str, figures: Vec<PageFigure>) -> String {
    let figures = figures.into_iter().map(|PageFigure { id, figure, is_over_time }| {
        (id, json!({ "figure": figure, "linked": is_over_time }))
    });
    let figures = Value::from(figures.collect::<Map<_, _>>()).to_string();
    // JSON allows an escaped slash, and HTML ends a script at the first `</script`.
    let figures = figures.replace("</", "<\\/");
    // In this order: the last script reads the figures and calls Plotly as soon as it runs.
    let scripts = format!(
        "<script type=\"application/json\" id=\"figures\">{figures}</script>\n{}\n<script>{DRAW}</script>",
        plotly_script()
    );
    page(title, &format!("{body}{scripts}"))
}

/// `text` with every character replaced that has a meaning in HTML or SVG.
#[must_use]
pub fn escaped(text: &str) -> String {
    // The ampersand comes first, because the other replacements contain one.
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_style_spells_properties_as_css_does() {
        assert!(STYLE.contains("color:") && !STYLE.contains("colour"));
        assert_eq!(STYLE.matches('{').count(), STYLE.matches('}').count());
    }

    #[test]
    fn text_never_becomes_markup() {
        assert_eq!(escaped("<b> & \"q\""), "&lt;b&gt; &amp; &quot;q&quot;");
        assert!(page("a < b", "").contains("<title>ringwing: a &lt; b</title>"));
        let figure = PageFigure { id: "f".into(), figure: json!("</script>"), is_over_time: true };
        let page = interactive_page("t", "", vec![figure]);
        assert!(page.contains(r#"{"f":{"figure":"<\/script>","linked":true}}"#));
    }
}
