//! What a search has found, as text and as JSON.
//!
//! Never flies or computes a margin. Must never show a value of a search that found none.

use ringwing_study::margin::{Decision, Finding, Plan, Question, Search, Tried};
use serde::Serialize;
use std::fmt::Write;

/// A difference between flights and theory above this share deserves a look. The flown interval is a hundredth of the range
/// by default, so much less would be resolution.
const AGREES: f64 = 0.05;

/// The result of a search.
#[derive(Debug, Serialize)]
pub(super) struct Report {
    scenario: String,
    of: String,
    between: [f64; 2],
    success: f64,
    confidence: f64,
    first_seed: u64,
    /// What was found, in a word.
    finding: &'static str,
    /// The margin, with its interval; `None` if the range does not contain it.
    value: Option<f64>,
    low: Option<f64>,
    high: Option<f64>,
    /// Number of flights that counted.
    flights: u64,
    /// The flights at each value, in the order in which they were flown.
    values: Vec<Flown>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    theory: Vec<TheoryLine>,
    /// The flown margin over that of theory, less 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    flown_over_theory: Option<f64>,
}

/// The flights at one value.
#[derive(Debug, Serialize)]
struct Flown {
    value: f64,
    flights: u64,
    passed: u64,
    success: f64,
    success_low: f64,
    success_high: f64,
    decision: Decision,
}

/// A margin of the linearised law.
#[derive(Debug, Serialize)]
pub(super) struct TheoryLine {
    /// Which data are late.
    pub(super) late: &'static str,
    /// The margin in seconds; `None` if the search finds no unstable delay.
    pub(super) margin_s: Option<f64>,
    /// The bound of dead reckoning in seconds.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) bound_s: Option<f64>,
    /// The margin in the unit of the number that was flown, if that number delays these data.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) number: Option<f64>,
}

impl Report {
    pub(super) fn new(
        scenario: &str,
        question: &Question,
        plan: &Plan,
        search: &Search,
        theory: Vec<TheoryLine>,
    ) -> Self {
        let finding = search.finding();
        // A search that was stopped has a bracket, but not the one that was asked for.
        let is_over = search.next().is_none();
        let (value, low, high) = match finding {
            Finding::Margin { value, low, high } => (Some(value), Some(low), Some(high)),
            _ => (None, None, None),
        };
        let flown_number = theory.iter().find_map(|line| line.number);
        let values: Vec<_> = search.tried().iter().map(flown).collect();
        Self {
            scenario: scenario.to_owned(),
            of: question.of.clone(),
            between: [question.range.from, question.range.to],
            success: plan.success,
            confidence: plan.confidence,
            first_seed: plan.first_seed,
            finding: if is_over { word(finding) } else { "interrupted" },
            value: value.filter(|_| is_over),
            low,
            high,
            flights: values.iter().map(|flown| flown.flights).sum(),
            values,
            theory,
            flown_over_theory: value
                .filter(|_| is_over)
                .zip(flown_number)
                .map(|(value, number)| value / number - 1.0),
        }
    }

    /// Why there is no margin; `None` if there is one.
    pub(super) fn failure(&self) -> Option<String> {
        let [from, to] = self.between;
        let percent = percent(self.success);
        let range = format!("between {from} and {to}");
        Some(match self.finding {
            "margin" => return None,
            "succeeds-everywhere" => {
                format!(
                    "flights succeed everywhere {range}: at {to}, too, more than {percent} pass; go further with --between"
                )
            }
            "fails-everywhere" => {
                format!(
                    "flights fail everywhere {range}: at {from} already, less than {percent} pass; begin with a value that \
                         flights stand"
                )
            }
            "rises" => {
                format!("success rises from {from} to {to}: turn the range round, --between {to}..{from}")
            }
            "unclear" => {
                let end = self
                    .values
                    .iter()
                    .find(|flown| flown.decision == Decision::Undecided)
                    .map_or(from, |flown| flown.value);
                format!(
                    "at {end}, success is too close to {percent} to tell: give another range with --between, or more \
                         flights with --flights-max"
                )
            }
            _ => match self.low.zip(self.high) {
                Some((low, high)) => {
                    format!("interrupted after {} flights; so far between {low} and {high}", self.flights)
                }
                None => format!("interrupted after {} flights", self.flights),
            },
        })
    }

