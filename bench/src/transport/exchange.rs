//! What a hub and its peers exchange in a tick: how many bytes, and the number that stands for the tick.
//!
//! Must never send or receive anything.

use crate::case::Case;
use ringwing_flight::{Account, Command, LeaderState, Sensed, UavState};

/// The tick that ends a run.
pub(super) const END: i64 = i64::MAX;

/// How many bytes go each way between the hub and each peer in a tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Exchange {
    /// To the peer: what an agent reads in a tick.
    pub(super) ask_bytes: usize,
    /// Back to the hub: what an agent sends in a tick.
    pub(super) answer_bytes: usize,
}

impl Exchange {
    /// The exchange that `case` asks for.
    pub(super) fn of(case: &Case) -> Self {
        let payload = case.payload_bytes as usize;
        let neighbours = 2 * size_of::<UavState>();
        Self {
            ask_bytes: size_of::<Sensed>() + size_of::<LeaderState>() + neighbours + payload,
            answer_bytes: size_of::<UavState>() + size_of::<Command>() + size_of::<Account>() + payload,
        }
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
    use crate::case::{Carrier, Load};
    use ringwing_scenario::Wake;

    #[test]
    fn a_peer_reads_and_sends_as_many_bytes_as_an_agent() {
        let case = Case {
            carrier: Carrier::Pipe,
            load: Load::Closed,
            uavs: 1,
            wake: Wake::Gate,
            payload_bytes: 1000,
            recorder: false,
        };
        // As literals, so that a changed message has to be noticed here: earlier figures then do not compare any more.
        // Read: sensed 320, leader 48, two neighbours of 120 each. Sent: state 120, command 32, account 168.
        assert_eq!(Exchange::of(&case), Exchange { ask_bytes: 1608, answer_bytes: 1320 });
        let bare = Case { payload_bytes: 0, ..case };
        assert_eq!(Exchange::of(&bare), Exchange { ask_bytes: 608, answer_bytes: 320 });
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
