//! The table on the terminal: first tick times over the floor, then every case in detail, then where the time goes.
//!
//! Must never be wider than 110 columns, and must never show a number without its unit.

use crate::{
    case::Load,
    cells, label, machine, quantity,
    result::{Measured, Results},
};
use std::collections::BTreeSet;

/// Width of the names of cases. Longer names get a line of their own.
const NAME: usize = 42;
/// What the floor is.
pub(crate) const FLOOR: &str = "Floor: the gate alone, with as many processes and no data, in the same round. Medians of repeats (ranges).";
/// What the table of budgets is about.
pub(crate) const BUDGETS: &str = "Where the time goes: CPU time of all processes together";
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
fn opening(results: &Results) -> String {
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
fn headline(results: &Results, load: Load) -> String {
    let line = |[uavs, setup, ratio, time, repeats]: [&str; 5]| {
        format!("{uavs:>6}  {setup:<34} {ratio:>24} {time:>26} {repeats:>8}\n")
    };
    let cases = cells::by_size(results, load).into_iter();
    let rows: String =
        cases.map(|case| line(cells::headline(results, case).each_ref().map(String::as_str))).collect();
    format!(
        "Tick time, {}: {}, and its ratio to the floor\n{}{rows}  {FLOOR}\n\n",
        label::load(load),
        cells::tick_time(load),
        line(cells::HEADLINE),
    )
}

/// One case: its rate, the distributions of its hops, what was missed, and why it is incomplete.
fn block(measured: &Measured) -> String {
    let mut text = format!("{}\n", label::case(&measured.case));
    if !measured.repeats.is_empty() {
        text.extend(["  ", &cells::rate(measured), "\n"]);
        text.push_str(&distributions(measured));
    }
    if let Some(misses) = cells::misses(measured) {
        text.extend(["  ", &misses, "\n"]);
    }
    if let Some(failure) = &measured.failure {
        text.extend(["  incomplete: ", failure, "\n"]);
    }
    text + "\n"
}

fn distributions(measured: &Measured) -> String {
    let row = |hop| distribution(&cells::distribution(hop, &quantity::all_samples(measured, hop)));
    let heads: Vec<String> = cells::distribution_heads().map(Into::into).collect();
    std::iter::once(distribution(&heads)).chain(quantity::hops(measured).into_iter().map(row)).collect()
}

fn distribution(cells: &[String]) -> String {
    let last = cells.len() - 1;
    let cell = |(column, cell): (usize, &String)| match column {
        0 => format!("  {cell:<10}"),
        1 => format!(" {cell:>13}"),
        _ if column == last => format!(" {cell:>12}\n"),
        _ => format!(" {cell:>10}"),
    };
    cells.iter().enumerate().map(cell).collect()
}

/// Where the CPU time goes, case by case.
fn budgets(results: &Results) -> String {
    let row = |measured: &Measured| {
        let cells = cells::budget(measured)?;
        Some(budget_line(&label::case(&measured.case), cells.each_ref().map(String::as_str)))
    };
    let rows: String = results.cases.iter().filter_map(row).collect();
    if rows.is_empty() {
        return rows;
    }
    let heads = [cells::BUDGET.map(|(first, _)| first), cells::BUDGET.map(|(_, second)| second)];
    let heads = heads.map(|heads| budget_line("", heads)).concat();
    format!("{BUDGETS}\n{heads}{rows}\n")
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
