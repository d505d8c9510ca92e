//! What another way of talking would have cost: the same round trip between as many processes, the same bytes each way.
//!
//! One hub in the world's place and a peer in each agent's; real processes, real system calls, no law and no iceoryx2.
//! Never flies anything.

pub(super) mod hub;
pub(crate) mod peer;
mod wire;
mod words;

use super::result::{Case, Subject};
use ringwing_flight::{Command, LeaderState, Sensed, UavState};

/// The tick that ends all.
const END: i64 = i64::MAX;

/// How many bytes go each way between the hub and each peer in a tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Exchange {
    /// To the peer: what an agent reads.
    ask: usize,
    /// Back: what it writes.
    answer: usize,
}

impl Exchange {
    fn of(case: &Case) -> Self {
        let payload = case.payload_bytes as usize;
        Self {
            ask: size_of::<Sensed>() + size_of::<LeaderState>() + 2 * size_of::<UavState>() + payload,
            answer: size_of::<UavState>() + size_of::<Command>() + payload,
        }
    }
}

/// Puts the number of the tick at the beginning of a message, as every message of the swarm has it.
fn put_tick(message: &mut [u8], tick: i64) {
    message[..size_of::<i64>()].copy_from_slice(&tick.to_le_bytes());
}

/// The number of the tick at the beginning of a message.
fn tick_in(message: &[u8]) -> i64 {
    message.first_chunk().map_or(END, |bytes| i64::from_le_bytes(*bytes))
}

/// Rounds of a futex begin at 1: before them the word is 0.
fn round_of(tick: i64) -> u32 {
    tick as u32 + 1
}

fn tick_of(round: u32) -> i64 {
    i64::from(round) - 1
}

/// Whether `subject` sends any data.
pub(super) fn carries_data(subject: Subject) -> bool {
    !matches!(subject, Subject::Gate | Subject::Atomic | Subject::Futex)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bench::result::{Load, Wake};

    #[test]
    fn as_many_bytes_go_each_way_as_in_the_swarm() {
        let case = Case {
            subject: Subject::Pipe,
            load: Load::Closed,
            uavs: 1,
            wake: Wake::Gate,
            payload_bytes: 1000,
            recorder: false,
        };
        // Sensed 328, LeaderState 48, UavState 120, Command 200: see the messages.
        let sizes =
            [size_of::<Sensed>(), size_of::<LeaderState>(), size_of::<UavState>(), size_of::<Command>()];
        let Exchange { ask, answer } = Exchange::of(&case);
        assert_eq!(ask, sizes[0] + sizes[1] + 2 * sizes[2] + 1000);
        assert_eq!(answer, sizes[2] + sizes[3] + 1000);
    }

    #[test]
    fn a_message_begins_with_its_tick() {
        let mut message = [7; 20];
        put_tick(&mut message, -5);
        assert_eq!((tick_in(&message), message[8]), (-5, 7));
        assert_eq!(tick_of(round_of(41)), 41);
    }
}
