//! Heat maps as SVG: panels of coloured cells over two axes, side by side, with one colour bar.
//!
//! Written by hand and not with plotters, because a page has to find each cell again: it carries its number as
//! `data-cell`. Colours are attributes, so a page may change those of text and lines for a dark screen, and a paper gets
//! black on white.

use crate::html::escaped;
use std::fmt::Write;

/// Largest width of a cell, in pixels. Larger ones make small maps clumsy.
const CELL_MAX: f64 = 64.0;
/// Width that all panels of a row share, in pixels: that of a page's text column.
const WIDTH: f64 = 940.0;
/// Narrowest cell that still has room for its text, in pixels.
const TEXT_MIN: f64 = 34.0;
/// Smallest cell, in pixels. Smaller ones cannot be hit with a finger.
const CELL_MIN: f64 = 14.0;
/// Room for the labels of the vertical axis, in pixels. Less cuts labels, here and in the three below; more makes cells smaller.
const LEFT: f64 = 74.0;
/// Room below the cells.
const BELOW: f64 = 52.0;
/// Room above the cells.
const ABOVE: f64 = 30.0;
/// Room for the colour bar.
const BAR: f64 = 58.0;
/// Colours from the lowest value to the highest: viridis, which keeps its order in grey and for colour-blind eyes.
const COLOURS: [[f64; 3]; 6] = [
    [68.0, 1.0, 84.0],
    [65.0, 68.0, 135.0],
    [42.0, 120.0, 142.0],
    [34.0, 168.0, 132.0],
    [122.0, 209.0, 81.0],
    [253.0, 231.0, 37.0],
];

/// A panel: a map over two axes.
#[derive(Debug, Clone, Default)]
pub struct HeatMap {
    /// What sets it apart from the other panels.
    pub title: String,
    /// What the horizontal axis shows, and its values.
    pub x: (String, Vec<String>),
    /// What the vertical axis shows, and its values from the bottom up.
    pub y: (String, Vec<String>),
    /// The cells, row by row from the bottom; `None` leaves a gap.
    pub cells: Vec<Option<HeatCell>>,
}

/// A cell of a map.
#[derive(Debug, Clone, PartialEq)]
pub struct HeatCell {
    /// Its number, for the page.
    pub number: u64,
    /// Its value on the scale; `None` if it has none.
    pub value: Option<f64>,
    /// What is written into it.
    pub text: String,
    /// What it says when somebody points at it.
    pub detail: String,
}

/// What the colours of all panels mean.
#[derive(Debug, Clone, PartialEq)]
pub struct ColourScale {
    /// What the colour shows, with its unit.
    pub label: String,
    /// The value of the first colour.
    pub low: f64,
    /// The value of the last colour.
    pub high: f64,
    /// Texts of both ends.
    pub ends: [String; 2],
}

impl ColourScale {
    /// Where `value` is on the scale, from 0 to 1.
    fn place(&self, value: f64) -> f64 {
        // With a single value the range is zero, and dividing by it gives no number.
        if self.high > self.low { ((value - self.low) / (self.high - self.low)).clamp(0.0, 1.0) } else { 0.5 }
    }
}

/// Draws the panels side by side, in as many rows as they need.
pub fn svg(panels: &[HeatMap], scale: &ColourScale) -> String {
    let layout = Layout::of(panels);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" class=\"heat\" width=\"{0:.0}\" height=\"{1:.0}\" viewBox=\"0 0 {0:.0} {1:.0}\" \
         font-family=\"sans-serif\" font-size=\"12\" role=\"img\" aria-label=\"{2}\">\n",
        layout.width,
        layout.height,
        escaped(&scale.label)
    );
    for (index, panel) in panels.iter().enumerate() {
        draw_panel(&mut svg, panel, scale, &layout, layout.corner(index));
    }
    draw_bar(&mut svg, scale, &layout);
    svg.push_str("</svg>\n");
    svg
}

/// Where everything goes, in pixels.
struct Layout {
    cell: f64,
    panel: (f64, f64),
    columns: usize,
    width: f64,
    height: f64,
}

