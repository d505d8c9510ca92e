//! Robustness maps: success and figures of a sweep's cells over its axes.
//!
//! Two axes of numbers make heat maps, one makes curves; further axes make small multiples. Never reads a file.

use super::{cells::Cell, definition::Definition, design::Combination};
use crate::figure::{Better, Figure};
use ringwing_drawing::{
    bands::{self, BandChart, BandCurve, BandPoint},
    heat::{self, ColourScale, HeatCell, HeatMap},
};

/// Most cells of a map. More are smaller than anybody can see, and their pictures fill the memory.
const CELLS: usize = 20_000;
/// Most panels of a map. More no longer fit a page; the results have all cells.
const PANELS: usize = 12;
/// Most curves of a panel. More cannot be told apart.
const CURVES: usize = 6;

/// A map, drawn.
#[derive(Debug, Clone)]
pub struct Map {
    /// Its name, also that of its file: `success`, `settling_s-median`.
    pub name: String,
    /// What it shows.
    pub title: String,
    /// The picture.
    pub svg: String,
}

/// What a map shows of each cell.
#[derive(Clone, Copy)]
enum Shown<'a> {
    Success,
    /// The median of the figure at this place.
    Median(usize, &'a Figure),
    /// The value that only one flight in ten is worse than.
    Bad(usize, &'a Figure),
}

/// Which axis goes where.
struct Layout {
    x: usize,
    /// The vertical axis of heat maps; without one, there are curves.
    y: Option<usize>,
    /// The axis with a curve for each value.
    curves: Option<usize>,
    /// The axes that make panels.
    panels: Vec<usize>,
}

/// Draws every map of the sweep: success, and the median and the bad end of each figure.
pub fn draw_maps(definition: &Definition, cells: &[Cell], figures: &[&Figure]) -> Vec<Map> {
    if cells.len() > CELLS {
        return Vec::new();
    }
    let mut all = vec![Shown::Success];
    for (place, figure) in figures.iter().enumerate() {
        // A figure that no flight has, such as the clearance where there is no obstacle, makes no map.
        if cells.iter().any(|cell| cell.figures[place].median.is_some()) {
            all.extend([Shown::Median(place, figure), Shown::Bad(place, figure)]);
        }
    }
    layouts(definition, cells)
        .iter()
        .enumerate()
        .flat_map(|(number, layout)| {
            all.iter().filter_map(move |shown| draw(definition, cells, layout, *shown, number))
        })
        .collect()
}

/// How the axes are laid out; one axis at a time has a layout for each.
fn layouts(definition: &Definition, cells: &[Cell]) -> Vec<Layout> {
    let axes = &definition.design.axes;
    let sizes: Vec<usize> = (0..axes.len()).map(|axis| labels(cells, axis).len()).collect();
    // An axis of a single value has nothing to show.
    let mut numeric: Vec<usize> =
        (0..axes.len()).filter(|axis| sizes[*axis] > 1 && is_numeric(cells, *axis)).collect();
    numeric.sort_by_key(|axis| std::cmp::Reverse(sizes[*axis]));
    let mut others: Vec<usize> =
        (0..axes.len()).filter(|axis| sizes[*axis] > 1 && !numeric.contains(axis)).collect();
    let curves_of = |x: usize| Layout { x, y: None, curves: None, panels: Vec::new() };
    match definition.design.combination {
        Combination::OneAtATime => return numeric.into_iter().map(curves_of).collect(),
        // All axes go along together, so one of them tells where a cell is.
        Combination::Zip => return numeric.into_iter().take(1).map(curves_of).collect(),
        Combination::Grid => {}
    }
    if numeric.is_empty() {
        // Without numbers there are no curves, so texts take the axes of a heat map.
        let Some(x) = others.first().copied() else { return Vec::new() };
        return vec![Layout {
            x,
            y: others.get(1).copied(),
            curves: None,
            panels: others.split_off(others.len().min(2)),
        }];
    }
    let (x, y) = (numeric[0], numeric.get(1).copied());
    others.extend(numeric.into_iter().skip(2));
    let curves =
        if y.is_none() { others.first().copied().filter(|axis| sizes[*axis] <= CURVES) } else { None };
    others.retain(|axis| Some(*axis) != curves);
    vec![Layout { x, y, curves, panels: others }]
}

/// The values of an axis: numbers in their order, texts in the order in which they come.
fn labels(cells: &[Cell], axis: usize) -> Vec<String> {
    let mut labels: Vec<String> = Vec::new();
    for cell in cells {
        if !labels.contains(&cell.values[axis]) {
            labels.push(cell.values[axis].clone());
        }
    }
    if is_numeric(cells, axis) {
        labels.sort_by(|one, other| number(one).total_cmp(&number(other)));
    }
    labels
}

fn is_numeric(cells: &[Cell], axis: usize) -> bool {
    cells.iter().all(|cell| cell.values[axis].parse::<f64>().is_ok())
}

fn number(text: &str) -> f64 {
    text.parse().unwrap_or(f64::NAN)
}

fn draw(
    definition: &Definition,
    cells: &[Cell],
    layout: &Layout,
    shown: Shown,
    number: usize,
) -> Option<Map> {
    let is_curves = layout.y.is_none() && is_numeric(cells, layout.x);
    // A curve of medians has the bad end as its band, so it needs no map of its own.
    if is_curves && matches!(shown, Shown::Bad(..)) {
        return None;
    }
    let panels = panels(definition, cells, layout);
    let svg = if is_curves {
        let (low, high) = shown.range(cells);
        let charts: Vec<_> =
            panels.iter().map(|(title, cells)| chart(definition, cells, layout, shown, title)).collect();
        bands::svg(&charts, low, high)
    } else {
        let maps: Vec<_> =
            panels.iter().map(|(title, cells)| map(definition, cells, layout, shown, title)).collect();
        heat::svg(&maps, &shown.scale(cells))
    };
    // With one axis at a time, each axis has maps of the same figures.
    let suffix = if number == 0 { String::new() } else { format!("-{}", number + 1) };
    Some(Map { name: shown.name() + &suffix, title: shown.title(), svg })
}

/// The cells of each panel, with its title.
fn panels<'c>(definition: &Definition, cells: &'c [Cell], layout: &Layout) -> Vec<(String, Vec<&'c Cell>)> {
    let axes = &definition.design.axes;
    let mut panels: Vec<(String, Vec<&Cell>)> = Vec::new();
    for cell in cells.iter().filter(|cell| is_in(definition, cells, layout, cell)) {
        let part = |axis: &usize| format!("{} {}", axes[*axis].name, cell.values[*axis]);
        let title = layout.panels.iter().map(part).collect::<Vec<_>>().join(", ");
        match panels.iter_mut().find(|(other, _)| *other == title) {
            Some((_, panel)) => panel.push(cell),
            None => panels.push((title, vec![cell])),
        }
    }
    panels.truncate(PANELS);
    panels
}

