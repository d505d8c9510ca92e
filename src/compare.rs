//! `ringwing compare`: two flights side by side, from their logs.

use crate::{review::Flight, tell};
use ringwing_recorder::flat::flattened;
use serde_json::{Map, Value, json};
use std::{
    collections::{BTreeMap, BTreeSet},
    path::PathBuf,
    process::ExitCode,
};

/// Which flights to compare.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// The log of one run
    a: PathBuf,
    /// The log of the other
    b: PathBuf,
    /// Print the comparison as JSON
    #[arg(long)]
    json: bool,
}

/// Compares.
pub(crate) fn run(args: &Args) -> anyhow::Result<ExitCode> {
    let [a, b] = [&args.a, &args.b].map(|log| Flight::read(log).map(|flight| numbers(&flight)));
    let rows = rows(&a?, &b?);
    if args.json {
        tell(&format!("{:#}", to_json(&rows)));
    } else {
        print(&rows);
    }
    Ok(ExitCode::SUCCESS)
}

/// One quantity of both flights.
struct Row {
    name: String,
    a: Value,
    b: Value,
}

impl Row {
    fn difference(&self) -> Option<f64> {
        Some(self.b.as_f64()? - self.a.as_f64()?)
    }
}

/// All quantities of a flight by their path; where it lies and how it is repeated are none.
fn numbers(flight: &Flight) -> BTreeMap<String, Value> {
    let summary = serde_json::from_str(&flight.summary.to_json()).unwrap_or_default();
    let mut numbers = flattened(&summary);
    numbers.retain(|name, _| !["log", "command"].contains(&name.as_str()));
    numbers
}

fn rows(a: &BTreeMap<String, Value>, b: &BTreeMap<String, Value>) -> Vec<Row> {
    let names: BTreeSet<&String> = a.keys().chain(b.keys()).collect();
    let of = |flight: &BTreeMap<String, Value>, name: &str| flight.get(name).cloned().unwrap_or_default();
    names.into_iter().map(|name| Row { name: name.clone(), a: of(a, name), b: of(b, name) }).collect()
}

fn to_json(rows: &[Row]) -> Value {
    let entry = |row: &Row| {
        let value =
            json!({ "a": row.a, "b": row.b, "difference": row.difference(), "equal": row.a == row.b });
        (row.name.clone(), value)
    };
    Value::Object(rows.iter().map(entry).collect())
}

/// What each UAV did is in the JSON only.
fn print(rows: &[Row]) {
    tell(&format!("  {:<34} {:>22} {:>22} {:>14}", "", "A", "B", "B - A"));
    for row in rows.iter().filter(|row| !row.name.starts_with("flight.")) {
        let difference = match row.difference() {
            Some(difference) if difference != 0.0 => format!("{difference:+.6}"),
            _ if row.a == row.b => "=".into(),
            _ => "differs".into(),
        };
        tell(&format!("  {:<34} {:>22} {:>22} {difference:>14}", row.name, shown(&row.a), shown(&row.b)));
    }
}

fn shown(value: &Value) -> String {
    match value {
        Value::Null => "-".into(),
        Value::String(text) if text.len() > 22 => format!("{}...", text.chars().take(19).collect::<String>()),
        Value::String(text) => text.clone(),
        Value::Number(number) if number.is_f64() => format!("{:.6}", number.as_f64().unwrap_or_default()),
        other => other.to_string(),
    }
}
