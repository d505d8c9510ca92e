//! The launcher's ends of the services: it publishes which processes run and what happens to them, and receives what
//! the world and the recorder report for the user. It also owns all services of the run.
//!
//! Must never read or write a board of the tick path.

use iceoryx2::{node::Node, prelude::ipc};
use ringwing_bus::{BusError, Domain, Publisher, Services, Subscriber, services};
use ringwing_flight::{EventMessage, FormationError, Part, Roster};

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
    services: Services,
    node: Node<ipc::Service>,
}

impl LauncherPorts {
    /// Opens all ports of the run, whose `services` were created with `node`.
    pub(super) fn open(node: Node<ipc::Service>, services: Services) -> Result<Self, BusError> {
        Ok(Self {
            roster: services::roster().publisher(&node)?,
            events: services::launcher_events().publisher(&node)?,
            world_events: services::world_events().subscriber(&node, services::RECORDER_DEPTH)?,
            // The progress line shows only the newest one, so older ones need no room.
            formation_error: services::formation_error().subscriber(&node, 1)?,
            services,
            node,
        })
    }

    /// Prepares the services for the next process of `part`, after its last one has ended.
    pub(super) fn renew(&mut self, domain: &Domain, part: Part) -> Result<(), BusError> {
        self.services.renew(&self.node, domain, part)
    }
}