/// Whether the layout shows the cell: with one axis at a time, only those in which the other axes have their first values.
fn is_in(definition: &Definition, cells: &[Cell], layout: &Layout, cell: &Cell) -> bool {
    definition.design.combination != Combination::OneAtATime
        || cells.first().is_some_and(|first| {
            (0..cell.values.len()).all(|axis| axis == layout.x || cell.values[axis] == first.values[axis])
        })
}

fn map(definition: &Definition, cells: &[&Cell], layout: &Layout, shown: Shown, title: &str) -> HeatMap {
    let axes = &definition.design.axes;
    let owned: Vec<Cell> = cells.iter().map(|cell| (*cell).clone()).collect();
    let (xs, ys) =
        (labels(&owned, layout.x), layout.y.map_or_else(|| vec![String::new()], |y| labels(&owned, y)));
    let mut placed = vec![None; xs.len() * ys.len()];
    for cell in cells {
        let x = xs.iter().position(|label| *label == cell.values[layout.x]).unwrap_or_default();
        let y =
            layout.y.and_then(|y| ys.iter().position(|label| *label == cell.values[y])).unwrap_or_default();
        placed[y * xs.len() + x] = Some(HeatCell {
            number: cell.cell,
            value: shown.value(cell).map(|[value, ..]| value),
            text: shown.text(cell),
            detail: detail(definition, cell, shown),
        });
    }
    let y_name = layout.y.map_or_else(String::new, |y| axes[y].name.clone());
    HeatMap { title: title.to_owned(), x: (axes[layout.x].name.clone(), xs), y: (y_name, ys), cells: placed }
}

