//! One line of the summary, and how it fits a terminal.
//!
//! Never knows what it says. The width of the formatter, `{summary:80}`, is that of the terminal; without one, no line
//! is broken.

use crate::output::wrapped;
use std::fmt;

/// What is written for a value that the flight was too short to measure.
pub(super) const NOT_SEEN: &str = "not seen to the end";
/// Narrowest width at which a label and its value share a line. Below it, no place would be left for a remark.
const ONE_LINE_COLUMNS_MIN: usize = 70;
/// Indentation of what follows a label on further lines.
const INDENT: usize = 4;

/// Writes one line: a label, its value and a remark, which continues below itself.
pub(super) fn line(f: &mut fmt::Formatter<'_>, label: &str, value: &str, remark: &str) -> fmt::Result {
    if is_narrow(f) {
        writeln!(f, "  {label}")?;
        return paragraph(f, &" ".repeat(INDENT), format!("{value} {remark}").trim_end());
    }
    paragraph(f, &format!("  {label:<34} {value:<14} "), remark)
}

/// Whether the terminal has no place for the columns of the summary.
pub(super) fn is_narrow(f: &fmt::Formatter<'_>) -> bool {
    f.width().is_some_and(|columns| columns < ONE_LINE_COLUMNS_MIN)
}

/// Writes `head` and `text`, whose further lines stand below its first one.
pub(super) fn paragraph(f: &mut fmt::Formatter<'_>, head: &str, text: &str) -> fmt::Result {
    let indent = head.chars().count();
    // Without a width, the text is not for a terminal, so no line has to be broken.
    let columns = f.width().map_or(usize::MAX, |columns| columns.saturating_sub(indent));
    let mut head = head.to_owned();
    for part in wrapped(text, columns) {
        writeln!(f, "{}", format!("{head}{part}").trim_end())?;
        head = " ".repeat(indent);
    }
    Ok(())
}
