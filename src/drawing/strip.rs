//! A strip over time as SVG: a row for each subject, a cell for each piece of its time, its colour how much that was.
//!
//! Never compares rows by colour: a row's values are multiples of its own.

use super::chart::{Area, Fault, LETTERS, SCALE, WIDTH, at, sized};
use plotters::{
    prelude::*,
    style::colors::colormaps::{ColorMap, ViridisRGB},
};

const ROW: u32 = 22;
/// What names take of the width.
const NAMES: u32 = 300;
/// What the key below takes of the height.
const KEY: u32 = 52;
/// Between groups of a row.
const GAP: f64 = 3.0;
const TOP: u32 = 8;
/// What a cell reaches into the next, in drawn pixels, so that no seam shows between them.
const OVERLAP: i32 = 2;

/// One row.
#[derive(Debug, Clone)]
pub(crate) struct Row {
    pub(crate) name: String,
    /// Multiples of what is usual in this row, over time; groups are set apart, and none is a piece without a value.
    pub(crate) groups: Vec<Vec<Option<f64>>>,
}

/// What the colours mean.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Key {
    /// What the values are multiples of.
    pub(crate) unit: &'static str,
    /// The multiples that are named, rising: from the darkest colour to the brightest.
    pub(crate) marks: &'static [f64],
}

impl Key {
    /// The logarithm of `multiple` decides; what is beyond an end has that end's colour.
    fn colour(self, multiple: f64) -> RGBColor {
        let ends = self.marks.first().zip(self.marks.last());
        let (low, high) = ends.map_or((1.0, 10.0), |(low, high)| (*low, *high));
        ViridisRGB.get_color_normalized(multiple.log10(), low.log10(), high.log10())
    }
}

/// The picture.
pub(crate) fn svg(rows: &[Row], key: Key) -> Result<String, Fault> {
    let height = TOP + ROW * rows.len() as u32 + KEY;
    let mut svg = String::new();
    let root = SVGBackend::with_string(&mut svg, (WIDTH * SCALE, height * SCALE)).into_drawing_area();
    root.fill(&WHITE)?;
    for (index, row) in (0..).zip(rows) {
        draw_row(&root, row, TOP + ROW * index, key)?;
    }
    draw_key(&root, TOP + ROW * rows.len() as u32, key)?;
    root.present()?;
    drop(root);
    Ok(sized(&svg, height))
}

fn draw_row(area: &Area, row: &Row, top: u32, key: Key) -> Result<(), Fault> {
    write(area, &row.name, (at(4), at(top + 3)))?;
    let cells: usize = row.groups.iter().map(Vec::len).sum();
    let gaps = row.groups.len().saturating_sub(1) as f64 * GAP;
    let width = (f64::from(WIDTH - NAMES - 10) - gaps) / cells.max(1) as f64;
    let mut left = f64::from(NAMES);
    for group in &row.groups {
        for value in group {
            if let Some(value) = value {
                let (from, to) = (place(left), place(left + width) + OVERLAP);
                area.draw(&Rectangle::new(
                    [(from, at(top)), (to, at(top + ROW - 4))],
                    key.colour(*value).filled(),
                ))?;
            }
            left += width;
        }
        left += GAP;
    }
    Ok(())
}

/// A bar of all colours, with the multiples that they mean.
fn draw_key(area: &Area, top: u32, key: Key) -> Result<(), Fault> {
    let width = 36.0;
    write(area, key.unit, (at(4), at(top + 12)))?;
    for (index, mark) in (0..).zip(key.marks) {
        let left = f64::from(NAMES) + f64::from(index) * (width + 30.0);
        let corners = [(place(left), at(top + 10)), (place(left + width), at(top + 26))];
        area.draw(&Rectangle::new(corners, key.colour(*mark).filled()))?;
        write(area, &format!("x {mark}"), (place(left), at(top + 30)))?;
    }
    Ok(())
}

fn write(area: &Area, text: &str, place: (i32, i32)) -> Result<(), Fault> {
    let font = ("sans-serif", LETTERS * SCALE).into_font();
    Ok(area.draw(&Text::new(text.to_owned(), place, font))?)
}

fn place(pixels: f64) -> i32 {
    (pixels * f64::from(SCALE)).round() as i32
}

#[cfg(test)]
mod tests {
    use super::*;

    const LONGEST: Key = Key { unit: "times the median", marks: &[1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0] };

    #[test]
    fn every_piece_has_its_cell_and_what_is_missing_has_none() {
        let groups = vec![vec![Some(1.0), Some(80.0)], vec![None, Some(3.0)]];
        let svg = svg(&[Row { name: "swarm <6>".into(), groups }], LONGEST).unwrap();
        // The ground, three cells, and the key.
        assert_eq!(svg.matches("<rect").count(), 1 + 3 + LONGEST.marks.len());
        assert!(svg.contains("swarm &lt;6&gt;") && svg.contains("times the median"), "{svg}");
    }

    #[test]
    fn more_is_brighter_and_beyond_the_ends_nothing_changes() {
        // Luminance as Rec. 709 weighs it.
        let light = |multiple: f64| {
            let RGBColor(red, green, blue) = LONGEST.colour(multiple);
            0.2126 * f64::from(red) + 0.7152 * f64::from(green) + 0.0722 * f64::from(blue)
        };
        let lights: Vec<f64> = LONGEST.marks.iter().map(|mark| light(*mark)).collect();
        assert!(lights.is_sorted_by(|darker, brighter| darker < brighter), "{lights:?}");
        assert_eq!(LONGEST.colour(0.2), LONGEST.colour(1.0));
        assert_eq!(LONGEST.colour(1e6), LONGEST.colour(100.0));
    }
}
