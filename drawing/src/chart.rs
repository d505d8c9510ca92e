//! A line chart as SVG: two axes with units, lines, and a legend beside the plot.
//!
//! Must never draw more points than a picture can show; when it drops points, every peak stays.

use crate::{
    canvas::{Canvas, DrawingError, FONT_SIZE, SCALE, WIDTH, draw_svg, units},
    extent::Extent,
    scale::{Axis, Scale},
};
use plotters::prelude::*;

/// Width of the legend, in pixels. Less cuts long names; more takes room from the plot.
const LEGEND: u32 = 170;
/// Height of a chart that is not a map, in pixels. Lower charts flatten curves; higher ones need more scrolling.
const HEIGHT: u32 = 320;
/// Largest height of a map, in pixels, so that one fits a screen.
const MAX_MAP_HEIGHT: f64 = 700.0;
/// Height of a row of the legend, in pixels. Less lets names overlap; more lists fewer lines beside the plot.
const ROW: u32 = 19;
/// Width and height that axes and margins take from the plot, in pixels. Less cuts labels; more makes the plot
/// smaller.
const AXES: (u32, u32) = (84, 66);
/// Opacity of bands. A higher one hides lines and grid; at a lower one bands are hard to see in print.
const SHADE: f64 = 0.12;
/// Angle between the heading of an arrow and each of its barbs. A larger one looks like a dart, a smaller one like a cross bar.
const ARROW_RAD: f64 = 2.6;
/// Least number of points that a line may keep. Fewer would show corners in smooth curves.
const MIN_DETAIL: usize = 100;

/// How a line is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stroke {
    /// An unbroken line.
    Solid,
    /// A dashed line, for limits and requirements.
    Dashed,
    /// A line with a dot at each point: nothing was measured between the dots.
    Dotted,
    /// A closed shape, filled.
    Filled,
}

/// One line of a chart.
#[derive(Debug, Clone)]
pub struct Curve {
    /// Name in the legend; without one, the line is not listed.
    pub name: String,
    /// Colour of the line.
    pub colour: RGBColor,
    /// How the line is drawn.
    pub stroke: Stroke,
    /// The points in order; `None` breaks the line.
    pub points: Vec<Option<(f64, f64)>>,
}

/// A stretch of the horizontal axis that is shaded behind the lines, such as the time of a fault.
#[derive(Debug, Clone, PartialEq)]
pub struct Band {
    /// What happens there; bands of one name share a row in the legend.
    pub name: String,
    /// Colour of the shade, which is drawn almost transparent.
    pub colour: RGBColor,
    /// Where it begins.
    pub from: f64,
    /// Where it ends.
    pub to: f64,
}

/// How a single point is marked.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Symbol {
    /// By its text alone.
    Text,
    /// By an arrow with this heading from the x axis, counterclockwise, in rad.
    Arrow(f64),
    /// By a cross.
    Cross,
}

/// A marked point.
#[derive(Debug, Clone, PartialEq)]
pub struct Mark {
    /// Where it is.
    pub at: (f64, f64),
    /// What is written beside it; may be empty.
    pub text: String,
    /// How it is marked.
    pub symbol: Symbol,
    /// Colour of text and symbol.
    pub colour: RGBColor,
}

/// A chart.
#[derive(Debug, Clone, Default)]
pub struct Chart {
    /// What the horizontal axis shows, with its unit.
    pub x: &'static str,
    /// What the vertical axis shows, with its unit.
    pub y: &'static str,
    /// The lines; later ones cover earlier ones.
    pub lines: Vec<Curve>,
    /// What is shaded behind the lines.
    pub bands: Vec<Band>,
    /// Points with a mark, above the lines.
    pub marks: Vec<Mark>,
    /// Whether the vertical axis begins at 0, so that small changes of a large value look small.
    pub from_zero: bool,
    /// Whether a unit has the same length on both axes.
    pub is_map: bool,
    /// What the numbers along the horizontal axis mean.
    pub x_scale: Scale,
    /// What the numbers along the vertical axis mean.
    pub y_scale: Scale,
    /// Whether the vertical axis only separates rows, and so has no labels.
    pub is_rows: bool,
    /// Largest number of points per line, at least 100. Larger makes the file longer; smaller hides detail between peaks.
    pub detail: usize,
}