impl Layout {
    fn of(panels: &[HeatMap]) -> Self {
        let most = |axis: fn(&HeatMap) -> usize| panels.iter().map(axis).max().unwrap_or(1).max(1) as f64;
        let (across, up) = (most(|panel| panel.x.1.len()), most(|panel| panel.y.1.len()));
        // Two panels in a row leave cells that have room for their text; more would not.
        let columns = panels.len().clamp(1, 2);
        let room = (WIDTH - BAR) / columns as f64 - LEFT;
        let cell = (room / across).clamp(CELL_MIN, CELL_MAX);
        let panel = (LEFT + cell * across + 12.0, ABOVE + cell * up + BELOW);
        let rows = panels.len().div_ceil(columns).max(1);
        Self {
            cell,
            panel,
            columns,
            width: panel.0 * columns as f64 + BAR,
            // A map of one row still needs room for the colour bar and its label.
            height: (panel.1 * rows as f64).max(150.0),
        }
    }

    fn corner(&self, index: usize) -> (f64, f64) {
        ((index % self.columns) as f64 * self.panel.0, (index / self.columns) as f64 * self.panel.1)
    }
}

fn draw_panel(svg: &mut String, panel: &HeatMap, scale: &ColourScale, layout: &Layout, (x, y): (f64, f64)) {
    let cell = layout.cell;
    let (across, up) = (panel.x.1.len(), panel.y.1.len());
    let _ = writeln!(svg, "<g transform=\"translate({x:.0} {y:.0})\">");
    text(svg, LEFT + cell * across as f64 / 2.0, 18.0, "middle", &panel.title, " font-weight=\"bold\"");
    for (index, heat) in panel.cells.iter().enumerate() {
        let (column, row) = (index % across.max(1), index / across.max(1));
        // Rows count from the bottom, but y grows downwards in SVG.
        let corner = (LEFT + cell * column as f64, ABOVE + cell * (up - 1 - row) as f64);
        draw_cell(svg, heat.as_ref(), scale, cell, corner);
    }
    let bottom = ABOVE + cell * up as f64;
    // Labels closer than 40 pixels would overlap, so narrow cells share one.
    let every = (40.0 / cell).ceil() as usize;
    for (index, label) in panel.x.1.iter().enumerate().step_by(every.max(1)) {
        text(svg, LEFT + cell * (index as f64 + 0.5), bottom + 16.0, "middle", label, "");
    }
    for (index, label) in panel.y.1.iter().enumerate() {
        text(svg, LEFT - 6.0, bottom - cell * (index as f64 + 0.5) + 4.0, "end", label, "");
    }
    text(svg, LEFT + cell * across as f64 / 2.0, bottom + 36.0, "middle", &panel.x.0, "");
    let middle = ABOVE + cell * up as f64 / 2.0;
    let turned = format!(" transform=\"rotate(-90 14 {middle:.1})\"");
    text(svg, 14.0, middle, "middle", &panel.y.0, &turned);
    svg.push_str("</g>\n");
}

fn draw_cell(svg: &mut String, heat: Option<&HeatCell>, scale: &ColourScale, size: f64, (x, y): (f64, f64)) {
    let Some(heat) = heat else { return };
    let place = heat.value.map(|value| scale.place(value));
    // Grey is not on the scale, so a cell without a value cannot be mistaken for one with a value.
    let (fill, ink) =
        place.map_or_else(|| ("#cccccc".to_owned(), "#222222"), |place| (colour(place), ink_on(place)));
    let _ = write!(
        svg,
        "<g class=\"cell\" data-cell=\"{}\" tabindex=\"0\" role=\"button\"><title>{}</title><rect x=\"{x:.1}\" y=\"{y:.1}\" \
         width=\"{:.1}\" height=\"{:.1}\" fill=\"{fill}\"/>",
        heat.number,
        escaped(&heat.detail),
        size - 1.0,
        size - 1.0
    );
    if size >= TEXT_MIN {
        let _ = write!(
            svg,
            "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\" font-size=\"11\" fill=\"{ink}\">{}</text>",
            x + size / 2.0,
            y + size / 2.0 + 4.0,
            escaped(&heat.text)
        );
    }
    svg.push_str("</g>\n");
}

