//! The vocabulary of a flight: what every process and every tool of ringwing agrees on.
//!
//! - [`id`] identifies UAVs, processes and ticks, and [`pace`] says what a tick waits for and how fast time passes.
//! - [`payload`] holds the messages between processes, [`event`] the events of a run, and [`report`] the world's
//!   account of a finished flight, with the [`latency`] of its ticks.
//! - [`motion`] solves Eq. (1), and [`path`] is where the leader flies.
//! - [`formation`] is the geometry of Definition 1, [`shape`] that of other formations and [`slot`] a place in one;
//!   [`formation_frame`] turns them with the leader, and a [`manoeuvre`] is a planned change of them. [`ring_order`]
//!   says which UAV has which slot, and [`ring`] is the geometry of the UAVs still alive.
//! - [`draw`] makes all seeded draws, and [`counted`] writes numbers of things.
//!
//! Must never know services, clocks, files or the scenario: every function here gives the same bits for the same
//! inputs.

#![cfg_attr(not(test), warn(clippy::disallowed_methods))]

pub mod draw;
pub mod event;
pub mod formation;
pub mod formation_frame;
pub mod id;
pub mod latency;
pub mod manoeuvre;
pub mod motion;
pub mod pace;
pub mod path;
pub mod payload;
pub mod process_state;
pub mod report;
pub mod ring;
pub mod ring_order;
pub mod route;
pub mod shape;
pub mod slot;
mod wording;

pub use event::{
    AfterLoss, Collider, Event, GapCause, Level, ProcessAction, ProcessEnd, Reporter, TimedEvent,
};
pub use formation::Formation;
pub use formation_frame::{FormationFrame, FrameMotion};
pub use id::{IntruderId, Part, Tick, UavId};
pub use latency::LatencyTally;
pub use manoeuvre::{Manoeuvre, Passing, SpeedRange};
pub use motion::{Pose, chord, direction, turned, wrap};
pub use pace::{Pace, real_time_factor};
pub use path::{LeaderPath, PathMotion, TrackPoint, Turn, WaypointError};
pub use payload::{
    Account, AgeTicks, Aircraft, AircraftId, Avoided, Command, EventMessage, FailsafePath, FlightMode,
    FormationError, JournalEntry, JournalHeader, LeaderState, LinkCounts, LinkSource, LoiterRates,
    MAX_NOTE_NAME, MAX_NOTES, NearObstacles, NoteRefusal, Notes, OwnSenses, Payload, Roster, Rumour, Sensed,
    SensedAircraft, SensedObstacle, TickTiming, Traffic, Truth, UavState,
};
pub use process_state::ProcessState;
pub use report::{Collision, Latency, WorldReport};
pub use ring::{LivingRing, OnLoss};
pub use ring_order::RingOrder;
pub use route::{Route, RoutePoint};
pub use shape::Shape;
pub use slot::{CirclePlace, Slot};
pub use wording::counted;
