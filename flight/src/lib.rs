//! What flight is, for every process of a run: who flies, when, what they tell each other, and how they move.
//!
//! [`id`] names UAVs, processes and ticks; [`payload`] holds the messages and [`event`] what happens once; [`report`] is
//! what the world leaves at the end. [`motion`] solves Eq. (1), [`formation`] is the geometry of Definition 1, [`ring`]
//! that of the UAVs still alive, and [`draw`] makes every seeded draw.
//!
//! Never knows processes, services, clocks, files or the scenario: whatever is here gives the same bits for the same
//! inputs.

#![cfg_attr(not(test), warn(clippy::disallowed_methods))]

pub mod draw;
pub mod event;
pub mod formation;
pub mod id;
pub mod motion;
pub mod pace;
pub mod payload;
pub mod report;
pub mod ring;

pub use event::{AfterLoss, Collider, Event, GapCause, Level, ProcessAction, ProcessEnd, TimedEvent};
pub use formation::Formation;
pub use id::{Part, Tick, UavId};
pub use motion::{Pose, direction, wrap};
pub use pace::Pace;
pub use payload::{
    Account, AgeTicks, Command, EventMessage, FlightMode, FormationError, LeaderState, LinkCounts,
    LinkSource, Payload, Roster, Rumour, Sensed, SensedObstacle, TickTiming, UavState,
};
pub use report::{Collision, Latency, WorldReport};
pub use ring::{LivingRing, OnLoss, Slot};
