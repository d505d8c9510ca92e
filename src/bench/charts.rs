//! The figures of a benchmark's page: how far above the floor, how it grows, how it spreads, how it went over time.
//!
//! Never draws what was not measured: a chart with a single point, or a percentile beyond the last sample.

use super::{
    figure, label,
    result::{Hop, Load, Measured, Piece, Results, Subject},
    samples::Samples,
    statistics::Spread,
};
use crate::drawing::{
    chart::{Chart, Fault, Line, Stroke},
    scale::Scale,
    strip,
};
use plotters::style::RGBColor;
use ringwing_recorder::show::palette::{self, Rgb};
use std::collections::BTreeSet;

/// Places in the palette: the dark ones first, which show on white.
const INKS: [u32; 12] = [5, 1, 3, 6, 7, 2, 8, 17, 19, 21, 22, 23];
const UAVS: &str = "UAVs, each a process (logarithmic)";
const SHARE: &str = "share of the samples that are no slower";
const MEDIANS: strip::Key = strip::Key { unit: UNIT, marks: &[0.5, 0.7, 1.0, 1.4, 2.0] };
const LONGEST: strip::Key = strip::Key { unit: UNIT, marks: &[1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0] };
const UNIT: &str = "times the case's own median";
/// Points of a percentile curve for each power of ten that is left.
const POINTS_PER_DECADE: u32 = 40;
/// Percentile curves are enough to draw.
const DETAIL: usize = 600;

/// A figure, drawn.
pub(super) struct Figure {
    pub(super) title: String,
    pub(super) text: String,
    pub(super) svg: String,
}

/// All figures that `results` have anything for.
pub(super) fn all(results: &Results) -> Result<Vec<Figure>, Fault> {
    let mut figures = Vec::new();
    let loads: BTreeSet<Load> = results.cases.iter().map(|measured| measured.case.load).collect();
    for load in loads {
        figures.extend(over_floor(results, load)?);
        figures.extend(growth(results, load)?);
        for uavs in sizes(results, load) {
            figures.extend(spread(results, load, uavs)?);
        }
        figures.extend(hops(results, load)?);
    }
    figures.extend(over_time(results)?);
    Ok(figures)
}

fn sizes(results: &Results, load: Load) -> BTreeSet<u32> {
    of_load(results, load).map(|measured| measured.case.uavs).collect()
}

fn of_load(results: &Results, load: Load) -> impl Iterator<Item = &Measured> {
    results.cases.iter().filter(move |measured| measured.case.load == load && !measured.repeats.is_empty())
}

/// What the cases of one load are called but for their size, in the order of the command line.
fn ways(results: &Results, load: Load) -> Vec<String> {
    let mut ways = Vec::new();
    for way in of_load(results, load).map(|measured| label::way(&measured.case)) {
        if !ways.contains(&way) {
            ways.push(way);
        }
    }
    ways
}

fn ink(place: usize) -> RGBColor {
    let Rgb { red, green, blue } = palette::colour(INKS.get(place % INKS.len()).copied().unwrap_or(1));
    RGBColor(red, green, blue)
}

/// Tick times as multiples of the floor's.
fn over_floor(results: &Results, load: Load) -> Result<Option<Figure>, Fault> {
    let spread = |measured: &Measured| Spread::of(&figure::floor_ratios(results, measured));
    let chart = over_sizes(results, load, "times the floor", spread);
    drawn(
        format!("Tick time over the floor, {}", label::load(load)),
        "How many times as long a tick takes as the gate alone with as many processes and no data: medians of the \
         repeats' ratios, each to the floor of its own round, and their ranges."
            .into(),
        &chart,
    )
}

/// Tick times over the number of UAVs.
fn growth(results: &Results, load: Load) -> Result<Option<Figure>, Fault> {
    let spread = |measured: &Measured| Some(Spread::of(&figure::tick_times_ns(measured))?.times(1e-3));
    let chart = over_sizes(results, load, "tick time, us", spread);
    let what = if load == Load::Closed { "mean time from tick to tick" } else { "median of the whole tick" };
    drawn(
        format!("Tick time over the number of UAVs, {}", label::load(load)),
        format!("The {what}: medians of the repeats, and their ranges. Both axes are logarithmic."),
        &chart,
    )
}

