//! The charts of a benchmark's page: how far tick times are above the floor, how they scale and spread, and how they
//! change over time.
//!
//! Must never draw what was not measured: no chart of a single point, no percentile beyond the last sample.

use crate::{
    case::{Carrier, Load},
    label,
    latencies::Latencies,
    quantity,
    result::{Hop, Measured, Results, TimeSlice},
    statistics::Spread,
};
use ringwing_drawing::{
    DrawingError, RGBColor,
    chart::{Chart, Curve, Stroke},
    scale::Scale,
    strip::{self, ColourKey, StripRow},
};
use std::{borrow::Cow, collections::BTreeSet};

/// Colours of curves, in this order and then again from the first. Okabe and Ito's, which colour-blind people can tell apart,
/// those that are dark enough for white paper first; then darker shades of them.
const INKS: [RGBColor; 12] = [
    RGBColor(0x00, 0x72, 0xb2),
    RGBColor(0xe6, 0x9f, 0x00),
    RGBColor(0x00, 0x9e, 0x73),
    RGBColor(0xd5, 0x5e, 0x00),
    RGBColor(0xcc, 0x79, 0xa7),
    RGBColor(0x56, 0xb4, 0xe9),
    RGBColor(0x99, 0x99, 0x99),
    RGBColor(0x8a, 0x5f, 0x00),
    RGBColor(0x00, 0x5f, 0x45),
    RGBColor(0x00, 0x44, 0x6b),
    RGBColor(0x80, 0x38, 0x00),
    RGBColor(0x7a, 0x49, 0x64),
];
const UAVS: &str = "UAVs, each a process (logarithmic)";
const SHARE: &str = "share of the samples that are no slower";
/// Colours of median ticks. A wider range would hide a slow drift; in a narrower one, every cell has a colour of the ends.
const MEDIANS: ColourKey = ColourKey { unit: UNIT, marks: &[0.5, 0.7, 1.0, 1.4, 2.0] };
/// Colours of the longest ticks. A narrower range would not tell a stall from an ordinary late tick.
const LONGEST: ColourKey = ColourKey { unit: UNIT, marks: &[1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0] };
const UNIT: &str = "times the median of the case";
/// Points of a percentile curve per factor of ten of the remaining share. Fewer show corners; more make the page larger.
const POINTS_PER_DECADE: u32 = 40;
/// Most points of a curve. A percentile curve has fewer, so it keeps all its points; a smaller limit would drop some.
const DETAIL: usize = 600;

/// A picture with its text.
pub(crate) struct Picture {
    pub(crate) title: String,
    pub(crate) caption: String,
    pub(crate) drawing: Drawing,
}

/// What a picture shows.
pub(crate) enum Drawing {
    /// A chart.
    Chart(Chart),
    /// Strips over time, as SVG.
    Strip(String),
}

impl Picture {
    /// The name of its file, without an extension: its title, in letters that every file system takes.
    pub(crate) fn name(&self) -> String {
        let words = self.title.split(|c: char| !c.is_ascii_alphanumeric()).filter(|word| !word.is_empty());
        words.map(str::to_lowercase).collect::<Vec<_>>().join("-")
    }

    /// The picture for a paper.
    pub(crate) fn svg(&self) -> Result<Cow<'_, str>, DrawingError> {
        match &self.drawing {
            Drawing::Chart(chart) => chart.svg().map(Cow::Owned),
            Drawing::Strip(svg) => Ok(svg.into()),
        }
    }
}

/// All charts for which `results` hold enough.
pub(crate) fn all(results: &Results) -> Result<Vec<Picture>, DrawingError> {
    let mut pictures = Vec::new();
    let loads: BTreeSet<Load> = results.cases.iter().map(|measured| measured.case.load).collect();
    for load in loads {
        pictures.extend(over_floor(results, load));
        pictures.extend(growth(results, load));
        for uavs in sizes(results, load) {
            pictures.extend(distribution(results, load, uavs));
        }
        pictures.extend(hops(results, load));
    }
    pictures.extend(over_time(results)?);
    Ok(pictures)
}

fn sizes(results: &Results, load: Load) -> BTreeSet<u32> {
    of_load(results, load).map(|measured| measured.case.uavs).collect()
}

fn of_load(results: &Results, load: Load) -> impl Iterator<Item = &Measured> {
    results.cases.iter().filter(move |measured| measured.case.load == load && !measured.repeats.is_empty())
}

/// The names of all cases of one load without their size, in the order of the command line.
fn setups(results: &Results, load: Load) -> Vec<String> {
    // Not a set, which would sort them: colours follow the command line.
    let mut setups = Vec::new();
    for setup in of_load(results, load).map(|measured| label::setup(&measured.case)) {
        if !setups.contains(&setup) {
            setups.push(setup);
        }
    }
    setups
}

