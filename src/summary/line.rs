//! One line of the summary.
//!
//! Never knows what it says.

use std::fmt;

/// What is written for a value that the flight was too short to measure.
pub(super) const NOT_SEEN: &str = "not seen to the end";

/// Writes one line: a label, its value and a remark.
pub(super) fn line(f: &mut fmt::Formatter<'_>, label: &str, value: &str, remark: &str) -> fmt::Result {
    writeln!(f, "{}", format!("  {label:<34} {value:<14} {remark}").trim_end())
}
