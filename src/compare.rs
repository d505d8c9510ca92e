//! `ringwing compare`: two flights side by side, from their logs.
//!
//! Never judges: the exit code does not depend on what differs.

use crate::{
    config,
    output::{self, tell, warn_of},
    review::LoggedFlight,
};
use ringwing_recorder::flat::flattened;
use serde_json::{Value, json};
use std::{
    collections::{BTreeMap, BTreeSet},
    io,
    path::{Path, PathBuf},
    process::ExitCode,
};

/// Columns of a quantity's name. Most names are shorter.
const NAME_COLUMNS: usize = 26;
/// Columns of a value: ten digits before the point. A longer text is cut.
const VALUE_COLUMNS: usize = 18;
/// Columns of a difference: five digits before the point, and a sign.
const DIFFERENCE_COLUMNS: usize = 13;
/// Columns of the whole table, with the spaces before and between its columns.
const TABLE_COLUMNS: usize = 2 + NAME_COLUMNS + 2 * (1 + VALUE_COLUMNS) + 1 + DIFFERENCE_COLUMNS;

/// Which flights to compare.
#[derive(Debug, clap::Args)]
pub(crate) struct CompareLogsArgs {
    /// Log of the first run: its folder or the .mcap file in it, `latest`, or `-` for standard input
    a: PathBuf,
    /// Log of the second run
    b: PathBuf,
    /// Print the comparison as JSON
    #[arg(long)]
    json: bool,
}

/// Prints the quantities of both flights and their differences.
pub(crate) fn run(args: &CompareLogsArgs) -> anyhow::Result<ExitCode> {
    let [a, b] = [&args.a, &args.b].map(|log| read(&config::log(log)));
    let rows = compared(&a?, &b?);
    if args.json {
        tell(&format!("{:#}", to_json(&rows)));
    } else {
        print(&rows);
    }
    Ok(ExitCode::SUCCESS)
}

/// The quantities of the flight in `log`; warns if they are not those of one whole flight.
fn read(log: &Path) -> anyhow::Result<BTreeMap<String, Value>> {
    let flight = LoggedFlight::read(log, false)?;
    warn_of(&flight.path, &flight.notes);
    warn_of(&flight.path, &flight.summary.failures);
    Ok(quantities(&flight))
}

/// One quantity of both flights; null in a flight that does not have it.
struct ComparedQuantity {
    name: String,
    a: Value,
    b: Value,
}

impl ComparedQuantity {
    /// B minus A, if both are numbers.
    fn difference(&self) -> Option<f64> {
        Some(self.b.as_f64()? - self.a.as_f64()?)
    }
}

/// All quantities of a flight by their path in `summary.json`, without the log's path and the command to repeat the run.
fn quantities(flight: &LoggedFlight) -> BTreeMap<String, Value> {
    let summary = serde_json::from_str(&flight.summary.to_json()).unwrap_or_default();
    let mut quantities = flattened(&summary);
    // These differ between any two runs and say nothing about the flights.
    quantities.retain(|name, _| !["log", "command"].contains(&name.as_str()));
    quantities
}

fn compared(a: &BTreeMap<String, Value>, b: &BTreeMap<String, Value>) -> Vec<ComparedQuantity> {
    // A quantity that only one flight has, such as an obstacle's clearance, gets a row too.
    let names: BTreeSet<&String> = a.keys().chain(b.keys()).collect();
    let of = |flight: &BTreeMap<String, Value>, name: &str| flight.get(name).cloned().unwrap_or_default();
    let compare = |name: &String| ComparedQuantity { name: name.clone(), a: of(a, name), b: of(b, name) };
    names.into_iter().map(compare).collect()
}

fn to_json(rows: &[ComparedQuantity]) -> Value {
    let entry = |row: &ComparedQuantity| {
        let value =
            json!({ "a": row.a, "b": row.b, "difference": row.difference(), "equal": row.a == row.b });
        (row.name.clone(), value)
    };
    Value::Object(rows.iter().map(entry).collect())
}

/// Quantities that only the JSON has: values of single UAVs and collisions, and the seed that the table has as a number.
const LEFT_OUT: [&str; 3] = ["flight.", "collision_list.", "seed_text"];

/// Prints the table.
fn print(rows: &[ComparedQuantity]) {
    let is_wide = output::columns(&io::stdout()) >= TABLE_COLUMNS;
    if is_wide {
        tell(&wide("", ["A", "B", "B - A"]));
    }
    let is_shown = |row: &&ComparedQuantity| !LEFT_OUT.iter().any(|prefix| row.name.starts_with(prefix));
    for row in rows.iter().filter(is_shown) {
        let [a, b, difference] = [shown(&row.a), shown(&row.b), shown_difference(row)];
        let values = [a.as_str(), &b, &difference];
        tell(&if is_wide { wide(&row.name, values) } else { narrow(&row.name, values) });
    }
}

/// One line of a table with a column for each value. A name that is too long for its column gets a line of its own.
fn wide(name: &str, [a, b, difference]: [&str; 3]) -> String {
    let values = format!(" {a:>VALUE_COLUMNS$} {b:>VALUE_COLUMNS$} {difference:>DIFFERENCE_COLUMNS$}");
    if name.len() <= NAME_COLUMNS {
        format!("  {name:NAME_COLUMNS$}{values}")
    } else {
        format!("  {name}\n  {:NAME_COLUMNS$}{values}", "")
    }
}

/// The values below each other, for a terminal that is too narrow for the table.
fn narrow(name: &str, [a, b, difference]: [&str; 3]) -> String {
    format!("  {name}\n    A      {a}\n    B      {b}\n    B - A  {difference}")
}

fn shown_difference(row: &ComparedQuantity) -> String {
    match row.difference() {
        Some(difference) if difference != 0.0 => format!("{difference:+.6}"),
        _ if row.a == row.b => "=".into(),
        _ => "differs".into(),
    }
}

/// The text of a value, at most as wide as its column.
fn shown(value: &Value) -> String {
    match value {
        Value::Null => "-".into(),
        Value::String(text) if text.chars().count() > VALUE_COLUMNS => {
            format!("{}...", text.chars().take(VALUE_COLUMNS - 3).collect::<String>())
        }
        Value::String(text) => text.clone(),
        Value::Number(number) if number.is_f64() => format!("{:.6}", number.as_f64().unwrap_or_default()),
        other => other.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(name: &str, a: Value, b: Value) -> ComparedQuantity {
        ComparedQuantity { name: name.into(), a, b }
    }

    #[test]
    fn a_line_of_the_table_fits_80_columns_and_the_narrow_form_40() {
        let hash = Value::from("2e0766c04283bf8b5252da2f15dadfd3");
        for row in [
            row("payload_hash", hash.clone(), hash),
            row("a_quantity_with_a_name_that_is_far_too_long", Value::from(1.5), Value::from(277.033_096)),
        ] {
            let [a, b, difference] = [shown(&row.a), shown(&row.b), shown_difference(&row)];
            let values = [a.as_str(), &b, &difference];
            for (text, columns) in [(wide(&row.name, values), 80), (narrow("collisions", values), 40)] {
                assert!(text.lines().all(|line| line.chars().count() <= columns), "{text}");
                assert!(text.contains(&a) && text.contains(&difference), "{text}");
            }
        }
    }
}
