//! The progress line of a search: the value that is being flown, and how it goes.
//!
//! Must never stop a search because stderr is closed.

use indicatif::{ProgressBar, ProgressDrawTarget};
use ringwing_study::margin::{Search, Trial};

/// How often the line is drawn. More often flickers; less often looks like a stall.
const DRAWS_PER_S: u8 = 5;

/// The progress line.
pub(super) struct Progress(ProgressBar);

impl Progress {
    pub(super) fn new(is_quiet: bool) -> Self {
        let target = if is_quiet {
            ProgressDrawTarget::hidden()
        } else {
            ProgressDrawTarget::stderr_with_hz(DRAWS_PER_S)
        };
        Self(ProgressBar::with_draw_target(None, target))
    }

    /// Shows the flights at `value`.
    pub(super) fn show(&self, search: &Search, value: f64, trial: &Trial) {
        let before: u64 = search.tried().iter().map(|tried| tried.trial.flights()).sum();
        let number = search.tried().len() + 1;
        self.0.set_message(format!(
            "value {number}: {value}, {} of {} flights passed; {} flights in all",
            trial.passed,
            trial.flights(),
            before + trial.flights()
        ));
        self.0.tick();
    }

    /// Removes the line.
    pub(super) fn finish(&self) {
        self.0.finish_and_clear();
    }
}
