//! What the user sees while a run goes on, on stderr: one line that moves, and a line for each event.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use ringwing_flight::{FormationError, Level, Tick, TimedEvent};
use ringwing_scenario::Scenario;
use std::{
    io::{self, Write},
    time::Instant,
};

/// The progress line.
pub(super) struct Progress {
    bar: ProgressBar,
    quiet: bool,
    rate_hz: u32,
    uavs: u32,
    obstacle_names: Vec<String>,
    begin: Option<Instant>,
    last_tick: Tick,
    formation: Option<FormationError>,
    events: u32,
}

impl Progress {
    pub(super) fn new(scenario: &Scenario, quiet: bool) -> Self {
        let target =
            if quiet { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr_with_hz(10) };
        let bar = ProgressBar::with_draw_target(Some(scenario.last_tick().cast_unsigned()), target);
        let style =
            ProgressStyle::with_template("{bar:24} {msg}").unwrap_or_else(|_| ProgressStyle::default_bar());
        bar.set_style(style);
        Self {
            bar,
            quiet,
            rate_hz: scenario.time.rate_hz,
            uavs: scenario.formation.uavs,
            obstacle_names: scenario.obstacles.iter().map(|obstacle| obstacle.name.clone()).collect(),
            begin: None,
            last_tick: Tick(0),
            formation: None,
            events: 0,
        }
    }

    /// Prints `line` above the progress line.
    pub(super) fn say(&self, line: &str) {
        if !self.quiet {
            // Nobody may be left to read it; the flight goes on.
            self.bar.suspend(|| drop(writeln!(io::stderr(), "ringwing: {line}")));
        }
    }

    /// Prints an event.
    pub(super) fn log_event(&mut self, TimedEvent { tick, event }: &TimedEvent) {
        self.events += 1;
        let level = match event.level() {
            Level::Info => "info",
            Level::Warning => "warning",
            Level::Error => "error",
        };
        let text = event.text(|index| self.obstacle_names[index as usize].clone());
        self.say(&format!("{:8.2} s  {level}: {}", tick.seconds(self.rate_hz), text));
    }

    pub(super) fn note(&mut self, formation: &FormationError) {
        self.formation = Some(*formation);
    }

    /// Shows how far the flight is.
    pub(super) fn show(&mut self, tick: Option<Tick>) {
        let Some(tick) = tick else { return };
        let elapsed_s = self.begin.get_or_insert_with(Instant::now).elapsed().as_secs_f64();
        self.last_tick = tick.max(Tick(0));
        let flown_s = self.last_tick.seconds(self.rate_hz);
        let formation = self.formation.map_or_else(
            || "formation not measured yet".to_owned(),
            |error| {
                let FormationError { commanded, slot_error_max_m, .. } = error;
                format!("{commanded} of {} in formation, slot error {slot_error_max_m:.2} m", self.uavs)
            },
        );
        let factor = if elapsed_s > 0.0 { flown_s / elapsed_s } else { 0.0 };
        self.bar.set_position(self.last_tick.0.cast_unsigned());
        self.bar.set_message(format!("{flown_s:.1} s at {factor:.0}x, {formation}, {} events", self.events));
    }

    pub(super) fn last_tick(&self) -> i64 {
        self.last_tick.0
    }

    pub(super) fn finish(&self) {
        self.bar.finish_and_clear();
    }
}
