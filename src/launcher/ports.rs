//! The launcher's ends of the services: it publishes which processes run and what happens to them, and receives what
//! the world and the recorder report for the user.
//!
//! Must never open a service of the tick path.

use iceoryx2::{node::Node, prelude::ipc};
use ringwing_bus::{BusError, Publisher, Subscriber, services};
use ringwing_flight::{EventMessage, FormationError, Roster};

/// The launcher's ports.
pub(super) struct LauncherPorts {
    /// Who runs, for the world.
    pub(super) roster: Publisher<Roster>,
    /// What happens to the processes, for the recorder.
    pub(super) events: Publisher<EventMessage>,
    /// What happens in the air, from the world.
    pub(super) world_events: Subscriber<EventMessage>,
    /// How far the swarm is from its formation, from the recorder.
    pub(super) formation_error: Subscriber<FormationError>,
}

impl LauncherPorts {
    /// Opens all ports; the services must exist.
    pub(super) fn open(node: &Node<ipc::Service>) -> Result<Self, BusError> {
        Ok(Self {
            roster: services::roster().publisher(node)?,
            events: services::launcher_events().publisher(node)?,
            world_events: services::world_events().subscriber(node, services::RECORDER_DEPTH)?,
            formation_error: services::formation_error().subscriber(node, 1)?,
        })
    }
}
