//! All that the world is connected to.

use ringwing_messages::{
    BusError, Command, Event, LeaderState, Member, Publisher, Roster, Sensed, Subscriber, TickTiming, UavId,
    channel,
};

/// The world's ends of the services. It hears the leader only to know that it has answered.
#[derive(Debug)]
pub(crate) struct Ports {
    pub(crate) sensed: Vec<Publisher<Sensed>>,
    pub(crate) commands: Vec<Subscriber<Command>>,
    pub(crate) leader: Subscriber<LeaderState>,
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
            leader: channel::leader(uavs).subscriber(node, depth)?,
            roster: channel::roster().subscriber(node, depth)?,
            timing: channel::timing().publisher(node)?,
            events: channel::world_events().publisher(node)?,
        })
    }
}
