//! The progress line of a hunt: how many flights, how fast, and the worst so far.
//!
//! Must never stop a hunt because stderr is closed.

use crate::output;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use ringwing_study::hunt::{Hunt, Limits, Search};
use std::time::Instant;

/// How often the line is drawn. More often flickers; less often looks like a stall.
const DRAWS_PER_S: u8 = 5;

/// The progress of one run of a hunt.
pub(super) struct Progress<'h> {
    hunt: &'h Hunt,
    bar: ProgressBar,
    total: u64,
    /// Flights of earlier runs.
    before: u64,
    begin: Instant,
}

impl<'h> Progress<'h> {
    pub(super) fn new(hunt: &'h Hunt, limits: &Limits, before: usize, is_quiet: bool) -> Self {
        let target = if is_quiet {
            ProgressDrawTarget::hidden()
        } else {
            ProgressDrawTarget::stderr_with_hz(DRAWS_PER_S)
        };
        let bar = ProgressBar::with_draw_target(Some(limits.flights), target);
        let style = ProgressStyle::with_template("{bar:24} {msg}");
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        if !is_quiet {
            let (from_s, to_s) = hunt.arena.window_s();
            let done = if before > 0 { format!(", {before} flown before") } else { String::new() };
            output::note(&format!(
                "ringwing: hunt {}: {} within {}; faults begin from {from_s} s to {to_s} s; search seed {}{done}",
                hunt.scenario.name, hunt.goal, hunt.budget, hunt.seed
            ));
        }
        Self { hunt, bar, total: limits.flights, before: before as u64, begin: Instant::now() }
    }

    /// Shows how far the hunt is.
    pub(super) fn show(&self, search: &Search) {
        self.bar.set_position(search.flights());
        self.bar.set_message(self.text(search, self.begin.elapsed().as_secs_f64()));
    }

    fn text(&self, search: &Search, elapsed_s: f64) -> String {
        // The flights of earlier runs are only read from the file. If they counted, the rate would be too high at
        // first.
        let rate = search.flights().saturating_sub(self.before) as f64 / elapsed_s.max(1e-3);
        let worst = search.worst().map_or_else(String::new, |worst| {
            let goal = &self.hunt.goal;
            format!(", {} {} in flight {}", goal, goal.brief(worst.badness), worst.number)
        });
        format!("{} of at most {} flights, {rate:.1}/s{worst}", search.flights(), self.total)
    }

    /// Removes the line.
    pub(super) fn finish(&self) {
        self.bar.finish_and_clear();
    }
}
