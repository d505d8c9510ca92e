//! What the user sees on stderr while a run goes on: one line that shows how far it is, and a line for each event.
//!
//! Must never stop a run because stderr is closed.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use ringwing_flight::{FormationError, Level, Tick, TimedEvent};
use ringwing_scenario::Scenario;
use std::{
    io::{self, Write},
    time::Instant,
};

/// How often the line is drawn. More often flickers and costs the flight processor time; less often looks like a stall.
const DRAWS_PER_S: u8 = 10;

/// The progress line, and the lines above it.
pub(crate) struct Progress<'a> {
    scenario: &'a Scenario,
    bar: ProgressBar,
    is_quiet: bool,
    begin: Option<Instant>,
    last_tick: Tick,
    formation: Option<FormationError>,
    events: u32,
}

impl<'a> Progress<'a> {
    /// The progress of a flight of `scenario`; shows nothing if `is_quiet`.
    pub(crate) fn new(scenario: &'a Scenario, is_quiet: bool) -> Self {
        let target = if is_quiet {
            ProgressDrawTarget::hidden()
        } else {
            ProgressDrawTarget::stderr_with_hz(DRAWS_PER_S)
        };
        let bar = ProgressBar::with_draw_target(Some(scenario.last_tick().cast_unsigned()), target);
        let style = ProgressStyle::with_template("{bar:24} {msg}");
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        Self { scenario, bar, is_quiet, begin: None, last_tick: Tick(0), formation: None, events: 0 }
    }

    /// Prints `line` above the progress line.
    pub(crate) fn print(&self, line: &str) {
        if !self.is_quiet {
            // The flight goes on even if stderr is closed.
            self.bar.suspend(|| drop(writeln!(io::stderr(), "ringwing: {line}")));
        }
    }

    /// Prints an event.
    pub(crate) fn print_event(&mut self, TimedEvent { tick, event }: &TimedEvent) {
        self.events += 1;
        let level = match event.level() {
            Level::Info => "info",
            Level::Warning => "warning",
            Level::Error => "error",
        };
        let (time_s, text) = (tick.seconds(self.scenario.time.rate_hz), self.scenario.event_text(event));
        self.print(&format!("{time_s:8.2} s  {level}: {text}"));
    }

    /// Shows this formation error from the next update on.
    pub(crate) fn set_formation_error(&mut self, formation: &FormationError) {
        self.formation = Some(*formation);
    }

    /// Shows that the flight has come to `tick`.
    pub(crate) fn update(&mut self, tick: Option<Tick>) {
        let Some(tick) = tick else { return };
        self.last_tick = tick.max(Tick(0));
        let elapsed_s = self.begin.get_or_insert_with(Instant::now).elapsed().as_secs_f64();
        let flown_s = self.last_tick.seconds(self.scenario.time.rate_hz);
        let factor = if elapsed_s > 0.0 { flown_s / elapsed_s } else { 0.0 };
        let (formation, events) = (self.formation_text(), self.events);
        self.bar.set_position(self.last_tick.0.cast_unsigned());
        self.bar.set_message(format!("{flown_s:.1} s at {factor:.0}x, {formation}, {events} events"));
    }

    fn formation_text(&self) -> String {
        let Some(FormationError { commanded, slot_error_max_m, .. }) = self.formation else {
            return "formation not measured yet".into();
        };
        let uavs = self.scenario.formation.uavs;
        format!("{commanded} of {uavs} in formation, slot error {slot_error_max_m:.2} m")
    }

    /// The last tick that was shown.
    pub(crate) fn last_tick(&self) -> Tick {
        self.last_tick
    }

    /// Removes the progress line.
    pub(crate) fn finish(&self) {
        self.bar.finish_and_clear();
    }
}
