//! What the user sees on stderr while a run goes on: one line that shows how far it is, and a line for each event.
//!
//! Must never stop a run because stderr is closed.

use crate::output;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use ringwing_flight::{Event, FormationError, Level, Tick, TimedEvent, counted, real_time_factor};
use ringwing_scenario::Scenario;
use std::{io, time::Instant};

/// How often the line is drawn. More often flickers and costs the flight processor time; less often looks like a stall.
const DRAWS_PER_S: u8 = 10;
/// Narrowest terminal with a bar in the progress line. On a narrower one, the bar would leave no place for the text.
const BAR_COLUMNS_MIN: usize = 60;

/// The progress line, and the lines above it.
pub(crate) struct Progress<'a> {
    scenario: &'a Scenario,
    bar: ProgressBar,
    is_quiet: bool,
    /// When the first tick was shown, and its simulated time.
    begin: Option<(Instant, f64)>,
    last_tick: Tick,
    is_paused: bool,
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
        // The text is cut at the edge of the terminal: a line that wraps could not be removed.
        let has_bar = output::columns(&io::stderr()) >= BAR_COLUMNS_MIN;
        let style = ProgressStyle::with_template(if has_bar { "{bar:24} {wide_msg}" } else { "{wide_msg}" });
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        Self {
            scenario,
            bar,
            is_quiet,
            begin: None,
            last_tick: Tick(0),
            is_paused: false,
            formation: None,
            events: 0,
        }
    }

    /// Prints `line` above the progress line.
    pub(crate) fn print(&self, line: &str) {
        if !self.is_quiet {
            // Hide the bar for the moment, or it and the line would be written into each other.
            self.bar.suspend(|| output::note(&format!("ringwing: {line}")));
        }
    }

    /// Prints a warning above the progress line.
    pub(super) fn print_warning(&self, text: &str) {
        if !self.is_quiet {
            self.bar.suspend(|| output::warning(&text));
        }
    }

    /// Prints an error above the progress line; the flight goes on.
    pub(super) fn print_error(&self, text: &str) {
        if !self.is_quiet {
            self.bar.suspend(|| output::error(&text));
        }
    }

    /// Prints an event.
    pub(crate) fn print_event(&mut self, TimedEvent { tick, event }: &TimedEvent) {
        self.events += 1;
        let (time_s, text) = (tick.seconds(self.scenario.time.rate_hz), self.scenario.event_text(event));
        let head = head(event, output::is_coloured(&io::stderr()));
        self.print(&format!("{time_s:8.2} s  {head}: {text}"));
    }

    /// Shows this formation error from the next update on.
    pub(crate) fn set_formation_error(&mut self, formation: &FormationError) {
        self.formation = Some(*formation);
    }

    /// Shows from the next update on whether the user has paused the flight.
    pub(super) fn set_paused(&mut self, is_paused: bool) {
        self.is_paused = is_paused;
    }

    /// Shows that the flight has come to `tick`.
    pub(crate) fn update(&mut self, tick: Option<Tick>) {
        let Some(tick) = tick else { return };
        // The approach is tick -1, which would be a huge unsigned position of the bar.
        self.last_tick = tick.max(Tick(0));
        let flown_s = self.last_tick.seconds(self.scenario.time.rate_hz);
        // Count from the first tick, because the start of the processes says nothing about the pace of the flight.
        let (begin, begun_s) = *self.begin.get_or_insert_with(|| (Instant::now(), flown_s));
        let factor = real_time_factor(flown_s - begun_s, begin.elapsed().as_secs_f64());
        let pace = match factor {
            _ if self.is_paused => ", paused".into(),
            Some(factor) => format!(" at {factor:.0}x"),
            None => String::new(),
        };
        let (formation, events) = (self.formation_text(), counted(self.events, "event"));
        self.bar.set_position(self.last_tick.0.cast_unsigned());
        self.bar.set_message(format!("{flown_s:.1} s{pace}, {formation}, {events}"));
    }

    fn formation_text(&self) -> String {
        match &self.formation {
            None => "formation not measured yet".into(),
            Some(formation) => formation_text(formation, self.scenario.formation.uavs),
        }
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

/// How far a swarm of `uavs` is from its formation. Flying on command does not mean being in formation.
fn formation_text(formation: &FormationError, uavs: u32) -> String {
    let FormationError { commanded, slot_error_max_m, measured, .. } = formation;
    let error = match measured {
        0 => "slot error unknown".into(),
        _ => format!("largest slot error {slot_error_max_m:.2} m"),
    };
    format!("{commanded} of {uavs} on command, {error}")
}

/// What comes before the text of an event: how bad it is, and its kind, such as `error: collision`.
fn head(event: &Event, is_coloured: bool) -> String {
    let kind = kind(event.name());
    match event.level() {
        Level::Info => kind.into(),
        Level::Warning => format!("{}: {kind}", output::painted(output::DOUBTFUL, "warning", is_coloured)),
        Level::Error => format!("{}: {kind}", output::painted(output::BAD, "error", is_coloured)),
    }
}

/// The kind of an event in a word, from its name in the log: `process` for `process.lost`.
fn kind(name: &'static str) -> &'static str {
    match name.split_once('.') {
        Some(("fault", what @ ("healed" | "refused" | "requested" | "overdue"))) => what,
        // What happened to the process, or which fault it is, follows in the text.
        Some((subject, _)) => subject,
        None => name,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ringwing_flight::{Collider, Part, ProcessAction, UavId};

    #[test]
    fn the_line_says_who_flies_on_command_and_how_far_they_are_from_their_slots() {
        let formation = FormationError { tick: Tick(7), slot_error_max_m: 79.004, commanded: 6, measured: 1 };
        assert_eq!(formation_text(&formation, 6), "6 of 6 on command, largest slot error 79.00 m");
        let nobody = FormationError { slot_error_max_m: 0.0, commanded: 0, measured: 0, ..formation };
        assert_eq!(formation_text(&nobody, 6), "0 of 6 on command, slot error unknown");
    }

    #[test]
    fn an_event_on_the_terminal_names_its_kind_and_how_bad_it_is() {
        let uav = UavId(3);
        let collision = Event::Collision { uav, with: Collider::Uav(UavId(5)), position_m: [0.0, 0.0] };
        let kill = Event::ProcessFault {
            part: Part::Agent(uav),
            action: ProcessAction::Stop,
            sentence: "stop uav 3".into(),
        };
        let link = Event::LinkFault { sentence: "link all hold".into() };
        let healed = Event::FaultHealed { sentence: "link all hold".into() };
        let ready = Event::ProcessReady { part: Part::Leader };
        let heads = [collision, kill, link, healed, ready].map(|event| head(&event, false));
        assert_eq!(heads, ["error: collision", "warning: fault", "fault", "healed", "process"]);
    }
}
