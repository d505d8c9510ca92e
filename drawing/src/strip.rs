//! A strip chart as SVG: one row per subject, one cell per slice of its time, coloured by the cell's value.
//!
//! Must never invite comparing rows by colour: the values of a row are multiples of that row's own typical value.

use crate::canvas::{Canvas, DrawingError, FONT_SIZE, SCALE, WIDTH, draw_svg, units};
use plotters::{
    prelude::*,
    style::colors::colormaps::{ColorMap, ViridisRGB},
};

/// Height of a row, in pixels, with the gap below it. Less than the text's height lets names overlap.
const ROW: u32 = 22;
/// Width of the names, in pixels. Less cuts the longest names of benchmark cases; more takes room from the cells.
const NAMES: u32 = 300;
/// Height of the colour key, in pixels: a bar and the numbers below it.
const KEY: u32 = 52;
/// Gap between the groups of a row, in pixels; wide enough to be seen beside cells of 2 to 3 pixels.
const GAP: f64 = 3.0;
/// Margin above the first row, in pixels. Less cuts the first name; more only takes room.
const TOP: u32 = 8;
/// Canvas units by which a cell reaches into the next one. With 0, viewers show seams between cells.
const OVERLAP: i32 = 2;

/// One row of a strip chart.
#[derive(Debug, Clone)]
pub struct StripRow {
    /// What the row shows, in at most about 45 characters.
    pub name: String,
    /// The values over time, as multiples of the row's typical value. Groups are set apart by a gap; a cell without a
    /// value stays blank.
    pub groups: Vec<Vec<Option<f64>>>,
}

/// What the colours of a strip chart mean.
#[derive(Debug, Clone, Copy)]
pub struct ColourKey {
    /// What the values are multiples of.
    pub unit: &'static str,
    /// The values that the key names, ascending: the first has the darkest colour, the last the brightest.
    pub marks: &'static [f64],
}

impl ColourKey {
    /// The colour of a value, by its logarithm; values beyond the marks have the colour of the nearest end.
    fn colour(self, value: f64) -> RGBColor {
        let ends = self.marks.first().zip(self.marks.last());
        let (low, high) = ends.map_or((1.0, 10.0), |(low, high)| (*low, *high));
        ViridisRGB.get_color_normalized(value.log10(), low.log10(), high.log10())
    }
}

/// Draws `rows` with the colour key below them.
pub fn svg(rows: &[StripRow], key: ColourKey) -> Result<String, DrawingError> {
    let key_top = TOP + ROW * rows.len() as u32;
    draw_svg(key_top + KEY, |area| {
        for (index, row) in (0..).zip(rows) {
            draw_row(area, row, TOP + ROW * index, key)?;
        }
        draw_key(area, key_top, key)
    })
}

fn draw_row(area: &Canvas, row: &StripRow, top: u32, key: ColourKey) -> Result<(), DrawingError> {
    write(area, &row.name, (units(4), units(top + 3)))?;
    // All cells of a row are equally wide, so rows with the same number of cells line up.
    let cells: usize = row.groups.iter().map(Vec::len).sum();
    let gaps = row.groups.len().saturating_sub(1) as f64 * GAP;
    let width = (f64::from(WIDTH - NAMES - 10) - gaps) / cells.max(1) as f64;
    // Add up unrounded widths and round each edge: rounded widths would add up to a visible error over a row.
    let mut left = f64::from(NAMES);
    for group in &row.groups {
        for value in group {
            if let Some(value) = value {
                let (from, to) = (unit(left), unit(left + width) + OVERLAP);
                let corners = [(from, units(top)), (to, units(top + ROW - 4))];
                area.draw(&Rectangle::new(corners, key.colour(*value).filled()))?;
            }
            left += width;
        }
        left += GAP;
    }
    Ok(())
}

/// Draws one patch of colour per mark, with its value below it.
fn draw_key(area: &Canvas, top: u32, key: ColourKey) -> Result<(), DrawingError> {
    let width = 36.0;
    write(area, key.unit, (units(4), units(top + 12)))?;
    for (index, mark) in (0..).zip(key.marks) {
        let left = f64::from(NAMES) + f64::from(index) * (width + 30.0);
        let corners = [(unit(left), units(top + 10)), (unit(left + width), units(top + 26))];
        area.draw(&Rectangle::new(corners, key.colour(*mark).filled()))?;
        write(area, &format!("x {mark}"), (unit(left), units(top + 30)))?;
    }
    Ok(())
}

fn write(area: &Canvas, text: &str, position: (i32, i32)) -> Result<(), DrawingError> {
    let font = ("sans-serif", FONT_SIZE * SCALE).into_font();
    Ok(area.draw(&Text::new(text.to_owned(), position, font))?)
}

/// Converts a length from fractions of pixels to the nearest canvas unit.
fn unit(pixels: f64) -> i32 {
    (pixels * f64::from(SCALE)).round() as i32
}

#[cfg(test)]
mod tests {
    use super::*;

    const LONGEST: ColourKey =
        ColourKey { unit: "times the median", marks: &[1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0] };

    #[test]
    fn every_value_has_a_cell_and_a_missing_one_stays_blank() {
        let groups = vec![vec![Some(1.0), Some(80.0)], vec![None, Some(3.0)]];
        let svg = svg(&[StripRow { name: "swarm <6>".into(), groups }], LONGEST).unwrap();
        // The background, three cells, and the key.
        assert_eq!(svg.matches("<rect").count(), 1 + 3 + LONGEST.marks.len());
        assert!(svg.contains("swarm &lt;6&gt;") && svg.contains("times the median"), "{svg}");
    }

    #[test]
    fn larger_values_are_brighter_and_colors_stop_at_both_ends() {
        // Luminance by the weights of Rec. 709.
        let luminance = |value: f64| {
            let RGBColor(red, green, blue) = LONGEST.colour(value);
            0.2126 * f64::from(red) + 0.7152 * f64::from(green) + 0.0722 * f64::from(blue)
        };
        let luminances: Vec<f64> = LONGEST.marks.iter().map(|mark| luminance(*mark)).collect();
        assert!(luminances.is_sorted_by(|darker, brighter| darker < brighter), "{luminances:?}");
        assert_eq!(LONGEST.colour(0.2), LONGEST.colour(1.0));
        assert_eq!(LONGEST.colour(1e6), LONGEST.colour(100.0));
    }
}