fn ink(index: usize) -> RGBColor {
    INKS[index % INKS.len()]
}

/// Tick times as multiples of the floor's.
fn over_floor(results: &Results, load: Load) -> Option<Picture> {
    let spread = |measured: &Measured| Spread::of(&quantity::floor_ratios(results, measured));
    let chart = over_sizes(results, load, "times the floor", spread);
    drawn(
        format!("Tick time over the floor, {}", label::load(load)),
        "Tick time as a multiple of the floor: the gate alone with the same number of processes and no data. Each repeat \
         is divided by the floor of its own round; dots are medians, bars are ranges."
            .into(),
        chart,
    )
}

/// Tick times by the number of UAVs.
fn growth(results: &Results, load: Load) -> Option<Picture> {
    let spread = |measured: &Measured| Some(Spread::of(&quantity::tick_times_ns(measured))?.times(1e-3));
    let chart = over_sizes(results, load, "tick time, us", spread);
    let what = if load == Load::Closed { "mean time from tick to tick" } else { "median of the whole tick" };
    drawn(
        format!("Tick time by number of UAVs, {}", label::load(load)),
        format!("The {what}. Dots are medians of the repeats, bars are ranges. Both axes are logarithmic."),
        chart,
    )
}

/// A quantity by the number of UAVs, with a curve for each setup that has two sizes or more.
fn over_sizes(
    results: &Results,
    load: Load,
    y: &'static str,
    get: impl Fn(&Measured) -> Option<Spread>,
) -> Chart {
    let mut lines = Vec::new();
    // Number all setups, drawn or not, so that a setup has the same colour in every chart of a load.
    for (index, setup) in setups(results, load).into_iter().enumerate() {
        let mut points: Vec<(f64, Spread)> = of_load(results, load)
            .filter(|measured| label::setup(&measured.case) == setup)
            .filter_map(|measured| Some((f64::from(measured.case.uavs).log10(), get(measured)?)))
            .collect();
        // Cases have the order of the command line, but a curve needs that of the sizes.
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        if points.len() > 1 {
            lines.extend(with_ranges(setup, ink(index), &points));
        }
    }
    Chart { x: UAVS, y, x_scale: Scale::Log, y_scale: Scale::Log, lines, ..Chart::default() }
}

/// A curve through the medians, and a vertical bar over each range.
fn with_ranges(name: String, colour: RGBColor, points: &[(f64, Spread)]) -> Vec<Curve> {
    let medians = points.iter().map(|(x, spread)| Some((*x, spread.median.log10()))).collect();
    let range = |(x, spread): &(f64, Spread)| Curve {
        // Without a name, the bars stay out of the legend.
        name: String::new(),
        colour,
        stroke: Stroke::Solid,
        points: [spread.least, spread.most].map(|end| Some((*x, end.log10()))).into(),
    };
    let ranges = points.iter().map(range);
    std::iter::once(Curve { name, colour, stroke: Stroke::Dotted, points: medians }).chain(ranges).collect()
}

/// The distributions of the whole tick of all setups of one size.
fn distribution(results: &Results, load: Load, uavs: u32) -> Option<Picture> {
    // The same numbers as in `over_sizes`, so that the colours match.
    let curve = |(index, setup): (usize, String)| {
        let is_it = |one: &&Measured| one.case.uavs == uavs && label::setup(&one.case) == setup;
        let measured = of_load(results, load).find(is_it)?;
        percentile_curve(setup.clone(), index, &quantity::all_samples(measured, Hop::Tick))
    };
    let lines = setups(results, load).into_iter().enumerate().filter_map(curve).collect();
    drawn(
        format!("Whole tick, {}, {}: percentiles", label::uavs(uavs), label::load(load)),
        "All samples of all repeats, up to the slowest one. The right end of a curve rests on few samples."
            .into(),
        percentile_chart(lines),
    )
}

/// The distributions of the hops of the largest swarm.
fn hops(results: &Results, load: Load) -> Option<Picture> {
    let swarms = of_load(results, load).filter(|measured| measured.case.carrier == Carrier::Swarm);
    let measured = swarms.max_by_key(|measured| measured.case.uavs)?;
    let curve = |(index, hop): (usize, Hop)| {
        percentile_curve(label::hop(hop).into(), index, &quantity::all_samples(measured, hop))
    };
    let lines = quantity::hops(measured).into_iter().enumerate().filter_map(curve).collect();
    drawn(
        format!("Hops of a tick: {}", label::case(&measured.case)),
        "wake: the world opens the tick until an agent wakes; read: until it has read its inputs; compute: until it has \
         its answer; return: until the world has read the answer."
            .into(),
        percentile_chart(lines),
    )
}

