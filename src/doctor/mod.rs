//! `ringwing doctor`: whether this machine is fit to fly swarms, in about a second.
//!
//! Never changes anything: its one flight leaves nothing behind. What spoils a measurement is the business of
//! `ringwing bench --doctor`.

mod clock;
mod flight;
mod room;

use crate::{
    FAILED,
    output::{self, BAD, DOUBTFUL, GOOD, painted, print, wrapped},
};
use serde::Serialize;
use std::{fmt::Write, io, process::ExitCode};

/// Columns of the name of a check.
const NAME_COLUMNS: usize = 15;
/// Columns of its grade.
const GRADE_COLUMNS: usize = 10;

/// What to print.
#[derive(Debug, clap::Args)]
pub(crate) struct DoctorArgs {
    /// Print the checks as JSON
    #[arg(long)]
    json: bool,
}

/// How a check went.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
enum Grade {
    /// As it should be.
    Fit,
    /// Swarms fly, with the limits that the check names.
    Limited,
    /// No swarm can fly.
    Unfit,
}

/// One property of the machine.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
struct Check {
    name: &'static str,
    grade: Grade,
    /// What was found, and what to do about it.
    finding: String,
}

/// Checks the machine; the exit code is 1 if it is unfit.
pub(crate) fn run(args: &DoctorArgs) -> anyhow::Result<ExitCode> {
    let checks = [
        room::check(),
        clock::check_source(),
        clock::check_timer(),
        room::check_cores(),
        room::check_real_time(),
        flight::check()?,
    ];
    let worst = checks.iter().map(|check| check.grade).max().unwrap_or(Grade::Fit);
    if args.json {
        let report = serde_json::json!({ "fit": worst != Grade::Unfit, "checks": checks });
        print(&(serde_json::to_string_pretty(&report)? + "\n"));
    } else {
        let is_coloured = output::is_coloured(&io::stdout());
        print(&rendered(&checks, output::columns(&io::stdout()), is_coloured));
        print(&format!("\n{}\n", verdict(worst)));
    }
    Ok(if worst == Grade::Unfit { ExitCode::from(FAILED) } else { ExitCode::SUCCESS })
}

/// A paragraph for each check, in lines of at most `columns`.
fn rendered(checks: &[Check], columns: usize, is_coloured: bool) -> String {
    let indent = NAME_COLUMNS + GRADE_COLUMNS;
    let mut text = String::new();
    for Check { name, grade, finding } in checks {
        let (style, word) = match grade {
            Grade::Fit => (GOOD, "fit"),
            Grade::Limited => (DOUBTFUL, "limited"),
            Grade::Unfit => (BAD, "unfit"),
        };
        // Pad before painting: escape sequences count as characters.
        let grade = painted(style, &format!("{word:GRADE_COLUMNS$}"), is_coloured);
        // Below some width a column of findings would have one word a line.
        let width = columns.saturating_sub(indent).max(columns / 2);
        let lines = wrapped(finding, width);
        // Writing to a text cannot fail.
        let _ = writeln!(text, "{name:NAME_COLUMNS$}{grade}{}", lines[0]);
        let rest = columns.saturating_sub(width).min(indent);
        for line in &lines[1..] {
            let _ = writeln!(text, "{:rest$}{line}", "");
        }
    }
    text
}

fn verdict(worst: Grade) -> &'static str {
    match worst {
        Grade::Fit => "This machine is fit to fly.",
        Grade::Limited => "This machine is fit to fly, within the limits above.",
        Grade::Unfit => "This machine is not fit to fly.",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn findings_are_broken_to_the_width_of_the_terminal() {
        let finding = "room for 178 UAVs; ".repeat(9);
        let checks = [
            Check { name: "room", grade: Grade::Limited, finding: finding.trim().into() },
            Check { name: "clock", grade: Grade::Fit, finding: "tsc".into() },
        ];
        for columns in [60, 80, 110] {
            let text = rendered(&checks, columns, false);
            assert!(text.lines().all(|line| line.chars().count() <= columns), "{text}");
            assert!(text.contains("limited") && text.contains("fit       tsc"), "{text}");
        }
    }

    #[test]
    fn the_worst_grade_decides() {
        assert!(Grade::Fit < Grade::Limited && Grade::Limited < Grade::Unfit);
        assert!(verdict(Grade::Unfit).contains("not fit"));
    }
}