fn chart(definition: &Definition, cells: &[&Cell], layout: &Layout, shown: Shown, title: &str) -> BandChart {
    let mut curves: Vec<BandCurve> = Vec::new();
    for cell in cells {
        let name = layout.curves.map_or_else(String::new, |axis| cell.values[axis].clone());
        let (x, y) = (number(&cell.values[layout.x]), shown.value(cell));
        let point = BandPoint { x, y, number: cell.cell, detail: detail(definition, cell, shown) };
        match curves.iter_mut().find(|curve| curve.name == name) {
            Some(curve) => curve.points.push(point),
            None => curves.push(BandCurve { name, points: vec![point] }),
        }
    }
    for curve in &mut curves {
        curve.points.sort_by(|one, other| one.x.total_cmp(&other.x));
    }
    let x = definition.design.axes[layout.x].name.clone();
    BandChart { title: title.to_owned(), x, y: shown.title(), curves }
}

/// What a cell says when somebody points at it.
fn detail(definition: &Definition, cell: &Cell, shown: Shown) -> String {
    let axes = definition.design.axes.iter().zip(&cell.values);
    let place = axes.map(|(axis, value)| format!("{} {value}", axis.name)).collect::<Vec<_>>().join(", ");
    let share = cell.success();
    let success = format!(
        "{} of {} flights passed ({:.0} %, 95 % interval {:.0} to {:.0} %)",
        cell.passed,
        cell.flights,
        100.0 * share.value,
        100.0 * share.low,
        100.0 * share.high
    );
    match shown {
        Shown::Success => format!("{place}: {success}"),
        _ => format!("{place}: {} {}; {success}", shown.title(), shown.text(cell)),
    }
}

impl Shown<'_> {
    fn name(self) -> String {
        match self {
            Self::Success => "success".into(),
            Self::Median(_, figure) => format!("{}-median", figure.name),
            Self::Bad(_, figure) => {
                format!("{}-{}", figure.name, if figure.better == Better::Lower { "p90" } else { "p10" })
            }
        }
    }

    fn title(self) -> String {
        match self {
            Self::Success => "share of flights that passed".into(),
            Self::Median(_, figure) => format!("{}, median ({})", figure.label, figure.name),
            Self::Bad(_, figure) => format!("{}, {} ({})", figure.label, percentile(figure), figure.name),
        }
    }

    /// The value with both ends of its band, if there is one.
    fn value(self, cell: &Cell) -> Option<[f64; 3]> {
        match self {
            Self::Success => {
                let share = cell.success();
                Some([share.value, share.low, share.high])
            }
            Self::Median(place, _) => {
                let spread = cell.figures[place];
                let median = spread.median?;
                let bad = spread.bad.unwrap_or(median);
                // The bad end lies above or below the median, as the figure is better low or high.
                Some([median, median.min(bad), median.max(bad)])
            }
            Self::Bad(place, _) => cell.figures[place].bad.map(|bad| [bad; 3]),
        }
    }

    fn text(self, cell: &Cell) -> String {
        match (self, self.value(cell)) {
            (_, None) => "-".into(),
            (Self::Success, Some([share, ..])) => format!("{:.0} %", 100.0 * share),
            (_, Some([value, ..])) => short(value),
        }
    }

    /// The lowest and the highest value of all cells; shares go from 0 to 1.
    fn range(self, cells: &[Cell]) -> (f64, f64) {
        if matches!(self, Self::Success) {
            return (0.0, 1.0);
        }
        let values = || cells.iter().filter_map(|cell| self.value(cell)).flatten();
        let (low, high) =
            (values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max));
        // If no cell has a value, both ends are infinite, and no axis could be drawn.
        if low <= high { (low, high) } else { (0.0, 1.0) }
    }

    fn scale(self, cells: &[Cell]) -> ColourScale {
        let (low, high) = self.range(cells);
        let ends = match self {
            Self::Success => ["0 %".into(), "100 %".into()],
            _ => [short(low), short(high)],
        };
        // The figure's own name, because a whole title is longer than the bar.
        let label = match self {
            Self::Success => "passed".into(),
            Self::Median(_, figure) | Self::Bad(_, figure) => figure.name.to_owned(),
        };
        ColourScale { label, low, high, ends }
    }
}

