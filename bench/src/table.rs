//! The table on the terminal: first tick times over the floor, then every case in detail, then where the time goes.
//!
//! Must never be wider than 110 columns, and must never show a number without its unit.

use crate::{
    case::Load,
    label::{self, grouped, us},
    latencies::{Latencies, PERCENTILES},
    machine,
    quantity::{self, Budget},
    result::{Hop, Measured, Results},
};
use std::collections::BTreeSet;

/// Width of the names of cases. Longer names get a line of their own.
const NAME: usize = 42;
const FLOOR: &str = "  Floor: the gate alone, with as many processes and no data, in the same round. Medians of repeats (ranges).";
/// What the columns and rows of a case mean.
pub(crate) const LEGEND: &str = "\
Times are in us. min, percentiles and max are over all samples of all repeats; n is their number: one per tick
for the whole tick, one per tick and agent for its hops. `-`: fewer than ten samples are expected beyond it.
wake: until an agent wakes; read: until it has read its inputs; compute: until it has its answer; return:
until the world has read that; whole tick: from its start (paced: its intended start) to the last answer.
";

/// The whole table.
pub(crate) fn render(results: &Results) -> String {
    let headlines = loads(results).into_iter().map(|load| headline(results, load));
    let parts: Vec<String> = std::iter::once(opening(results))
        .chain(headlines)
        .chain(results.cases.iter().map(block))
        .chain([budgets(results), LEGEND.into(), "\n".into(), machine::render(&results.machine)])
        .collect();
    parts.concat()
}

/// What was measured and when, and what to know before reading on.
pub(crate) fn opening(results: &Results) -> String {
    let Results { ringwing, began, seed, command, .. } = results;
    let interrupted =
        if results.interrupted { "  Interrupted: these are the cases measured until then.\n" } else { "" };
    let spoilt = match results.machine.warnings.len() {
        0 => String::new(),
        1 => "  One thing on this machine spoils measurements: see the end.\n".into(),
        count => format!("  {count} things on this machine spoil measurements: see the end.\n"),
    };
    format!("ringwing bench {ringwing}, begun {began}, seed {seed}\n  {command}\n{interrupted}{spoilt}\n")
}

/// The loads that were measured: closed loop first, then by rate.
pub(crate) fn loads(results: &Results) -> BTreeSet<Load> {
    results.cases.iter().map(|measured| measured.case.load).collect()
}

/// Tick times of one load, and their ratios to the floor.
pub(crate) fn headline(results: &Results, load: Load) -> String {
    let what = match load {
        Load::Closed => "mean time from tick to tick",
        Load::Paced(_) => "median of the whole tick",
    };
    let mut cases: Vec<&Measured> = results.cases.iter().filter(|one| one.case.load == load).collect();
    // The sort is stable: cases of one size keep the order of the command line.
    cases.sort_by_key(|measured| measured.case.uavs);
    let rows: Vec<String> = cases.iter().map(|measured| headline_row(results, measured)).collect();
    format!(
        "Tick time, {load}: {what}, and its ratio to the floor\n\
         {:>6}  {:<34} {:>24} {:>26} {:>8}\n\
         {}{FLOOR}\n\n",
        "UAVs",
        "setup",
        "times the floor",
        "us",
        "repeats",
        rows.concat(),
        load = label::load(load),
    )
}

fn headline_row(results: &Results, measured: &Measured) -> String {
    let ratio = quantity::summary(&quantity::floor_ratios(results, measured), |ratio| format!("{ratio:.2}"));
    let time = quantity::summary(&quantity::tick_times_ns(measured), us);
    let (uavs, setup) = (measured.case.uavs, label::setup(&measured.case));
    format!("{uavs:>6}  {setup:<34} {ratio:>24} {time:>26} {:>8}\n", measured.repeats.len())
}

/// One case: its rate, the distributions of its hops, what was missed, and why it is incomplete.
pub(crate) fn block(measured: &Measured) -> String {
    let mut text = format!("{}\n", label::case(&measured.case));
    if !measured.repeats.is_empty() {
        text.push_str(&rate(measured));
        text.push_str(&distributions(measured));
    }
    if measured.case.load != Load::Closed {
        text.push_str(&misses(measured));
    }
    if let Some(failure) = &measured.failure {
        text.extend(["  incomplete: ", failure, "\n"]);
    }
    text + "\n"
}

fn rate(measured: &Measured) -> String {
    let per_s = quantity::summary(&quantity::ticks_per_s(measured), |ticks| grouped(ticks.round() as u64));
    let ticks: u64 = measured.repeats.iter().map(|repeat| repeat.ticks).sum();
    let repeats = match measured.repeats.len() {
        1 => "1 repeat".into(),
        count => format!("{count} repeats"),
    };
    format!("  {per_s} ticks/s; {} ticks in {repeats}\n", grouped(ticks))
}

