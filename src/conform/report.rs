//! The report on a controller: a line for each check, what decisions cost, and the verdict.
//!
//! Never decides whether a controller is fit; it counts what the checks decided.

use super::checks::Check;
use crate::output::{BAD, DOUBTFUL, GOOD, is_coloured, painted};
use ringwing_flight::Latency;
use serde::Serialize;
use std::{io, iter, path::PathBuf};

/// How a check ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Grade {
    /// The controller passes.
    Fit,
    /// It does not.
    NotFit,
    /// Not flown, because the controller does not even answer.
    Skipped,
}

/// The result of a check.
#[derive(Debug, Serialize)]
pub(super) struct Row {
    check: &'static str,
    asks: &'static str,
    pub(super) grade: Grade,
    /// Why it does not pass.
    reasons: Vec<String>,
    /// The folders of its flights.
    folders: Vec<PathBuf>,
}

/// All that was found about a controller.
#[derive(Debug, Serialize)]
pub(super) struct Report {
    /// Its command, or the built-in law.
    controller: String,
    /// Whether it passes every check.
    fit: bool,
    checks: Vec<Row>,
    /// How long decisions take: the slowest agent of each tick, from its inputs to its answer.
    latency: Option<Latency>,
}

impl Row {
    /// The result of a check that was flown.
    pub(super) fn flown(check: &Check, reasons: Vec<String>, folders: Vec<PathBuf>) -> Self {
        let grade = if reasons.is_empty() { Grade::Fit } else { Grade::NotFit };
        Self { check: check.name, asks: check.asks, grade, reasons, folders }
    }

    /// The result of a check that is left out.
    pub(super) fn skipped(check: &Check) -> Self {
        Self {
            check: check.name,
            asks: check.asks,
            grade: Grade::Skipped,
            reasons: Vec::new(),
            folders: Vec::new(),
        }
    }

    /// What the terminal shows of it: a line, and one for each reason.
    pub(super) fn text(&self) -> String {
        let (style, word) = match self.grade {
            Grade::Fit => (GOOD, "fit"),
            Grade::NotFit => (BAD, "not fit"),
            Grade::Skipped => (DOUBTFUL, "skipped"),
        };
        // Pad outside the style: escape sequences count as characters.
        let pad = " ".repeat(9 - word.len());
        let line = format!("  {}{pad}{:11}{}\n", shown(style, word), self.check, self.asks);
        let reasons = self.reasons.iter().map(|reason| format!("             {reason}\n"));
        iter::once(line).chain(reasons).collect()
    }
}

impl Report {
    /// The report from the results of all checks.
    pub(super) fn new(controller: String, checks: Vec<Row>, latency: Option<Latency>) -> Self {
        let fit = checks.iter().all(|row| row.grade == Grade::Fit);
        Self { controller, fit, checks, latency }
    }

    /// Whether the controller passes every check.
    pub(super) fn is_fit(&self) -> bool {
        self.fit
    }

    /// What the terminal shows after the checks.
    pub(super) fn end(&self) -> String {
        let latency = self.latency.map_or_else(String::new, |latency| {
            let Latency { p50_us, p99_us, max_us } = latency;
            format!("  a tick's slowest decision: median {p50_us:.0} us, 99 % {p99_us:.0} us, longest {max_us:.0} us\n")
        });
        let verdict = if self.fit { shown(GOOD, "fit") } else { shown(BAD, "not fit") };
        format!("\n{latency}  verdict  {verdict}\n")
    }

    /// The report for programs.
    pub(super) fn to_json(&self) -> serde_json::Result<String> {
        Ok(serde_json::to_string_pretty(self)? + "\n")
    }
}

fn shown(style: anstyle::Style, text: &str) -> String {
    painted(style, text, is_coloured(&io::stdout()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conform::checks::CHECKS;

    #[test]
    fn one_check_that_is_not_passed_or_not_flown_makes_a_controller_unfit() {
        let fit = || Row::flown(&CHECKS[0], Vec::new(), Vec::new());
        let unfit = Row::flown(&CHECKS[1], vec!["at tick 7, it dives".into()], Vec::new());
        assert!(
            unfit.text().contains("not fit") && unfit.text().contains("at tick 7, it dives"),
            "{}",
            unfit.text()
        );
        assert!(Report::new("mine".into(), vec![fit(), fit()], None).is_fit());
        for other in [unfit, Row::skipped(&CHECKS[1])] {
            let report = Report::new("mine".into(), vec![fit(), other], None);
            assert!(!report.is_fit() && report.end().contains("not fit"), "{report:?}");
        }
    }
}
