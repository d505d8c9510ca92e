//! The styles of the picture, with colours or without.
//!
//! Must never say by a colour alone what matters.

use super::model::Model;
use ratatui::style::{Color, Modifier, Style};
use ringwing_flight::Level;
use ringwing_recorder::show::palette::{self, Rgb};

/// The styles of a picture.
#[derive(Debug, Clone, Copy)]
pub(super) struct Paint {
    is_coloured: bool,
}

impl Paint {
    /// The styles that the terminal of `model` shows.
    pub(super) fn of(model: &Model) -> Self {
        Self { is_coloured: model.is_coloured }
    }

    /// A colour, or that of the terminal.
    pub(super) fn rgb(self, Rgb { red, green, blue }: Rgb) -> Color {
        if self.is_coloured { Color::Rgb(red, green, blue) } else { Color::Reset }
    }

    /// The style of a UAV.
    pub(super) fn uav(self, uav: u32) -> Style {
        Style::new().fg(self.rgb(palette::colour(uav))).add_modifier(Modifier::BOLD)
    }

    /// The style of what is wrong.
    pub(super) fn bad(self) -> Style {
        Style::new().fg(self.rgb(palette::ALARM)).add_modifier(Modifier::BOLD)
    }

    /// The style of what is beside the point.
    pub(super) fn quiet(self) -> Style {
        Style::new().fg(self.rgb(palette::QUIET))
    }

    /// The style of the first line.
    pub(super) fn head() -> Style {
        Style::new().add_modifier(Modifier::REVERSED)
    }

    /// The style of an event.
    pub(super) fn level(self, level: Level) -> Style {
        match level {
            Level::Info => Style::new(),
            // No other style than the colour: the line of a warning begins with that word.
            Level::Warning => Style::new().fg(self.rgb(palette::colour(1))),
            Level::Error => self.bad(),
        }
    }
}
