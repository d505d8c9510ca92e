//! `ringwing compare`: two flights side by side, from their logs.
//!
//! Never judges: the exit code does not depend on what differs.

use crate::{log_argument, review::LoggedFlight, tell, warn_of};
use ringwing_recorder::{flat::flattened, log::reader::ReadError};
use serde_json::{Value, json};
use std::{
    collections::{BTreeMap, BTreeSet},
    path::{Path, PathBuf},
    process::ExitCode,
};

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
    let [a, b] = [&args.a, &args.b].map(|log| read(&log_argument::named(log)));
    let rows = compared(&a?, &b?);
    if args.json {
        tell(&format!("{:#}", to_json(&rows)));
    } else {
        print(&rows);
    }
    Ok(ExitCode::SUCCESS)
}

/// The quantities of the flight in `log`; warns if they are not those of one whole flight.
fn read(log: &Path) -> Result<BTreeMap<String, Value>, ReadError> {
    let flight = LoggedFlight::read(log)?;
    warn_of(&flight.path, &flight.notes);
    warn_of(&flight.path, flight.summary.failures());
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
    tell(&format!("  {:<34} {:>22} {:>22} {:>14}", "", "A", "B", "B - A"));
    let is_shown = |row: &&ComparedQuantity| !LEFT_OUT.iter().any(|prefix| row.name.starts_with(prefix));
    for row in rows.iter().filter(is_shown) {
        let difference = match row.difference() {
            Some(difference) if difference != 0.0 => format!("{difference:+.6}"),
            _ if row.a == row.b => "=".into(),
            _ => "differs".into(),
        };
        tell(&format!("  {:<34} {:>22} {:>22} {difference:>14}", row.name, shown(&row.a), shown(&row.b)));
    }
}

/// The text of a value, at most as wide as its column.
fn shown(value: &Value) -> String {
    match value {
        Value::Null => "-".into(),
        Value::String(text) if text.len() > 22 => format!("{}...", text.chars().take(19).collect::<String>()),
        Value::String(text) => text.clone(),
        Value::Number(number) if number.is_f64() => format!("{:.6}", number.as_f64().unwrap_or_default()),
        other => other.to_string(),
    }
}
