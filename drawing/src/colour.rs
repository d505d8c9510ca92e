//! Colours as text, for figures and pictures that are written as text.

use plotters::style::RGBColor;

/// The colour as HTML, SVG and Plotly write it, such as `#0072b2`.
pub(crate) fn hex(RGBColor(red, green, blue): RGBColor) -> String {
    format!("#{red:02x}{green:02x}{blue:02x}")
}
