//! What a hunt has found, as text and as JSON.
//!
//! Never flies anything. Must never call a hunt complete that was interrupted.

use super::folder::Folder;
use crate::output::{self, tell};
use ringwing_study::{
    hunt::{Badness, End, Finding, Goal, Hunt, Hunted, brief},
    shell::quoted,
};
use serde::Serialize;
use serde_json::Value;

/// The result of a hunt.
#[derive(Debug, Serialize)]
pub(super) struct Report {
    scenario: String,
    goal: String,
    budget: String,
    search_seed: u64,
    seed: u64,
    /// Number of flights, with those of earlier runs.
    pub(super) flights: u64,
    /// Number of random beginnings.
    populations: u64,
    /// Why the hunt has ended, in a word.
    end: &'static str,
    /// The figure without the faults of the budget, in the worst flight, and in the small one. A text says that there is
    /// no number: `never`, if the swarm never got that far.
    without: Option<Value>,
    worst: Option<Value>,
    shrunk: Option<Value>,
    /// Number of the worst flight.
    worst_flight: Option<u64>,
    /// The faults of the small flight.
    faults: Vec<String>,
    /// Number of flights that made it small.
    shrink_flights: Option<usize>,
}

impl Report {
    pub(super) fn new(
        hunt: &Hunt,
        scenario: &str,
        hunted: &Hunted,
        finding: Option<&Finding>,
        is_interrupted: bool,
    ) -> Self {
        let value = |badness: Badness| value(&hunt.goal, badness);
        let worst = hunted.search.worst();
        Self {
            scenario: scenario.to_owned(),
            goal: hunt.goal.to_string(),
            budget: hunt.budget.to_string(),
            search_seed: hunt.seed,
            seed: hunt.scenario.seed,
            flights: hunted.search.flights(),
            populations: hunted.search.populations(),
            end: match hunted.end {
                End::Flights => "flights",
                End::NothingWorse => "nothing-worse",
                End::Worst => "worst",
                End::Stopped if is_interrupted => "interrupted",
                End::Stopped => "time",
            },
            without: finding.map(|finding| value(finding.without)),
            worst: worst.map(|worst| value(worst.badness)),
            shrunk: finding.map(|finding| value(finding.badness)),
            worst_flight: worst.map(|worst| worst.number),
            faults: finding.map_or_else(Vec::new, |finding| {
                finding.smallest.scenario.faults.iter().map(ToString::to_string).collect()
            }),
            shrink_flights: finding.map(|finding| finding.smallest.flights),
        }
    }

    /// Prints the result, and where it is in `folder`.
    pub(super) fn print(&self, folder: &Folder, is_json: bool) -> anyhow::Result<()> {
        if is_json {
            output::print(&format!("{}\n", serde_json::to_string_pretty(self)?));
            return Ok(());
        }
        tell(&format!("{}: {} within {}\n", self.scenario, self.goal, self.budget));
        let line = |name: &str, text: &str| tell(&format!("  {name:<15} {text}"));
        line("flights", &format!("{}, search seed {}; {}", self.flights, self.search_seed, self.why()));
        let text = |value: &Option<Value>| value.as_ref().map_or_else(String::new, shown);
        if self.shrunk.is_none() {
            line("worst", &format!("{}: no worse than without the faults of the budget", text(&self.worst)));
        } else {
            line("without faults", &text(&self.without));
            line(
                "worst",
                &format!("{}, flight {}", text(&self.worst), self.worst_flight.unwrap_or_default()),
            );
            let shrink_flights = self.shrink_flights.unwrap_or_default();
            line("made small", &format!("{}, in {shrink_flights} more flights", text(&self.shrunk)));
            self.faults.iter().for_each(|fault| line("", fault));
            line("scenario", &folder.worst().display().to_string());
        }
        line("rows", &folder.rows().display().to_string());
        if self.shrunk.is_some() {
            let path = folder.worst().display().to_string();
            // The line is for copying into a shell, and the path may have spaces.
            line("fly it", &format!("ringwing run {}", quoted(&path)));
        }
        Ok(())
    }

    fn why(&self) -> &'static str {
        match self.end {
            "flights" => "no more were allowed",
            "nothing-worse" => "nothing got worse for as long as --patience",
            "worst" => "nothing can be worse",
            "interrupted" => "interrupted",
            _ => "the time is up",
        }
    }
}

fn value(goal: &Goal, badness: Badness) -> Value {
    let text = goal.text(badness);
    match badness {
        // The text has the sign and the zero that people expect. An infinite value is no number of JSON, so it stays
        // a text.
        Badness::Of(_) => serde_json::from_str(&text).unwrap_or(Value::String(text)),
        Badness::Nothing | Badness::Never => Value::String(text),
    }
}

fn shown(value: &Value) -> String {
    match value {
        Value::String(text) => text.clone(),
        number => number.as_f64().map_or_else(|| number.to_string(), brief),
    }
}
