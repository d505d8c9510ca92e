//! What the rows of the tables say: the same words and figures on the terminal and on the page.
//!
//! Must never align anything, and must never show a number whose unit its column does not name.

use crate::{
    case::Load,
    label::{self, grouped, us},
    latencies::{Latencies, PERCENTILES},
    quantity,
    result::{Hop, Measured, Results},
};
use std::iter;

/// The columns of [`headline`].
pub(crate) const HEADLINE: [&str; 5] = ["UAVs", "setup", "times the floor", "us", "repeats"];
/// The columns of [`budget`], in two lines.
pub(crate) const BUDGET: [(&str, &str); 7] = [
    ("us", "per tick"),
    ("kernel", "%"),
    ("iceoryx2", "%"),
    ("law", "%"),
    ("switches", "per tick"),
    ("of these", "forced"),
    ("agent's", "PSS, MB"),
];

/// The cases of one load by their size.
pub(crate) fn by_size(results: &Results, load: Load) -> Vec<&Measured> {
    let mut cases: Vec<&Measured> = results.cases.iter().filter(|one| one.case.load == load).collect();
    // The sort is stable: cases of one size keep the order of the command line.
    cases.sort_by_key(|measured| measured.case.uavs);
    cases
}

/// What the tick time of a load is.
pub(crate) fn tick_time(load: Load) -> &'static str {
    match load {
        Load::Closed => "mean time from tick to tick",
        Load::Paced(_) => "median of the whole tick",
    }
}

/// The tick time of a case, and its ratio to the floor.
pub(crate) fn headline(results: &Results, measured: &Measured) -> [String; 5] {
    let ratio = quantity::summary(&quantity::floor_ratios(results, measured), |ratio| format!("{ratio:.2}"));
    let time = quantity::summary(&quantity::tick_times_ns(measured), us);
    let (uavs, setup) = (measured.case.uavs, label::setup(&measured.case));
    [uavs.to_string(), setup, ratio, time, measured.repeats.len().to_string()]
}

/// The columns of [`distribution`].
pub(crate) fn distribution_heads() -> impl Iterator<Item = &'static str> {
    let percentiles = PERCENTILES.iter().map(|(name, _)| *name);
    ["us", "n", "min"].into_iter().chain(percentiles).chain(iter::once("max"))
}

/// The distribution of a hop.
pub(crate) fn distribution(hop: Hop, samples: &Latencies) -> Vec<String> {
    let shown = |ns: Option<u64>| ns.map_or_else(|| "-".into(), |ns| us(ns as f64));
    let percentiles = PERCENTILES.iter().map(|(_, q)| shown(samples.percentile(*q)));
    let begin = [label::hop(hop).to_owned(), grouped(samples.n()), shown(samples.min_ns())];
    begin.into_iter().chain(percentiles).chain(iter::once(shown(samples.max_ns()))).collect()
}

/// How often a case ticks, and how many ticks were measured.
pub(crate) fn rate(measured: &Measured) -> String {
    let per_s = quantity::summary(&quantity::ticks_per_s(measured), |ticks| grouped(ticks.round() as u64));
    let ticks: u64 = measured.repeats.iter().map(|repeat| repeat.ticks).sum();
    let repeats = match measured.repeats.len() {
        1 => "1 repeat".into(),
        count => format!("{count} repeats"),
    };
    format!("{per_s} ticks/s; {} ticks in {repeats}", grouped(ticks))
}

/// What a paced case missed; `None` in a closed loop, which has no deadlines.
pub(crate) fn misses(measured: &Measured) -> Option<String> {
    let repeats = &measured.repeats;
    let ticks: u64 = repeats.iter().map(|repeat| repeat.ticks).sum();
    let missed: u64 = repeats.iter().map(|repeat| repeat.missed_deadlines).sum();
    let reused: u64 = repeats.iter().map(|repeat| repeat.reused_commands).sum();
    (measured.case.load != Load::Closed).then(|| {
        format!(
            "missed deadlines: {} of {}; reused commands: {} of {}",
            grouped(missed),
            grouped(ticks),
            grouped(reused),
            // Every airframe flies every tick on some command.
            grouped(ticks * u64::from(measured.case.uavs))
        )
    })
}

/// Where the CPU time of a case goes; `None` if that was not measured.
pub(crate) fn budget(measured: &Measured) -> Option<[String; 7]> {
    let budget = quantity::budget(measured)?;
    let percent = |share: f64| format!("{:.1}", 100.0 * share);
    let or_dash = |text: Option<String>| text.unwrap_or_else(|| "-".into());
    let pss = quantity::agent_pss_bytes(measured).map(|bytes| format!("{:.2}", bytes as f64 / 1e6));
    Some([
        us(budget.cpu_ns),
        percent(budget.kernel),
        or_dash(budget.ipc.map(percent)),
        or_dash(budget.law.map(percent)),
        format!("{:.2}", budget.switches),
        format!("{:.2}", budget.forced),
        or_dash(pss),
    ])
}
