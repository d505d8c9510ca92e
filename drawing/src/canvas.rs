//! The SVG canvas that charts and strips draw on: its size, its resolution and its errors.
//!
//! Must never draw anything itself.

use plotters::{coord::Shift, drawing::DrawingAreaErrorKind, prelude::*};

/// Canvas units per pixel of the finished picture. Plotters rounds coordinates to whole canvas units, so a smaller factor
/// makes curves visibly jagged, and a larger one makes files longer.
pub(crate) const SCALE: u32 = 4;
/// Width of every picture, in pixels: that of a page's text column. A wider picture is scaled down with its text.
pub(crate) const WIDTH: u32 = 960;
/// Height of the text, in pixels. Larger labels overlap; smaller ones are hard to read.
pub(crate) const FONT_SIZE: u32 = 13;

/// The picture, or the part of it that is being drawn.
pub(crate) type Canvas<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// Why a picture cannot be drawn.
#[derive(Debug, thiserror::Error)]
#[error("a picture cannot be drawn: {0}")]
pub struct DrawingError(#[from] DrawingAreaErrorKind<SvgError>);

type SvgError = <SVGBackend<'static> as DrawingBackend>::ErrorType;

/// Converts a length from pixels to canvas units.
pub(crate) fn units(pixels: u32) -> i32 {
    (pixels * SCALE).cast_signed()
}

/// Runs `draw` on a white canvas that is `height` pixels high, and returns the picture as SVG.
pub(crate) fn draw_svg(
    height: u32,
    draw: impl FnOnce(&Canvas) -> Result<(), DrawingError>,
) -> Result<String, DrawingError> {
    let mut svg = String::new();
    let root = SVGBackend::with_string(&mut svg, (WIDTH * SCALE, height * SCALE)).into_drawing_area();
    root.fill(&WHITE)?;
    draw(&root)?;
    root.present()?;
    // The area borrows the string until it is dropped.
    drop(root);
    Ok(sized(&svg, height))
}

/// Displays the picture at its size in pixels, whatever the resolution of its canvas.
fn sized(svg: &str, height: u32) -> String {
    let drawn = format!("<svg width=\"{}\" height=\"{}\"", WIDTH * SCALE, height * SCALE);
    // Mitered joins would stick out of noisy curves.
    let wanted = format!("<svg width=\"{WIDTH}\" height=\"{height}\" stroke-linejoin=\"round\"");
    svg.replacen(&drawn, &wanted, 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_has_its_size_in_pixels_and_a_finer_canvas() {
        let svg = draw_svg(100, |_| Ok(())).unwrap();
        assert!(svg.starts_with("<svg width=\"960\" height=\"100\""), "{svg}");
        assert!(svg.contains("viewBox=\"0 0 3840 400\""), "{svg}");
    }
}