impl Chart {
    /// Draws the chart.
    pub fn svg(&self) -> Result<String, DrawingError> {
        let points = || self.lines.iter().flat_map(|line| line.points.iter().flatten());
        let mut x = Extent::of(points().map(|(x, _)| *x));
        let mut y = Extent::of(points().map(|(_, y)| *y));
        // The axis spans at least a fifth of the largest value. On a closer view, rounding noise would look like a
        // signal.
        y = y.padded(0.06, 0.2 * y.low.abs().max(y.high.abs()));
        if self.from_zero {
            y.low = 0.0;
        }
        let mut height = HEIGHT;
        if self.is_map {
            x = x.padded(0.02, 10.0);
            height = self.map_height(x, y);
            // The legend may need more height than the map; the map then shows more of its surroundings.
            let height_to_width = f64::from(height - AXES.1) / f64::from(WIDTH - LEGEND - AXES.0);
            y = y.padded(0.0, height_to_width * x.size());
        }
        draw_svg(height, |area| {
            let (plot, legend) = area.split_horizontally((WIDTH - LEGEND) * SCALE);
            self.draw_plot(&plot, x, y)?;
            self.draw_legend(&legend)
        })
    }

    /// The points of `line` that are drawn.
    pub(crate) fn drawn_points(&self, line: &Curve) -> Vec<Option<(f64, f64)>> {
        thinned(&line.points, self.detail.max(MIN_DETAIL))
    }

    /// The height, in pixels, that makes a unit as long on both axes and leaves room for the legend.
    fn map_height(&self, x: Extent, y: Extent) -> u32 {
        let width = f64::from(WIDTH - LEGEND - AXES.0);
        let legend = 30 + ROW * self.legend().len() as u32;
        ((width * y.size() / x.size()).min(MAX_MAP_HEIGHT) as u32 + AXES.1).max(legend)
    }

    /// The first line of each name.
    pub(crate) fn legend(&self) -> Vec<&Curve> {
        let mut named: Vec<&Curve> = Vec::new();
        for line in self.lines.iter().filter(|line| !line.name.is_empty()) {
            if named.iter().all(|other| other.name != line.name) {
                named.push(line);
            }
        }
        named
    }

    fn draw_plot(&self, area: &Canvas, x: Extent, y: Extent) -> Result<(), DrawingError> {
        let font = ("sans-serif", FONT_SIZE * SCALE);
        let y_ticks = if self.is_rows { 0 } else { 7 };
        let mut chart = ChartBuilder::on(area)
            .margin(10 * SCALE)
            .x_label_area_size(46 * SCALE)
            .y_label_area_size(64 * SCALE)
            .build_cartesian_2d(Axis::new(self.x_scale, x, 10), Axis::new(self.y_scale, y, y_ticks))?;
        chart
            .configure_mesh()
            .x_desc(self.x)
            .y_desc(self.y)
            .label_style(font)
            .axis_desc_style(font)
            .axis_style(BLACK.stroke_width(SCALE))
            .bold_line_style(RGBColor(0xe2, 0xe2, 0xe2).stroke_width(SCALE))
            .light_line_style(TRANSPARENT)
            .draw()?;
        for band in &self.bands {
            draw_band(&mut chart, band, x, y)?;
        }
        for line in &self.lines {
            for stretch in stretches(&self.drawn_points(line)) {
                draw_stretch(&mut chart, line, stretch)?;
            }
        }
        for mark in &self.marks {
            draw_mark(&mut chart, mark)?;
        }
        Ok(())
    }

    fn draw_legend(&self, area: &Canvas) -> Result<(), DrawingError> {
        for (index, line) in (0..).zip(self.legend()) {
            let row = units(20 + ROW * index);
            draw_sample(area, line, row)?;
            let font = ("sans-serif", FONT_SIZE * SCALE).into_font();
            area.draw(&Text::new(line.name.clone(), (units(36), row - units(7)), font))?;
        }
        Ok(())
    }
}

type PlotContext<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<Axis, Axis>>;

/// Draws the part of a line between two breaks.
fn draw_stretch(plot: &mut PlotContext, line: &Curve, points: Vec<(f64, f64)>) -> Result<(), DrawingError> {
    // 1.5 pixels wide: the grid's lines are 1 pixel wide.
    let style = line.colour.stroke_width(2 * SCALE - SCALE / 2);
    // Drop the entry that each series makes for the legend of plotters: the chart draws its own legend.
    match line.stroke {
        Stroke::Solid => drop(plot.draw_series(LineSeries::new(points, style))?),
        Stroke::Dotted => {
            let dots = LineSeries::new(points, style.filled()).point_size(3 * SCALE);
            plot.draw_series(dots)?;
        }
        Stroke::Dashed => drop(plot.draw_series(DashedLineSeries::new(points, units(6), units(4), style))?),
        Stroke::Filled => {
            let inside = Polygon::new(points, line.colour.mix(0.5).filled());
            plot.draw_series(std::iter::once(inside))?;
        }
    }
    Ok(())
}

/// Shades `band` from the bottom to the top of the plot.
fn draw_band(plot: &mut PlotContext, band: &Band, x: Extent, y: Extent) -> Result<(), DrawingError> {
    let (from, to) = (band.from.max(x.low), band.to.min(x.high));
    // A band outside the axis would be drawn over the margins.
    if from < to {
        let corners = [(from, y.low), (to, y.high)];
        plot.draw_series(std::iter::once(Rectangle::new(corners, band.colour.mix(SHADE).filled())))?;
    }
    Ok(())
}

