//! All that the world is connected to.

use ringwing_messages::{
    BusError, Command, Event, Member, Publisher, Roster, Sensed, Subscriber, TickTiming, UavId, channel,
};

/// The world's ends of the services.
#[derive(Debug)]
pub(crate) struct Ports {
    pub(crate) sensed: Vec<Publisher<Sensed>>,
    pub(crate) commands: Vec<Subscriber<Command>>,
    pub(crate) roster: Subscriber<Roster>,
    pub(crate) timing: Publisher<TickTiming>,
    pub(crate) events: Publisher<Event>,
}

impl Ports {
    pub(crate) fn open(member: &Member, uavs: u32) -> Result<Self, BusError> {
        let (node, depth) = (member.node(), channel::TICK_DEPTH);
        let of_each = UavId::all(uavs);
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
        })
    }
}
