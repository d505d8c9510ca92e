//! All that the world is connected to.

use ringwing_bus::{Ballast, BusError, Member, Publisher, Subscriber, channel};
use ringwing_flight::{Command, EventMessage, Roster, Sensed, TickTiming, UavId};

/// The world's ends of the services.
#[derive(Debug)]
pub(crate) struct Ports {
    pub(crate) sensed: Vec<Publisher<Sensed>>,
    pub(crate) commands: Vec<Subscriber<Command>>,
    pub(crate) roster: Subscriber<Roster>,
    pub(crate) timing: Publisher<TickTiming>,
    pub(crate) events: Publisher<EventMessage>,
    /// Of each UAV; none where none is carried.
    pub(crate) ballast: Vec<Ballast>,
}

impl Ports {
    pub(crate) fn open(member: &Member, uavs: u32, ballast_bytes: u32) -> Result<Self, BusError> {
        let (node, depth) = (member.node(), channel::TICK_DEPTH);
        let of_each = UavId::all(uavs);
        let loaded = of_each.clone().filter(|_| ballast_bytes > 0);
        Ok(Self {
            sensed: of_each
                .clone()
                .map(|uav| channel::sensed(uav).publisher(node))
                .collect::<Result<_, _>>()?,
            commands: of_each
                .map(|uav| channel::command(uav).subscriber(node, depth))
                .collect::<Result<_, _>>()?,
            roster: channel::roster().subscriber(node, depth)?,
            timing: channel::timing().publisher(node)?,
            events: channel::world_events().publisher(node)?,
            ballast: loaded
                .map(|uav| Ballast::of_world(node, uav, ballast_bytes))
                .collect::<Result<_, _>>()?,
        })
    }
}