fn draw_bar(svg: &mut String, scale: &ColourScale, layout: &Layout) {
    const STEPS: u32 = 24;
    let (x, top, bottom) = (layout.width - BAR + 14.0, ABOVE, (layout.panel.1 - BELOW).max(ABOVE + 60.0));
    let step = (bottom - top) / f64::from(STEPS);
    for index in 0..STEPS {
        let place = (f64::from(index) + 0.5) / f64::from(STEPS);
        // Each step is 0.3 pixels too high: viewers would show hairlines between steps that only touch.
        let y = bottom - step * f64::from(index + 1);
        let fill = colour(place);
        let _ = writeln!(
            svg,
            "<rect x=\"{x:.1}\" y=\"{y:.2}\" width=\"12\" height=\"{:.2}\" fill=\"{fill}\"/>",
            step + 0.3
        );
    }
    text(svg, x + 6.0, top - 6.0, "middle", &scale.ends[1], "");
    text(svg, x + 6.0, bottom + 15.0, "middle", &scale.ends[0], "");
    let middle = f64::midpoint(top, bottom);
    let turned = format!(" transform=\"rotate(-90 {:.1} {middle:.1})\"", x + 28.0);
    text(svg, x + 28.0, middle, "middle", &scale.label, &turned);
}

fn text(svg: &mut String, x: f64, y: f64, anchor: &str, text: &str, more: &str) {
    let text = escaped(text);
    let _ = writeln!(
        svg,
        "<text class=\"ink\" fill=\"#222222\" x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\"{more}>{text}</text>"
    );
}

/// The colour at `place` of the scale, from 0 to 1.
fn colour(place: f64) -> String {
    let along = place * (COLOURS.len() - 1) as f64;
    // The last colour has no next one, so place 1 is the upper end of the last pair.
    let below = (along.floor() as usize).min(COLOURS.len() - 2);
    let share = along - below as f64;
    let channel = |index: usize| {
        (COLOURS[below][index] * (1.0 - share) + COLOURS[below + 1][index] * share).round() as u8
    };
    format!("#{:02x}{:02x}{:02x}", channel(0), channel(1), channel(2))
}

/// Black or white, whichever can be read on the colour at `place`.
fn ink_on(place: f64) -> &'static str {
    // The third colour of six is the darkest on which black is easier to read than white.
    if place > 0.55 { "#111111" } else { "#ffffff" }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scale() -> ColourScale {
        ColourScale { label: "success".into(), low: 0.0, high: 1.0, ends: ["0 %".into(), "100 %".into()] }
    }

    fn map() -> HeatMap {
        let cell = |number: u64, value| {
            Some(HeatCell { number, value, text: format!("c{number}"), detail: "a < b".into() })
        };
        HeatMap {
            title: "paper".into(),
            x: ("delay".into(), vec!["0".into(), "1".into()]),
            y: ("loss".into(), vec!["0".into(), "50".into()]),
            cells: vec![cell(0, Some(1.0)), cell(1, Some(0.0)), cell(2, None), None],
        }
    }

    #[test]
    fn every_cell_can_be_found_by_its_number_and_text_never_becomes_markup() {
        let svg = svg(&[map()], &scale());
        assert_eq!(svg.matches("class=\"cell\"").count(), 3);
        for number in 0..3 {
            assert!(svg.contains(&format!("data-cell=\"{number}\"")));
        }
        assert!(svg.contains("<title>a &lt; b</title>") && !svg.contains("a < b"));
    }

    #[test]
    fn the_first_row_is_at_the_bottom() {
        let svg = svg(&[map()], &scale());
        let y_of = |number: u64| -> f64 {
            let after = svg.split(&format!("data-cell=\"{number}\"")).nth(1).unwrap();
            after.split(" y=\"").nth(1).unwrap().split('"').next().unwrap().parse().unwrap()
        };
        assert!(y_of(0) > y_of(2) && y_of(0) == y_of(1));
    }

    #[test]
    fn the_ends_of_the_scale_have_the_ends_of_the_colours() {
        assert_eq!((colour(0.0), colour(1.0)), ("#440154".into(), "#fde725".into()));
        assert_eq!((scale().place(-1.0), scale().place(2.0)), (0.0, 1.0));
    }
}
