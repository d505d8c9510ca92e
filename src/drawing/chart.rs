//! One chart as SVG: axes with units, lines, a legend beside the plot.
//!
//! Never draws more points than a picture can show; what is left out keeps every peak.

use super::scale::{Axis, Scale};
use plotters::{coord::Shift, prelude::*};

/// Plotters places by whole pixels: drawn this much larger, curves are smooth.
pub(super) const SCALE: u32 = 4;
pub(super) const WIDTH: u32 = 960;
const LEGEND: u32 = 170;
pub(super) const LETTERS: u32 = 13;
const HEIGHT: u32 = 320;
/// Of the legend.
const ROW: u32 = 19;
/// What the axes and margins take of width and height.
const AXES: (u32, u32) = (84, 66);

/// Why a picture could not be drawn.
pub(crate) type Fault = Box<dyn std::error::Error + Send + Sync>;

/// How a line is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Stroke {
    /// Through.
    Solid,
    /// Broken: limits and wishes.
    Dashed,
    /// Through, with a dot at each point: what lies between was not measured.
    Dotted,
    /// Through, and everything within.
    Filled,
}

/// One line; it breaks where there is no point.
#[derive(Debug, Clone)]
pub(crate) struct Line {
    pub(crate) name: String,
    pub(crate) colour: RGBColor,
    pub(crate) stroke: Stroke,
    pub(crate) points: Vec<Option<(f64, f64)>>,
}

/// What a chart shows.
#[derive(Debug, Clone, Default)]
pub(crate) struct Chart {
    pub(crate) x: &'static str,
    pub(crate) y: &'static str,
    pub(crate) lines: Vec<Line>,
    /// One metre is as long on both axes.
    pub(crate) is_map: bool,
    /// What the values along x stand for.
    pub(crate) x_scale: Scale,
    /// What the values along y stand for.
    pub(crate) y_scale: Scale,
    /// The values are rows without a number.
    pub(crate) is_rows: bool,
    /// Points of a line at most.
    pub(crate) detail: usize,
}

/// From where to where an axis goes.
#[derive(Clone, Copy)]
pub(super) struct Extent {
    pub(super) low: f64,
    pub(super) high: f64,
}

impl Extent {
    fn of(values: impl Iterator<Item = f64>) -> Self {
        let none = Self { low: f64::INFINITY, high: f64::NEG_INFINITY };
        let widen =
            |extent: Self, value: f64| Self { low: extent.low.min(value), high: extent.high.max(value) };
        let extent = values.filter(|value| value.is_finite()).fold(none, widen);
        if extent.low > extent.high { Self { low: 0.0, high: 1.0 } } else { extent }
    }

    pub(super) fn size(self) -> f64 {
        self.high - self.low
    }

    /// With some room at both ends, and at least `least` long.
    fn padded(self, share: f64, least: f64) -> Self {
        let room = (share * self.size()).max((least - self.size()) / 2.0).max(1e-9);
        Self { low: self.low - room, high: self.high + room }
    }
}

impl Chart {
    /// The picture.
    pub(crate) fn svg(&self) -> Result<String, Fault> {
        let points = || self.lines.iter().flat_map(|line| line.points.iter().flatten());
        let mut x = Extent::of(points().map(|(x, _)| *x));
        let mut y = Extent::of(points().map(|(_, y)| *y));
        y = y.padded(0.06, 0.2 * y.low.abs().max(y.high.abs()));
        let mut height = HEIGHT;
        if self.is_map {
            x = x.padded(0.02, 10.0);
            height = self.map_height(x, y);
            // What the picture is higher than the map shows more of it.
            let shown = f64::from(height - AXES.1) / f64::from(WIDTH - LEGEND - AXES.0);
            y = y.padded(0.0, shown * x.size());
        }
        let mut svg = String::new();
        let root = SVGBackend::with_string(&mut svg, (WIDTH * SCALE, height * SCALE)).into_drawing_area();
        root.fill(&WHITE)?;
        let (plot, legend) = root.split_horizontally((WIDTH - LEGEND) * SCALE);
        self.draw_plot(&plot, x, y)?;
        self.draw_legend(&legend)?;
        root.present()?;
        drop((plot, legend, root));
        Ok(sized(&svg, height))
    }

    /// Such that a metre is as long upwards, and the legend has room.
    fn map_height(&self, x: Extent, y: Extent) -> u32 {
        let width = f64::from(WIDTH - LEGEND - AXES.0);
        let legend = 30 + ROW * self.legend().len() as u32;
        ((width * y.size() / x.size()).min(700.0) as u32 + AXES.1).max(legend)
    }

    /// The lines that have a name, each name once.
    fn legend(&self) -> Vec<&Line> {
        let mut named: Vec<&Line> = Vec::new();
        for line in self.lines.iter().filter(|line| !line.name.is_empty()) {
            if named.iter().all(|other| other.name != line.name) {
                named.push(line);
            }
        }
        named
    }