    /// The result as text.
    pub(super) fn text(&self) -> String {
        let mut text = format!("{} of {}, seeds from {}\n", self.of, self.scenario, self.first_seed);
        if let (Some(value), Some(low), Some(high)) = (self.value, self.low, self.high) {
            // Writing into a `String` cannot fail.
            let _ = writeln!(
                text,
                "  margin     {value} ({low} to {high} with a confidence of {}): success falls below {}",
                percent(self.confidence),
                percent(self.success)
            );
        }
        let _ = writeln!(text, "  flights    {} at {} values", self.flights, self.values.len());
        text += &self.values_text();
        text += &self.theory_text();
        text
    }

    fn values_text(&self) -> String {
        let mut text =
            format!("\n  {:>12} {:>8} {:>8}  {:<26} decision\n", "value", "flights", "passed", "success");
        let mut sorted: Vec<&Flown> = self.values.iter().collect();
        sorted.sort_by(|one, other| one.value.total_cmp(&other.value));
        for flown in sorted {
            let success = format!(
                "{} ({} to {})",
                percent(flown.success),
                percent(flown.success_low),
                percent(flown.success_high)
            );
            let decision = match flown.decision {
                Decision::Above => "enough",
                Decision::Below => "too little",
                Decision::Undecided => "cannot be told",
            };
            let _ = writeln!(
                text,
                "  {:>12} {:>8} {:>8}  {success:<26} {decision}",
                flown.value, flown.flights, flown.passed
            );
        }
        text
    }

    fn theory_text(&self) -> String {
        if self.theory.is_empty() {
            return String::new();
        }
        let mut text = "\n  linearised law: stable up to a delay of\n".to_owned();
        for line in &self.theory {
            let margin = line.margin_s.map_or("no limit".into(), |margin_s| format!("{margin_s:.4} s"));
            let bound = line.bound_s.map_or(String::new(), |bound_s| format!(", never above {bound_s:.4} s"));
            let _ = writeln!(text, "  {:<24} {margin}{bound}{}", line.late, self.compared(line));
        }
        if self.theory.iter().all(|line| line.number.is_none()) {
            text += "  none of them is a limit of what was flown\n";
        }
        text
    }

    fn compared(&self, line: &TheoryLine) -> String {
        match (line.number, self.flown_over_theory) {
            (Some(number), Some(more)) => {
                let verdict = if more.abs() <= AGREES { "agree" } else { "differ" };
                format!("  <- {number:.4}; flown {:+.1} %, they {verdict}", 100.0 * more)
            }
            (Some(number), None) => format!("  <- {number:.4}"),
            (None, _) => String::new(),
        }
    }
}

fn flown(tried: &Tried) -> Flown {
    let share = tried.trial.share();
    Flown {
        value: tried.value,
        flights: tried.trial.flights(),
        passed: tried.trial.passed,
        success: share.value,
        success_low: share.low,
        success_high: share.high,
        decision: tried.decision,
    }
}

fn word(finding: Finding) -> &'static str {
    match finding {
        Finding::Margin { .. } => "margin",
        Finding::SucceedsEverywhere => "succeeds-everywhere",
        Finding::FailsEverywhere => "fails-everywhere",
        Finding::Rises => "rises",
        Finding::Unclear(_) => "unclear",
    }
}

fn percent(share: f64) -> String {
    // Without the zeros that `{:.1}` would add to whole numbers.
    format!("{} %", (share * 1000.0).round() / 10.0)
}
