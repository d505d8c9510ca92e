//! What the processes of a transport exchange in a tick: how many bytes, and the number that stands for the tick.
//!
//! Must never send or receive anything.

use crate::case::Case;
use ringwing_flight::{Command, LeaderState, OwnSenses, UavState};

/// The first tick of a run.
pub(super) const FIRST: i64 = 0;
/// The tick that ends a run.
pub(super) const END: i64 = i64::MAX;

/// Sizes of the messages between two processes in a tick, in bytes, as one of the two sees them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct MessageSizes {
    /// Of what it sends.
    pub(crate) outgoing: usize,
    /// Of what it receives.
    pub(crate) incoming: usize,
}

impl MessageSizes {
    /// Between the hub and a peer: everything that an agent reads in a tick, and everything that it sends.
    ///
    /// As in a swarm without a recorder and without obstacles: agents then send no accounts and read no obstacles.
    pub(crate) fn hub_to_peer(case: &Case) -> Self {
        let payload = case.payload_bytes as usize;
        let neighbours = 2 * size_of::<UavState>();
        Self {
            outgoing: size_of::<OwnSenses>() + size_of::<LeaderState>() + neighbours + payload,
            incoming: size_of::<UavState>() + size_of::<Command>() + payload,
        }
    }

    /// Between the world of a mesh and an agent: its senses, and its command.
    ///
    /// Extra bytes go this way only, as in the swarm.
    pub(super) fn world_to_agent(case: &Case) -> Self {
        let payload = case.payload_bytes as usize;
        Self { outgoing: size_of::<OwnSenses>() + payload, incoming: size_of::<Command>() + payload }
    }

    /// Between the world of a mesh and the leader: the tick alone, and the state that answers it.
    pub(super) fn world_to_leader() -> Self {
        Self { outgoing: size_of::<i64>(), incoming: size_of::<LeaderState>() }
    }

    /// Between the leader of a mesh and an agent, which does not answer.
    pub(super) fn leader_to_agent() -> Self {
        Self { outgoing: size_of::<LeaderState>(), incoming: 0 }
    }

    /// Between two neighbours of a mesh.
    pub(super) fn between_neighbours() -> Self {
        Self { outgoing: size_of::<UavState>(), incoming: size_of::<UavState>() }
    }

    /// The same messages as the other process sees them.
    pub(super) fn reversed(self) -> Self {
        Self { outgoing: self.incoming, incoming: self.outgoing }
    }
}

/// Writes the tick to the beginning of a message, where every message of the swarm has it, too.
pub(super) fn put_tick(message: &mut [u8], tick: i64) {
    message[..size_of::<i64>()].copy_from_slice(&tick.to_le_bytes());
}

/// The tick at the beginning of a message.
pub(super) fn tick_in(message: &[u8]) -> i64 {
    message.first_chunk().map_or(END, |bytes| i64::from_le_bytes(*bytes))
}

/// The value of a futex word during `tick`; before the first tick it is 0.
pub(super) fn round_of(tick: i64) -> u32 {
    tick as u32 + 1
}

/// The tick during which a futex word has the value `round`.
pub(super) fn tick_of(round: u32) -> i64 {
    i64::from(round) - 1
}

/// The value of the turn-taking word while it is the peer's turn in `tick`; one more, and it is the hub's turn.
pub(super) fn turn_of(tick: i64) -> u32 {
    2 * tick as u32 + 1
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::{Carrier, Load, Topology};
    use ringwing_scenario::Wake;

    const CASE: Case = Case {
        carrier: Carrier::Pipe,
        topology: Topology::Hub,
        load: Load::Closed,
        uavs: 1,
        wake: Wake::Gate,
        payload_bytes: 1000,
        recorder: false,
    };

    #[test]
    fn a_peer_reads_and_sends_as_many_bytes_as_an_agent() {
        // As literals, so that a changed message has to be noticed here: earlier figures then do not compare any more.
        // Read: own senses 72, leader 48, two neighbours of 120 each. Sent: state 120, command 32.
        assert_eq!(MessageSizes::hub_to_peer(&CASE), MessageSizes { outgoing: 1360, incoming: 1152 });
        let bare = Case { payload_bytes: 0, ..CASE };
        assert_eq!(MessageSizes::hub_to_peer(&bare), MessageSizes { outgoing: 360, incoming: 152 });
    }

    #[test]
    fn an_agent_of_a_mesh_reads_as_many_bytes_as_a_peer_of_a_hub() {
        let from_world = MessageSizes::world_to_agent(&CASE);
        let from_leader = MessageSizes::leader_to_agent();
        let neighbour = MessageSizes::between_neighbours();
        let hub = MessageSizes::hub_to_peer(&CASE);
        assert_eq!(from_world.outgoing + from_leader.outgoing + 2 * neighbour.outgoing, hub.outgoing);
        // It writes its state twice, because it has two neighbours.
        assert_eq!(from_world.incoming + neighbour.outgoing, hub.incoming);
        assert_eq!(from_world.reversed().outgoing, from_world.incoming);
    }

    #[test]
    fn a_message_begins_with_its_tick() {
        let mut message = [7; 20];
        put_tick(&mut message, -5);
        assert_eq!((tick_in(&message), message[8]), (-5, 7));
        assert_eq!(tick_in(&[1, 2]), END, "too short for a tick");
        assert_eq!(tick_of(round_of(41)), 41);
    }
}
