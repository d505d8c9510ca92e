//! The progress line of a sweep: how many flights, how fast, how long still, and how many did not pass.
//!
//! Must never stop a sweep because stderr is closed.

use super::flights_of;
use crate::output;
use indicatif::{HumanDuration, ProgressBar, ProgressDrawTarget, ProgressStyle};
use ringwing_study::sweep::{Definition, Shard, Tally};
use std::time::{Duration, Instant};

/// How often the line is drawn. More often flickers; less often looks like a stall.
const DRAWS_PER_S: u8 = 5;

/// The progress of one run of a sweep.
pub(super) struct Progress {
    bar: ProgressBar,
    total: u64,
    /// With a precision, cells may need fewer flights than they may have.
    is_limit: bool,
    /// What earlier runs of the sweep have flown.
    before: Tally,
    begin: Instant,
}

impl Progress {
    pub(super) fn new(sweep: &Definition, shard: Shard, before: Tally, is_quiet: bool) -> Self {
        let target = if is_quiet {
            ProgressDrawTarget::hidden()
        } else {
            ProgressDrawTarget::stderr_with_hz(DRAWS_PER_S)
        };
        let total = flights_of(sweep, shard);
        let bar = ProgressBar::with_draw_target(Some(total), target);
        let style = ProgressStyle::with_template("{bar:24} {msg}");
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        if !is_quiet {
            let part = if shard == Shard::WHOLE { String::new() } else { format!(", shard {shard}") };
            let done =
                if before.flown > 0 { format!(", {} flown before", before.flown) } else { String::new() };
            output::note(&format!(
                "ringwing: sweep {}: {}{part}{done}",
                sweep.name,
                count(total, sweep.seeds.precision.is_some())
            ));
        }
        Self { bar, total, is_limit: sweep.seeds.precision.is_some(), before, begin: Instant::now() }
    }

    /// Shows how far this run of the sweep is.
    pub(super) fn show(&self, tally: Tally) {
        let done = self.before.flown + tally.flown;
        self.bar.set_position(done);
        self.bar.set_message(self.text(tally, self.begin.elapsed()));
    }

    fn text(&self, tally: Tally, elapsed: Duration) -> String {
        let done = self.before.flown + tally.flown;
        let failed = self.before.not_passed + tally.not_passed;
        // Only the flights of this run count: nobody knows how long the earlier ones took.
        let rate = tally.flown as f64 / elapsed.as_secs_f64().max(1e-3);
        // Without a flight the rate is 0, and `Duration` panics at the infinite time that would be left.
        let left = if tally.flown == 0 {
            String::new()
        } else {
            let left = Duration::from_secs_f64(self.total.saturating_sub(done) as f64 / rate);
            let at_most = if self.is_limit { "at most " } else { "" };
            format!(", {rate:.1}/s, {at_most}{} left", HumanDuration(left))
        };
        format!("{done} of {}{left}, {failed} not passed", count(self.total, self.is_limit))
    }

    /// Removes the line.
    pub(super) fn finish(&self) {
        self.bar.finish_and_clear();
    }
}

fn count(flights: u64, is_limit: bool) -> String {
    let plural = if flights == 1 { "" } else { "s" };
    if is_limit { format!("at most {flights} flight{plural}") } else { format!("{flights} flight{plural}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_line_has_rate_remaining_time_and_failures() {
        let before = Tally { flown: 40, not_passed: 3 };
        let progress = Progress {
            bar: ProgressBar::hidden(),
            total: 100,
            is_limit: false,
            before,
            begin: Instant::now(),
        };
        let tally = Tally { flown: 20, not_passed: 2 };
        assert_eq!(
            progress.text(tally, Duration::from_secs(10)),
            "60 of 100 flights, 2.0/s, 20 seconds left, 5 not passed"
        );
        assert_eq!(progress.text(Tally::default(), Duration::ZERO), "40 of 100 flights, 3 not passed");
    }
}