/// The name of the bad end of a figure.
fn percentile(figure: &Figure) -> &'static str {
    match figure.better {
        Better::Lower => "90th percentile",
        Better::Higher => "10th percentile",
    }
}

/// Three digits of a number, so that it fits a cell.
fn short(value: f64) -> String {
    let size = value.abs();
    if size != 0.0 && !(0.001..100_000.0).contains(&size) {
        format!("{value:.0e}")
    } else if size >= 100.0 {
        format!("{value:.0}")
    } else if size >= 10.0 {
        format!("{value:.1}")
    } else if size >= 0.1 || size == 0.0 {
        format!("{value:.2}")
    } else {
        format!("{value:.3}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sweep::{Draft, Spread};

    fn maps(axes: &str, combination: &str) -> Vec<Map> {
        let text = format!(
            "scenario = \"paper-4.1\"\nfaults = [\"at {{t}} s link all loss {{loss}} % delay {{delay}} s\"]\n\
             combination = \"{combination}\"\n[axes]\n{axes}"
        );
        let sweep = Draft::parse("x", &text).unwrap().finish().unwrap();
        let cell = |cell: u64| Cell {
            cell,
            values: sweep.design.values(cell),
            flights: 4,
            passed: cell % 5,
            figures: vec![
                Spread { median: Some(cell as f64), bad: None },
                Spread { median: None, bad: None },
            ],
            kept: Vec::new(),
        };
        let cells: Vec<_> = (0..sweep.cells().unwrap()).map(cell).collect();
        let figures = ["settling_s", "clearance_m"].map(|name| Figure::named(name).unwrap());
        draw_maps(&sweep, &cells, &figures)
    }

    fn names(maps: &[Map]) -> Vec<&str> {
        maps.iter().map(|map| map.name.as_str()).collect()
    }

    #[test]
    fn two_axes_of_numbers_make_heat_maps_and_a_third_axis_makes_panels() {
        let maps = maps(
            "t = [1]\nloss = \"0 .. 2\"\ndelay = \"0 .. 3\"\n\"control.law\" = [\"paper\", \"resilient\"]",
            "grid",
        );
        assert_eq!(names(&maps), ["success", "settling_s-median", "settling_s-p90"]);
        assert_eq!(maps[0].svg.matches("class=\"cell\"").count(), 24);
        assert!(maps[0].svg.contains("control.law paper") && maps[0].svg.contains("control.law resilient"));
    }

    #[test]
    fn one_axis_of_numbers_makes_curves_and_a_second_axis_the_curves() {
        let maps = maps(
            "t = [1]\nloss = [0]\ndelay = \"0 .. 3\"\n\"control.law\" = [\"paper\", \"resilient\"]",
            "grid",
        );
        assert_eq!(names(&maps), ["success", "settling_s-median"]);
        assert_eq!(maps[0].svg.matches("<polyline").count(), 2);
    }

    #[test]
    fn one_axis_at_a_time_makes_curves_for_each() {
        let maps = maps("t = [1]\nloss = \"0 .. 2\"\ndelay = \"0 .. 3\"", "one-at-a-time");
        assert_eq!(names(&maps), ["success", "settling_s-median", "success-2", "settling_s-median-2"]);
        assert_eq!(maps[0].svg.matches("class=\"cell\"").count(), 4);
        assert_eq!(maps[2].svg.matches("class=\"cell\"").count(), 3);
    }

    #[test]
    fn numbers_in_cells_are_short() {
        assert_eq!([0.0, 12.345, 123.4, 0.012_34, 1e-9].map(short), ["0.00", "12.3", "123", "0.012", "1e-9"]);
    }
}