fn percentile_chart(lines: Vec<Curve>) -> Chart {
    let (x_scale, y_scale) = (Scale::Shares, Scale::Log);
    Chart { x: SHARE, y: "us", x_scale, y_scale, detail: DETAIL, lines, ..Chart::default() }
}

/// The percentiles of `samples` from the fastest to the slowest; `None` for fewer than two samples.
fn percentile_curve(name: String, index: usize, samples: &Latencies) -> Option<Curve> {
    // The slowest of n samples has the share 1 - 1 / n below it: log10(n) nines.
    let last = (samples.n() as f64).log10();
    let steps = (f64::from(POINTS_PER_DECADE) * last).ceil().max(1.0) as u32;
    let point = |step: u32| {
        // Equal steps in nines: the axis stretches the tail, where equal steps in shares would leave gaps.
        let nines = last * f64::from(step) / f64::from(steps);
        let share = if step == steps { 1.0 } else { 1.0 - 10_f64.powf(-nines) };
        let ns = samples.at_share(share)?;
        // 0 ns has no place on a logarithmic axis.
        Some((nines, (ns.max(1) as f64 / 1e3).log10()))
    };
    let points: Vec<_> = (0..=steps).map(point).collect();
    (samples.n() > 1).then_some(Curve { name, colour: ink(index), stroke: Stroke::Solid, points })
}

/// The picture of `chart`; `None` if it has no line.
fn drawn(title: String, caption: String, chart: Chart) -> Option<Picture> {
    (!chart.lines.is_empty()).then_some(Picture { title, caption, drawing: Drawing::Chart(chart) })
}

/// The whole ticks of every case over time: their medians, and the longest ones.
fn over_time(results: &Results) -> Result<Vec<Picture>, DrawingError> {
    let median = ["the median tick", "where the machine drifts, the colour changes"];
    let longest = ["the longest tick", "a stall is a bright cell"];
    let strips = [
        strip(results, median, MEDIANS, |slice| slice.p50_ns)?,
        strip(results, longest, LONGEST, |slice| slice.max_ns)?,
    ];
    Ok(strips.into_iter().flatten().collect())
}

fn strip(
    results: &Results,
    [what, hint]: [&str; 2],
    key: ColourKey,
    get: fn(&TimeSlice) -> u64,
) -> Result<Option<Picture>, DrawingError> {
    let rows: Vec<StripRow> = results.cases.iter().filter_map(|measured| row(measured, get)).collect();
    if rows.is_empty() {
        return Ok(None);
    }
    let caption = format!(
        "Each row is a case, with its repeats side by side. Each cell is a slice of time, coloured by its multiple of the \
         median of the case: {hint}."
    );
    let drawing = Drawing::Strip(strip::svg(&rows, key)?);
    Ok(Some(Picture { title: format!("Over time: {what}"), caption, drawing }))
}

fn row(measured: &Measured, get: fn(&TimeSlice) -> u64) -> Option<StripRow> {
    let median = quantity::all_samples(measured, Hop::Tick).at_share(0.5)?.max(1) as f64;
    // Multiples of the case's own median, so that fast and slow cases share one scale of colours.
    let cell = |slice: &TimeSlice| (slice.ticks > 0).then(|| get(slice) as f64 / median);
    let groups = measured.repeats.iter().map(|repeat| repeat.strip.iter().map(cell).collect()).collect();
    Some(StripRow { name: label::case(&measured.case), groups })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::example;

    fn titles(results: &Results) -> Vec<String> {
        all(results).unwrap().into_iter().map(|picture| picture.title).collect()
    }

    #[test]
    fn every_chart_that_the_results_allow_is_drawn() {
        let titles = titles(&example::results());
        assert_eq!(
            titles,
            [
                "Tick time over the floor, closed loop",
                "Tick time by number of UAVs, closed loop",
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
    fn nothing_is_drawn_of_cases_without_repeats() {
        let mut results = example::results();
        results.cases.iter_mut().for_each(|measured| measured.repeats.clear());
        assert!(titles(&results).is_empty());
    }

    #[test]
    fn a_percentile_curve_goes_from_the_fastest_to_the_slowest() {
        let mut samples = Latencies::new();
        (1..=1000).for_each(|us| samples.record(1000 * us));
        let line = percentile_curve("x".into(), 0, &samples).unwrap();
        let [first, last] = [line.points.first(), line.points.last()].map(|point| point.unwrap().unwrap());
        // The fastest takes 1 us. Beyond 99.9 % lies one of a thousand samples: the slowest, 1000 us.
        assert_eq!(first, (0.0, 0.0));
        assert!((last.0 - 3.0).abs() < 1e-12 && (last.1 - 3.0).abs() < 1e-12, "{last:?}");
        assert!(line.points.iter().flatten().is_sorted_by(|a, b| a.0 <= b.0 && a.1 <= b.1));
    }
}