    fn draw_plot(&self, area: &Area, x: Extent, y: Extent) -> Result<(), Fault> {
        let font = ("sans-serif", LETTERS * SCALE);
        let rows = if self.is_rows { 0 } else { 7 };
        let mut chart = ChartBuilder::on(area)
            .margin(10 * SCALE)
            .x_label_area_size(46 * SCALE)
            .y_label_area_size(64 * SCALE)
            .build_cartesian_2d(Axis::new(self.x_scale, x, 10), Axis::new(self.y_scale, y, rows))?;
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
        for line in &self.lines {
            for part in parts(&thinned(&line.points, self.detail.max(100))) {
                draw_part(&mut chart, line, part)?;
            }
        }
        Ok(())
    }

    fn draw_legend(&self, area: &Area) -> Result<(), Fault> {
        for (index, line) in (0..).zip(self.legend()) {
            let row = ((20 + ROW * index) * SCALE).cast_signed();
            draw_sample(area, line, row)?;
            let font = ("sans-serif", LETTERS * SCALE).into_font();
            area.draw(&Text::new(line.name.clone(), (at(36), row - at(7)), font))?;
        }
        Ok(())
    }
}

/// A length as it is drawn.
pub(super) fn at(pixels: u32) -> i32 {
    (pixels * SCALE).cast_signed()
}

/// A stretch of a line.
fn draw_part(chart: &mut Plot, line: &Line, part: Vec<(f64, f64)>) -> Result<(), Fault> {
    let style = line.colour.stroke_width(2 * SCALE - SCALE / 2);
    match line.stroke {
        Stroke::Solid => drop(chart.draw_series(LineSeries::new(part, style))?),
        Stroke::Dotted => {
            let dots = LineSeries::new(part, style.filled()).point_size(3 * SCALE);
            chart.draw_series(dots)?;
        }
        Stroke::Dashed => drop(chart.draw_series(DashedLineSeries::new(part, at(6), at(4), style))?),
        Stroke::Filled => {
            let inside = Polygon::new(part, line.colour.mix(0.5).filled());
            chart.draw_series(std::iter::once(inside))?;
        }
    }
    Ok(())
}

/// How a line looks, for the legend.
fn draw_sample(area: &Area, line: &Line, row: i32) -> Result<(), Fault> {
    let style = line.colour.stroke_width(2 * SCALE);
    let dash = |from, to| area.draw(&PathElement::new([(at(from), row), (at(to), row)], style));
    match line.stroke {
        Stroke::Dashed => [(4, 11), (15, 22), (26, 30)].iter().try_for_each(|(from, to)| dash(*from, *to))?,
        Stroke::Solid | Stroke::Dotted => dash(4, 30)?,
        Stroke::Filled => {
            let corners = [(at(4), row - at(5)), (at(30), row + at(5))];
            area.draw(&Rectangle::new(corners, line.colour.mix(0.5).filled()))?;
        }
    }
    Ok(())
}

type Plot<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<Axis, Axis>>;
pub(super) type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// The picture at its own size, drawn larger within; lines bend round.
pub(super) fn sized(svg: &str, height: u32) -> String {
    let drawn = format!("<svg width=\"{}\" height=\"{}\"", WIDTH * SCALE, height * SCALE);
    let wanted = format!("<svg width=\"{WIDTH}\" height=\"{height}\" stroke-linejoin=\"round\"");
    svg.replacen(&drawn, &wanted, 1)
}

/// At most about `most` points: of each stretch the lowest and the highest; breaks are kept.
fn thinned(points: &[Option<(f64, f64)>], most: usize) -> Vec<Option<(f64, f64)>> {
    if points.len() <= most {
        return points.to_vec();
    }
    let stretch = points.len().div_ceil(most / 2);
    let mut kept = Vec::with_capacity(most + 2);
    for stretch in points.chunks(stretch) {
        let there = || stretch.iter().enumerate().filter_map(|(index, point)| Some((index, (*point)?)));
        let low = there().min_by(|a, b| a.1.1.total_cmp(&b.1.1));
        let high = there().max_by(|a, b| a.1.1.total_cmp(&b.1.1));
        let mut both: Vec<_> = low.into_iter().chain(high).collect();
        both.sort_by_key(|(index, _)| *index);
        both.dedup_by_key(|(index, _)| *index);
        kept.extend(both.into_iter().map(|(_, point)| Some(point)));
        if stretch.iter().any(Option::is_none) {
            kept.push(None);
        }
    }
    kept
}

/// The stretches between breaks.
fn parts(points: &[Option<(f64, f64)>]) -> Vec<Vec<(f64, f64)>> {
    let finite = |point: &(f64, f64)| point.0.is_finite() && point.1.is_finite();
    points
        .split(|point| !point.as_ref().is_some_and(finite))
        .filter(|part| !part.is_empty())
        .map(|part| part.iter().copied().flatten().collect())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thinning_keeps_peaks_and_breaks() {
        let mut points: Vec<_> = (0..10_000).map(|x| Some((f64::from(x), 0.0))).collect();
        points[5_003] = Some((5_003.0, 9.0));
        points[7_000] = None;
        let kept = thinned(&points, 400);
        assert!(kept.len() <= 402, "{}", kept.len());
        assert!(kept.contains(&Some((5_003.0, 9.0))));
        assert_eq!(parts(&kept).len(), 2);
    }
}
