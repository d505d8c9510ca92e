//! The messages between processes, each with one fixed layout and one versioned type name.
//!
//! A payload consists of plain numbers without padding: no `bool`, no Rust `enum`, no pointer. So any bytes that
//! another process left in shared memory are a valid value, and payloads can be hashed byte by byte. [`Payload`]
//! makes the compiler check this.
//!
//! A payload that the flight depends on must never carry a wall-clock time: the same scenario and seed give the same
//! bytes.

mod command;
mod event;
mod failsafe_path;
mod journal;
mod leader;
mod links;
mod notes;
mod roster;
mod sensed;
mod state;
mod timing;
mod traffic;
mod truth;

pub use command::{Account, AgeTicks, Avoided, Command};
pub use event::EventMessage;
pub use failsafe_path::{FailsafePath, LoiterRates};
pub use journal::{JournalEntry, JournalHeader};
pub use leader::LeaderState;
pub use links::{LinkCounts, LinkSource};
pub use notes::{MAX_NOTE_NAME, MAX_NOTES, NoteRefusal, Notes};
pub use roster::{MAX_UAVS, Roster};
pub use sensed::{FlightMode, MAX_SENSED_OBSTACLES, NearObstacles, OwnSenses, Sensed, SensedObstacle};
pub use state::{RUMOURS, Rumour, UavState};
pub use timing::{FormationError, TickTiming};
pub use traffic::{Aircraft, AircraftId, MAX_SENSED_AIRCRAFT, SensedAircraft, Traffic};
pub use truth::Truth;

use bytemuck::Pod;
use std::fmt::Debug;

/// What processes may send to each other: plain old data under a versioned type name.
pub trait Payload: Pod + Debug {
    /// Identifies the layout. Other programs read these bytes, so a changed layout or meaning needs a new version.
    const TYPE_NAME: &'static str;
}

/// Gives each payload its type name, and checks its size in bytes: a size that changes unnoticed breaks other programs.
macro_rules! payloads {
    ($($message:ty: $name:literal, $bytes:literal;)*) => {$(
        impl Payload for $message {
            const TYPE_NAME: &'static str = concat!("ringwing.", $name);
        }
        const _: () = assert!(size_of::<$message>() == $bytes);
    )*};
}

payloads! {
    LeaderState: "LeaderState.v1", 48;
    UavState: "UavState.v2", 120;
    OwnSenses: "OwnSenses.v1", 72;
    NearObstacles: "NearObstacles.v1", 384;
    Traffic: "Traffic.v1", 408;
    Command: "Command.v4", 32;
    Account: "Account.v5", 248;
    TickTiming: "TickTiming.v1", 72;
    LinkCounts: "LinkCounts.v2", 80;
    Notes: "Notes.v1", 696;
    Roster: "Roster.v3", 152;
    FormationError: "FormationError.v3", 24;
    EventMessage: "EventMessage.v1", 1024;
    JournalHeader: "JournalHeader.v1", 128;
    JournalEntry: "JournalEntry.v5", 768;
}