/// A quantity over the number of UAVs, a line for each way to carry the data; both axes are logarithmic.
fn over_sizes(
    results: &Results,
    load: Load,
    y: &'static str,
    get: impl Fn(&Measured) -> Option<Spread>,
) -> Chart {
    let mut lines = Vec::new();
    for (place, way) in ways(results, load).into_iter().enumerate() {
        let mut points: Vec<(f64, Spread)> = of_load(results, load)
            .filter(|measured| label::way(&measured.case) == way)
            .filter_map(|measured| Some((f64::from(measured.case.uavs).log10(), get(measured)?)))
            .collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        if points.len() > 1 {
            lines.extend(with_ranges(way, ink(place), &points));
        }
    }
    Chart { x: UAVS, y, x_scale: Scale::Log, y_scale: Scale::Log, lines, ..Chart::default() }
}

/// A line through the medians, and an upright one over each range.
fn with_ranges(name: String, colour: RGBColor, points: &[(f64, Spread)]) -> Vec<Line> {
    let medians = points.iter().map(|(x, spread)| Some((*x, spread.median.log10()))).collect();
    let range = |(x, spread): &(f64, Spread)| Line {
        name: String::new(),
        colour,
        stroke: Stroke::Solid,
        points: [spread.least, spread.most].map(|end| Some((*x, end.log10()))).into(),
    };
    let ranges = points.iter().map(range);
    std::iter::once(Line { name, colour, stroke: Stroke::Dotted, points: medians }).chain(ranges).collect()
}

/// The distributions of the whole tick of all ways to carry the data, of one size.
fn spread(results: &Results, load: Load, uavs: u32) -> Result<Option<Figure>, Fault> {
    let curve = |(place, way): (usize, String)| {
        let of_way = |one: &&Measured| one.case.uavs == uavs && label::way(&one.case) == way;
        let measured = of_load(results, load).find(of_way)?;
        curve(way.clone(), place, &figure::all_samples(measured, Hop::Tick))
    };
    let lines = ways(results, load).into_iter().enumerate().filter_map(curve).collect();
    let agents = if uavs == 1 { "1 UAV".into() } else { format!("{uavs} UAVs") };
    drawn(
        format!("Whole tick, {agents}, {}: percentiles", label::load(load)),
        "All samples of all repeats, up to the slowest of all. Few samples stand behind the right end of a curve."
            .into(),
        &percentile_chart(lines),
    )
}

/// The distributions of the hops of the largest swarm.
fn hops(results: &Results, load: Load) -> Result<Option<Figure>, Fault> {
    let swarms = of_load(results, load).filter(|measured| measured.case.subject == Subject::Swarm);
    let Some(measured) = swarms.max_by_key(|measured| measured.case.uavs) else { return Ok(None) };
    let curve = |(place, hop): (usize, Hop)| {
        curve(label::hop(hop).into(), place, &figure::all_samples(measured, hop))
    };
    let lines = figure::hops(measured).into_iter().enumerate().filter_map(curve).collect();
    drawn(
        format!("Hops of a tick: {}", label::case(&measured.case)),
        "wake: from the world's publishing to an agent's waking; read: until it has its inputs; compute: its answer; \
         return: until the world has that."
            .into(),
        &percentile_chart(lines),
    )
}

fn percentile_chart(lines: Vec<Line>) -> Chart {
    let (x_scale, y_scale) = (Scale::Shares, Scale::Log);
    Chart { x: SHARE, y: "us", x_scale, y_scale, detail: DETAIL, lines, ..Chart::default() }
}

/// The percentiles of `samples`, from the fastest to the slowest.
fn curve(name: String, place: usize, samples: &Samples) -> Option<Line> {
    // With n samples, a share of 1 - 1 / n has one beyond it.
    let last = (samples.n() as f64).log10();
    let steps = (f64::from(POINTS_PER_DECADE) * last).ceil().max(1.0) as u32;
    let point = |step: u32| {
        let nines = last * f64::from(step) / f64::from(steps);
        let share = if step == steps { 1.0 } else { 1.0 - 10_f64.powf(-nines) };
        let ns = samples.at_share(share)?;
        Some((nines, (ns.max(1) as f64 / 1e3).log10()))
    };
    let points: Vec<_> = (0..=steps).map(point).collect();
    (samples.n() > 1).then_some(Line { name, colour: ink(place), stroke: Stroke::Solid, points })
}

