//! Curves with bands around them as SVG: a value over one axis with its interval, one curve for each of several kinds.
//!
//! Written by hand for the same reason as heat maps: a page has to find the cell of each point again.

use crate::html::escaped;
use std::fmt::Write;

/// Size of a panel's plot, in pixels. Larger ones no longer stand side by side on a page.
const PLOT: (f64, f64) = (360.0, 220.0);
/// Room for the labels of the vertical axis, in pixels. Less cuts labels, here and below; more makes gaps.
const LEFT: f64 = 62.0;
/// Room below the plot.
const BELOW: f64 = 50.0;
/// Room above the plot, for title and legend.
const ABOVE: f64 = 44.0;
/// About how many ticks an axis has. More overlap; fewer leave values to guess.
const TICKS: f64 = 5.0;
/// Colours of the curves, told apart by colour-blind eyes too (Okabe and Ito 2008).
const COLOURS: [&str; 6] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9"];

/// A panel of curves.
#[derive(Debug, Clone, Default)]
pub struct BandChart {
    /// What sets it apart from the other panels.
    pub title: String,
    /// What the horizontal axis shows.
    pub x: String,
    /// What the vertical axis shows.
    pub y: String,
    /// The curves.
    pub curves: Vec<BandCurve>,
}

/// A curve with a band.
#[derive(Debug, Clone, Default)]
pub struct BandCurve {
    /// Its name in the legend.
    pub name: String,
    /// Its points, from left to right.
    pub points: Vec<BandPoint>,
}

/// A point of a curve.
#[derive(Debug, Clone, PartialEq)]
pub struct BandPoint {
    /// Its place on the horizontal axis.
    pub x: f64,
    /// Value, and both ends of the band; `None` where there is no value.
    pub y: Option<[f64; 3]>,
    /// The number of its cell, for the page.
    pub number: u64,
    /// What it says when somebody points at it.
    pub detail: String,
}

/// Draws the panels, two in a row. All share the vertical axis from `low` to `high`, so that they can be compared.
pub fn svg(panels: &[BandChart], low: f64, high: f64) -> String {
    let (width, height) = (LEFT + PLOT.0 + 18.0, ABOVE + PLOT.1 + BELOW);
    // At least one, because the number of rows is a quotient by it.
    let columns = panels.len().clamp(1, 2);
    let rows = panels.len().div_ceil(columns).max(1);
    let (all_width, all_height) = (width * columns as f64, height * rows as f64);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" class=\"bands\" width=\"{all_width:.0}\" height=\"{all_height:.0}\" \
         viewBox=\"0 0 {all_width:.0} {all_height:.0}\" font-family=\"sans-serif\" font-size=\"12\" role=\"img\">\n"
    );
    for (index, panel) in panels.iter().enumerate() {
        let corner = ((index % columns) as f64 * width, (index / columns) as f64 * height);
        let _ = writeln!(svg, "<g transform=\"translate({:.0} {:.0})\">", corner.0, corner.1);
        Plot::new(panel, low, high).draw(&mut svg, panel);
        svg.push_str("</g>\n");
    }
    svg.push_str("</svg>\n");
    svg
}

/// The axes of a panel.
struct Plot {
    x: (f64, f64),
    y: (f64, f64),
}

impl Plot {
    fn new(panel: &BandChart, low: f64, high: f64) -> Self {
        let xs = || panel.curves.iter().flat_map(|curve| curve.points.iter().map(|point| point.x));
        let x = (xs().fold(f64::INFINITY, f64::min), xs().fold(f64::NEG_INFINITY, f64::max));
        // With a single place the range is zero, and `at` would divide by it.
        let x = if x.0 < x.1 { x } else { (x.0.min(x.1) - 0.5, x.0.min(x.1) + 0.5) };
        Self { x, y: if low < high { (low, high) } else { (low - 0.5, low + 0.5) } }
    }

    fn at(&self, x: f64, y: f64) -> (f64, f64) {
        let share = |value: f64, (low, high): (f64, f64)| ((value - low) / (high - low)).clamp(0.0, 1.0);
        (LEFT + PLOT.0 * share(x, self.x), ABOVE + PLOT.1 * (1.0 - share(y, self.y)))
    }

    fn draw(&self, svg: &mut String, panel: &BandChart) {
        self.draw_axes(svg, panel);
        for (curve, colour) in panel.curves.iter().zip(COLOURS.iter().cycle()) {
            self.draw_curve(svg, curve, colour);
        }
        let mut x = LEFT;
        for (curve, colour) in
            panel.curves.iter().zip(COLOURS.iter().cycle()).filter(|(curve, _)| !curve.name.is_empty())
        {
            let _ = writeln!(
                svg,
                "<rect x=\"{x:.0}\" y=\"{:.0}\" width=\"14\" height=\"4\" fill=\"{colour}\"/>",
                ABOVE - 14.0
            );
            text(svg, x + 18.0, ABOVE - 9.0, "start", &curve.name, "");
            // The width of a letter is about 6.5 pixels.
            x += 34.0 + 6.5 * curve.name.chars().count() as f64;
        }
    }