/// Draws the symbol of `mark`, and its text to the right.
fn draw_mark(plot: &mut PlotContext, mark: &Mark) -> Result<(), DrawingError> {
    let style = mark.colour.stroke_width(2 * SCALE);
    let path = |points: Vec<(i32, i32)>| EmptyElement::at(mark.at) + PathElement::new(points, style);
    match mark.symbol {
        Symbol::Text => {}
        Symbol::Arrow(heading_rad) => {
            plot.draw_series(std::iter::once(path(arrow(heading_rad))))?;
        }
        Symbol::Cross => {
            let half = units(5);
            plot.draw_series([
                path(vec![(-half, -half), (half, half)]),
                path(vec![(-half, half), (half, -half)]),
            ])?;
        }
    }
    let font = ("sans-serif", FONT_SIZE * SCALE).into_font().color(&mark.colour);
    let text = Text::new(mark.text.clone(), (units(7), -units(14)), font);
    plot.draw_series(std::iter::once(EmptyElement::at(mark.at) + text))?;
    Ok(())
}

/// The outline of an arrow's head, in canvas units relative to its tip.
fn arrow(heading_rad: f64) -> Vec<(i32, i32)> {
    let corner = |turn: f64| {
        // Canvas units grow downwards.
        let (sin, cos) = (heading_rad + turn).sin_cos();
        let length = f64::from(units(8));
        ((length * cos) as i32, (-length * sin) as i32)
    };
    vec![corner(ARROW_RAD), (0, 0), corner(-ARROW_RAD)]
}

/// Draws a short sample of a line into the legend.
fn draw_sample(area: &Canvas, line: &Curve, row: i32) -> Result<(), DrawingError> {
    let style = line.colour.stroke_width(2 * SCALE);
    let dash = |from, to| area.draw(&PathElement::new([(units(from), row), (units(to), row)], style));
    match line.stroke {
        Stroke::Dashed => [(4, 11), (15, 22), (26, 30)].iter().try_for_each(|(from, to)| dash(*from, *to))?,
        Stroke::Solid | Stroke::Dotted => dash(4, 30)?,
        Stroke::Filled => {
            let corners = [(units(4), row - units(5)), (units(30), row + units(5))];
            area.draw(&Rectangle::new(corners, line.colour.mix(0.5).filled()))?;
        }
    }
    Ok(())
}

/// Reduces `points` to about `most`, by keeping the lowest and the highest point of each interval, and every break.
fn thinned(points: &[Option<(f64, f64)>], most: usize) -> Vec<Option<(f64, f64)>> {
    if points.len() <= most {
        return points.to_vec();
    }
    // Each interval keeps two points.
    let interval = points.len().div_ceil(most / 2);
    let mut kept = Vec::with_capacity(most + 2);
    for interval in points.chunks(interval) {
        let present = || interval.iter().enumerate().filter_map(|(index, point)| Some((index, (*point)?)));
        let low = present().min_by(|a, b| a.1.1.total_cmp(&b.1.1));
        let high = present().max_by(|a, b| a.1.1.total_cmp(&b.1.1));
        // Keep both in their order in time; in a constant interval they are the same point.
        let mut both: Vec<_> = low.into_iter().chain(high).collect();
        both.sort_by_key(|(index, _)| *index);
        both.dedup_by_key(|(index, _)| *index);
        kept.extend(both.into_iter().map(|(_, point)| Some(point)));
        // A break moves to the end of its interval, which is too short a way to be seen.
        if interval.iter().any(Option::is_none) {
            kept.push(None);
        }
    }
    kept
}

/// Splits a line at its breaks; a point that is not finite is a break, too.
fn stretches(points: &[Option<(f64, f64)>]) -> Vec<Vec<(f64, f64)>> {
    let is_finite = |point: &(f64, f64)| point.0.is_finite() && point.1.is_finite();
    points
        .split(|point| !point.as_ref().is_some_and(is_finite))
        .filter(|stretch| !stretch.is_empty())
        .map(|stretch| stretch.iter().copied().flatten().collect())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thinning_keeps_every_peak_and_every_break() {
        let mut points: Vec<_> = (0..10_000).map(|x| Some((f64::from(x), 0.0))).collect();
        points[5_003] = Some((5_003.0, 9.0));
        points[7_000] = None;
        let kept = thinned(&points, 400);
        assert!(kept.len() <= 402, "{}", kept.len());
        assert!(kept.contains(&Some((5_003.0, 9.0))));
        assert_eq!(stretches(&kept).len(), 2);
    }
}