/// Nothing, if there is nothing to draw.
fn drawn(title: String, text: String, chart: &Chart) -> Result<Option<Figure>, Fault> {
    if chart.lines.is_empty() {
        return Ok(None);
    }
    Ok(Some(Figure { title, text, svg: chart.svg()? }))
}

/// The whole ticks of every case over time: their medians, and their longest.
fn over_time(results: &Results) -> Result<Vec<Figure>, Fault> {
    let strips = [
        strip(results, ["the median tick", "drift of the machine changes the colour"], MEDIANS, |one| {
            one.p50_ns
        })?,
        strip(results, ["the longest tick", "a stall is a bright cell"], LONGEST, |one| one.max_ns)?,
    ];
    Ok(strips.into_iter().flatten().collect())
}

fn strip(
    results: &Results,
    [what, hint]: [&str; 2],
    key: strip::Key,
    get: fn(&Piece) -> u64,
) -> Result<Option<Figure>, Fault> {
    let rows: Vec<strip::Row> = results.cases.iter().filter_map(|measured| row(measured, get)).collect();
    if rows.is_empty() {
        return Ok(None);
    }
    let text = format!(
        "Each row is a case, its repeats side by side; each cell a piece of the time, coloured by how many times the \
         case's own median it is: {hint}."
    );
    Ok(Some(Figure { title: format!("Over time: {what}"), text, svg: strip::svg(&rows, key)? }))
}

fn row(measured: &Measured, get: fn(&Piece) -> u64) -> Option<strip::Row> {
    let usual = figure::all_samples(measured, Hop::Tick).at_share(0.5)?.max(1) as f64;
    let cell = |piece: &Piece| (piece.ticks > 0).then(|| get(piece) as f64 / usual);
    let groups = measured.repeats.iter().map(|repeat| repeat.strip.iter().map(cell).collect()).collect();
    Some(strip::Row { name: label::case(&measured.case), groups })
}

#[cfg(test)]
mod tests {
    use super::{super::example, *};

    fn titles(results: &Results) -> Vec<String> {
        all(results).unwrap().into_iter().map(|figure| figure.title).collect()
    }

    #[test]
    fn every_figure_that_the_results_allow_is_drawn() {
        let titles = titles(&example::results());
        assert_eq!(
            titles,
            [
                "Tick time over the floor, closed loop",
                "Tick time over the number of UAVs, closed loop",
                "Whole tick, 1 UAV, closed loop: percentiles",
                "Whole tick, 6 UAVs, closed loop: percentiles",
                "Whole tick, 30 UAVs, closed loop: percentiles",
                "Hops of a tick: swarm, 30 UAVs, closed loop",
                "Whole tick, 6 UAVs, paced at 100 Hz: percentiles",
                "Hops of a tick: swarm, 6 UAVs, paced at 100 Hz",
                "Over time: the median tick",
                "Over time: the longest tick",
            ]
        );
    }

    #[test]
    fn nothing_measured_is_nothing_drawn() {
        let mut results = example::results();
        results.cases.iter_mut().for_each(|measured| measured.repeats.clear());
        assert!(titles(&results).is_empty());
    }

    #[test]
    fn a_curve_goes_from_the_fastest_to_the_slowest() {
        let mut samples = Samples::new();
        (1..=1000).for_each(|us| samples.record(1000 * us));
        let line = curve("x".into(), 0, &samples).unwrap();
        let [first, last] = [line.points.first(), line.points.last()].map(|point| point.unwrap().unwrap());
        // 1 us at a share of 0; beyond 99.9 % there is one sample left, the last of the thousand.
        assert_eq!(first, (0.0, 0.0));
        assert!((last.0 - 3.0).abs() < 1e-12 && (last.1 - 3.0).abs() < 1e-12, "{last:?}");
        assert!(line.points.iter().flatten().is_sorted_by(|a, b| a.0 <= b.0 && a.1 <= b.1));
    }
}
