//! Where the picture comes from: a live run or a log.
//!
//! Must never decide what is shown.

use super::{live::LiveFeed, model::Model, played::PlayedLog, prompt::Wish};

/// What is watched.
pub(super) enum Feed {
    /// A live run.
    Live(Box<LiveFeed>),
    /// A log.
    Log(Box<PlayedLog>),
}

impl Feed {
    /// Fetches what has come since the last call; the error says why nothing can come any more.
    pub(super) fn fetch(&mut self, model: &mut Model) -> Result<(), String> {
        match self {
            Self::Live(live) => live.fetch(model),
            Self::Log(log) => {
                log.fetch(model);
                Ok(())
            }
        }
    }

    /// Whether the run is over. A log never is: the user may look at its end.
    pub(super) fn is_over(&self) -> bool {
        match self {
            Self::Live(live) => live.is_over(),
            Self::Log(_) => false,
        }
    }

    /// Asks for what the user wishes.
    pub(super) fn ask(&mut self, wish: Wish, model: &mut Model) {
        match self {
            Self::Live(live) => live.ask(wish, model),
            Self::Log(log) => log.ask(&wish, model),
        }
    }
}
