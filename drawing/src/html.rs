//! The HTML frame of a page: one file that loads nothing.
//!
//! Must never put text into a page without escaping it.

const STYLE: &str = "body{font:15px/1.5 system-ui,sans-serif;color:#222;max-width:1000px;margin:2em auto;padding:0 1em}\
pre{font:13px/1.45 ui-monospace,monospace;background:#f6f6f4;padding:1em;overflow-x:auto;border-radius:6px}\
figure{margin:2.2em 0;border-top:1px solid #ddd;padding-top:.6em}figcaption{color:#555}h2{font-size:1.15em;margin:.3em 0}\
svg{max-width:100%;height:auto}table{border-collapse:collapse;font-size:13px}td{padding:.15em .9em .15em 0;vertical-align:top}\
.number{text-align:right;white-space:nowrap}a{color:#0072b2}";

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

/// `text` with every character replaced that has a meaning in HTML.
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
    }

    #[test]
    fn text_never_becomes_markup() {
        assert_eq!(escaped("<b> & \"q\""), "&lt;b&gt; &amp; &quot;q&quot;");
        assert!(page("a < b", "").contains("<title>ringwing: a &lt; b</title>"));
    }
}