    fn draw_axes(&self, svg: &mut String, panel: &BandChart) {
        for tick in ticks(self.x) {
            let (x, _) = self.at(tick, self.y.0);
            line(svg, (x, ABOVE), (x, ABOVE + PLOT.1));
            text(svg, x, ABOVE + PLOT.1 + 16.0, "middle", &short(tick), "");
        }
        for tick in ticks(self.y) {
            let (_, y) = self.at(self.x.0, tick);
            line(svg, (LEFT, y), (LEFT + PLOT.0, y));
            text(svg, LEFT - 6.0, y + 4.0, "end", &short(tick), "");
        }
        let (middle, centre) = (LEFT + PLOT.0 / 2.0, ABOVE + PLOT.1 / 2.0);
        text(svg, middle, 16.0, "middle", &panel.title, " font-weight=\"bold\"");
        text(svg, middle, ABOVE + PLOT.1 + 36.0, "middle", &panel.x, "");
        text(svg, 14.0, centre, "middle", &panel.y, &format!(" transform=\"rotate(-90 14 {centre:.1})\""));
    }

    fn draw_curve(&self, svg: &mut String, curve: &BandCurve, colour: &str) {
        // A point without a value breaks the curve, and its band.
        for stretch in curve.points.split(|point| point.y.is_none()).filter(|stretch| !stretch.is_empty()) {
            let known: Vec<_> = stretch.iter().filter_map(|point| Some((point, point.y?))).collect();
            let along = |place: usize| known.iter().map(move |(point, y)| self.at(point.x, y[place]));
            // Along the upper end and back along the lower one, so that the polygon does not cross itself.
            let band: Vec<_> = along(2).chain(along(1).rev()).collect();
            let _ = writeln!(
                svg,
                "<polygon points=\"{}\" fill=\"{colour}\" fill-opacity=\"0.2\"/>",
                points(&band)
            );
            let values: Vec<_> = along(0).collect();
            let _ = writeln!(
                svg,
                "<polyline points=\"{}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"1.8\" stroke-linejoin=\"round\"/>",
                points(&values)
            );
            for ((point, _), (x, y)) in known.iter().zip(values) {
                let _ = writeln!(
                    svg,
                    "<g class=\"cell\" data-cell=\"{}\" tabindex=\"0\" role=\"button\"><title>{}</title><circle cx=\"{x:.1}\" \
                     cy=\"{y:.1}\" r=\"4\" fill=\"{colour}\"/></g>",
                    point.number,
                    escaped(&point.detail)
                );
            }
        }
    }
}

fn points(points: &[(f64, f64)]) -> String {
    points.iter().map(|(x, y)| format!("{x:.1},{y:.1}")).collect::<Vec<_>>().join(" ")
}

fn line(svg: &mut String, from: (f64, f64), to: (f64, f64)) {
    let _ = writeln!(
        svg,
        "<line class=\"grid\" stroke=\"#dddddd\" x1=\"{:.1}\" y1=\"{:.1}\" x2=\"{:.1}\" y2=\"{:.1}\"/>",
        from.0, from.1, to.0, to.1
    );
}

fn text(svg: &mut String, x: f64, y: f64, anchor: &str, text: &str, more: &str) {
    let text = escaped(text);
    let _ = writeln!(
        svg,
        "<text class=\"ink\" fill=\"#222222\" x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\"{more}>{text}</text>"
    );
}

/// Round numbers from `low` to `high`.
fn ticks((low, high): (f64, f64)) -> Vec<f64> {
    let rough = (high - low) / TICKS;
    let power = 10_f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].iter().map(|factor| factor * power).find(|step| *step >= rough);
    let step = step.unwrap_or(rough);
    let first = (low / step).ceil() as i64;
    // Without the margin, a rounding error can drop the tick at the upper end.
    let last = (high / step + 1e-9).floor() as i64;
    (first..=last).map(|index| index as f64 * step).collect()
}

/// A number without trailing zeros.
fn short(value: f64) -> String {
    let text = format!("{value:.6}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    // A small negative number is rounded to -0.
    if text == "-0" { "0".into() } else { text.into() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(x: f64, y: Option<f64>) -> BandPoint {
        BandPoint { x, y: y.map(|y| [y, y - 0.1, y + 0.1]), number: x as u64, detail: "d".into() }
    }

    #[test]
    fn a_point_without_a_value_breaks_the_curve() {
        let points =
            vec![point(0.0, Some(1.0)), point(1.0, Some(0.8)), point(2.0, None), point(3.0, Some(0.1))];
        let chart =
            BandChart { curves: vec![BandCurve { name: "paper".into(), points }], ..BandChart::default() };
        let svg = svg(&[chart], 0.0, 1.0);
        assert_eq!((svg.matches("<polyline").count(), svg.matches("class=\"cell\"").count()), (2, 3));
        assert!(svg.contains(">paper</text>"));
    }

    #[test]
    fn ticks_are_round_and_within_the_axis() {
        let texts = |range| ticks(range).into_iter().map(short).collect::<Vec<_>>();
        assert_eq!(texts((0.0, 1.0)), ["0", "0.2", "0.4", "0.6", "0.8", "1"]);
        assert_eq!(texts((-3.0, 41.0)), ["0", "10", "20", "30", "40"]);
    }

    #[test]
    fn an_axis_of_one_value_can_be_drawn() {
        let curves = vec![BandCurve { name: String::new(), points: vec![point(2.0, Some(0.5))] }];
        let svg = svg(&[BandChart { curves, ..BandChart::default() }], 0.5, 0.5);
        assert!(!svg.contains("NaN") && svg.contains("<circle"));
    }
}