fn distributions(measured: &Measured) -> String {
    let names: Vec<String> = PERCENTILES.iter().map(|(name, _)| format!(" {name:>10}")).collect();
    let mut text = format!("  {:<10} {:>13} {:>10}{} {:>12}\n", "us", "n", "min", names.concat(), "max");
    let row = |hop| distribution(hop, &quantity::all_samples(measured, hop));
    text.extend(quantity::hops(measured).into_iter().map(row));
    text
}

fn distribution(hop: Hop, samples: &Latencies) -> String {
    let shown = |ns: Option<u64>| ns.map_or_else(|| "-".into(), |ns| us(ns as f64));
    let (hop, n, min, max) =
        (label::hop(hop), grouped(samples.n()), shown(samples.min_ns()), shown(samples.max_ns()));
    let percentiles: Vec<String> =
        PERCENTILES.iter().map(|(_, q)| format!(" {:>10}", shown(samples.percentile(*q)))).collect();
    format!("  {hop:<10} {n:>13} {min:>10}{} {max:>12}\n", percentiles.concat())
}

fn misses(measured: &Measured) -> String {
    let repeats = &measured.repeats;
    let ticks: u64 = repeats.iter().map(|repeat| repeat.ticks).sum();
    let missed: u64 = repeats.iter().map(|repeat| repeat.missed_deadlines).sum();
    let reused: u64 = repeats.iter().map(|repeat| repeat.reused_commands).sum();
    format!(
        "  missed deadlines: {} of {}; reused commands: {} of {}\n",
        grouped(missed),
        grouped(ticks),
        grouped(reused),
        // Every airframe flies every tick on some command.
        grouped(ticks * u64::from(measured.case.uavs))
    )
}

/// Where the CPU time goes, case by case.
pub(crate) fn budgets(results: &Results) -> String {
    let rows: Vec<(&Measured, Budget)> =
        results.cases.iter().filter_map(|measured| Some((measured, quantity::budget(measured)?))).collect();
    if rows.is_empty() {
        return String::new();
    }
    let heads = [
        "Where the time goes: CPU time of all processes together\n".into(),
        budget_line("", ["us", "kernel", "iceoryx2", "law", "switches", "of these", "agent's"]),
        budget_line("", ["per tick", "%", "%", "%", "per tick", "forced", "PSS, MB"]),
    ];
    let rows = rows.iter().map(|(measured, budget)| budget_row(measured, *budget));
    heads.into_iter().chain(rows).chain(["\n".into()]).collect()
}

fn budget_row(measured: &Measured, budget: Budget) -> String {
    let percent = |share: f64| format!("{:.1}", 100.0 * share);
    let or_dash = |text: Option<String>| text.unwrap_or_else(|| "-".into());
    let pss = quantity::agent_pss_bytes(measured).map(|bytes| format!("{:.2}", bytes as f64 / 1e6));
    let columns = [
        us(budget.cpu_ns),
        percent(budget.kernel),
        or_dash(budget.ipc.map(percent)),
        or_dash(budget.law.map(percent)),
        format!("{:.2}", budget.switches),
        format!("{:.2}", budget.forced),
        or_dash(pss),
    ];
    budget_line(&label::case(&measured.case), columns.each_ref().map(String::as_str))
}

/// One line, or two if the name is longer than its column.
fn budget_line(name: &str, columns: [&str; 7]) -> String {
    let [cpu, kernel, ipc, law, all, forced, pss] = columns;
    // Break the line, so that the columns stay aligned.
    let line_break = if name.len() > NAME { format!("\n  {:NAME$}", "") } else { String::new() };
    format!(
        "  {name:<NAME$}{line_break} {cpu:>8} {kernel:>7} {ipc:>9} {law:>6} {all:>9} {forced:>9} {pss:>9}\n"
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{case::Carrier, example};
    use ringwing_scenario::Wake;

    /// The example's cases with six UAVs, without the pipe.
    fn six() -> Results {
        let mut results = example::results();
        results.cases.retain(|one| one.case.uavs == 6 && one.case.carrier != Carrier::Pipe);
        results
    }

    #[test]
    fn the_table_reads_as_in_the_golden_file() {
        let text = render(&six());
        assert_eq!(
            text,
            include_str!("table.golden"),
            "if the change is intended, update table.golden:\n{text}"
        );
    }

    #[test]
    fn no_line_is_wider_than_a_terminal() {
        let mut results = example::results();
        for measured in &mut results.cases {
            measured.case.wake = Wake::Event;
            measured.case.recorder = true;
            measured.case.payload_bytes = 65_536;
        }
        for line in render(&results).lines() {
            assert!(line.chars().count() <= 110, "{}: {line}", line.chars().count());
        }
    }

    #[test]
    fn interrupted_and_failed_measurements_say_so() {
        let mut results = six();
        results.interrupted = true;
        results.cases[0].failure = Some("the world was killed".into());
        results.cases[1].repeats.clear();
        let text = render(&results);
        assert!(text.contains("Interrupted: these are the cases measured until then"), "{text}");
        assert!(text.contains("incomplete: the world was killed"), "{text}");
        assert!(
            text.contains("gate alone, 6 UAVs, closed loop\n\n"),
            "no figures of a case without repeats: {text}"
        );
    }
}
