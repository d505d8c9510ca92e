//! Shows a flight in Foxglove while it goes on, and a log as if it went on now, over Foxglove's WebSocket protocol.
//!
//! - `address` is where a server listens.
//! - `server` has the channels of the log, remembers what a viewer that joins late has to know, and takes requests.
//! - `process` is the viewer's process of a live run, and `playback` serves a log.
//!
//! Must never change a flight, except as a viewer asks for it, and must never be waited for.

mod address;
mod parameters;
mod playback;
mod process;
mod server;

pub use address::LiveAddress;
pub use playback::{PlaybackOptions, serve_log};
pub use process::{ViewerArgs, run};
pub use server::url::LiveUrl;

use ringwing_bus::BusError;
use ringwing_recorder::{RecorderError, log::reader::ReadError};

/// Why a flight cannot be shown.
#[derive(Debug, thiserror::Error)]
pub enum ViewerError {
    /// The run does not exist, or one of its services cannot be reached.
    #[error(transparent)]
    Bus(#[from] BusError),
    /// The flight cannot be followed.
    #[error(transparent)]
    Recorder(#[from] RecorderError),
    /// The log cannot be read.
    #[error(transparent)]
    Log(#[from] ReadError),
    /// The log holds nothing that can be shown.
    #[error("log {0}: it holds no message of a flight")]
    Empty(String),
    /// The address is not there, or taken.
    #[error(
        "cannot listen at {address}: {problem}; choose another one with `--live=ADDRESS`, or let `--live=0` choose"
    )]
    Listen {
        /// The address.
        address: LiveAddress,
        /// What the operating system says.
        problem: String,
    },
    /// The server does not take a channel.
    #[error("channel {topic}: {problem}")]
    Channel {
        /// Its topic.
        topic: String,
        /// What is wrong.
        problem: String,
    },
}
