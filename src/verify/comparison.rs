//! Compares the messages of two logs, tick by tick.
//!
//! Never depends on the order of messages within a tick: programs that rewrite logs may change it.

use super::{difference::Difference, requests};
use ringwing_flight::UavId;
use ringwing_recorder::{
    log::reader::{LogMessage, Reader},
    schema::topics,
};
use std::{
    collections::BTreeSet,
    io::{Read, Seek},
    iter::Peekable,
};

/// Two logs whose messages are equal.
#[derive(Debug, Default, PartialEq, Eq)]
pub(crate) struct Comparison {
    /// Number of messages compared.
    pub(super) messages: u64,
    /// Topics of the flight that the log does not have, so that they were not compared.
    pub(super) left_out: Vec<String>,
}

/// Compares the log `recorded` with the log `flown` of the same flight; the error is the first difference.
///
/// A recorded flight `with_requests` is flown again with these faults in its scenario.
pub(crate) fn compare<R: Read + Seek>(
    recorded: Reader<R>,
    flown: Reader<R>,
    with_requests: bool,
) -> Result<Comparison, Box<Difference>> {
    let in_log: BTreeSet<String> = recorded.topics().map(str::to_owned).collect();
    // Another program may have removed whole topics. Those that a verdict needs must be there: without them, equal
    // logs would prove little.
    let is_left_out = |topic: &str| !topics::is_judged(topic) && !in_log.contains(topic);
    let left_out: Vec<String> =
        flown.topics().filter(|topic| is_compared(topic) && is_left_out(topic)).map(str::to_owned).collect();
    let is_wanted = |message: &LogMessage| {
        is_compared(&message.topic.name) && (!with_requests || requests::is_independent(message))
    };
    let mut recorded = by_tick(recorded.filter(is_wanted));
    let mut flown = by_tick(flown.filter(|message| is_wanted(message) && !is_left_out(&message.topic.name)));
    let mut messages = 0;
    loop {
        match (recorded.next(), flown.next()) {
            (None, None) => return Ok(Comparison { messages, left_out }),
            (Some(one), Some(other)) if is_same(&one, &other) => messages += 1,
            // All differences in further ticks may follow from the first one.
            (one, other) => {
                let difference = Difference::between(one.as_ref(), other.as_ref());
                // Look through the rest of this tick: if agents decided otherwise in the same tick, all of them are
                // to be named.
                let now = one.as_ref().or(other.as_ref()).and_then(|message| message.tick);
                let rest_of = |log: &mut dyn Iterator<Item = LogMessage>, first: Option<LogMessage>| {
                    let tick = first.into_iter().chain(log).take_while(|message| message.tick == now);
                    tick.filter_map(|message| {
                        Some((uav(&message)?, message.topic.name.clone(), message.data))
                    })
                    .collect::<BTreeSet<_>>()
                };
                let (recorded, flown) = (rest_of(&mut recorded, one), rest_of(&mut flown, other));
                let uavs: BTreeSet<UavId> =
                    recorded.symmetric_difference(&flown).map(|(uav, ..)| *uav).collect();
                return Err(Box::new(difference.with_uavs(uavs.into_iter().collect())));
            }
        }
    }
}

/// The UAV that a message is about, if it is about one.
fn uav(message: &LogMessage) -> Option<UavId> {
    let (number, _) = message.topic.name.strip_prefix("/uav/")?.split_once('/')?;
    number.parse().ok().map(UavId)
}

/// Whether messages of `topic` should be equal in both logs. Wall-clock times differ from run to run, and other programs may
/// have added topics.
fn is_compared(topic: &str) -> bool {
    ![topics::TIMING, topics::TIMING_PERCENTILES].contains(&topic) && topics::is_known(topic)
}

fn is_same(one: &LogMessage, other: &LogMessage) -> bool {
    one.topic.name == other.topic.name && one.tick == other.tick && one.data == other.data
}

/// The messages in the order of ticks and topics, without those that are there twice.
fn by_tick(messages: impl Iterator<Item = LogMessage>) -> impl Iterator<Item = LogMessage> {
    let mut messages = messages.peekable();
    std::iter::from_fn(move || tick_of(&mut messages)).flatten()
}

/// All messages of the next tick.
fn tick_of(messages: &mut Peekable<impl Iterator<Item = LogMessage>>) -> Option<Vec<LogMessage>> {
    let mut tick = vec![messages.next()?];
    let now = tick.first()?.tick;
    while let Some(message) = messages.next_if(|message| message.tick == now) {
        tick.push(message);
    }
    // Stable, so that the events of a tick stay in their order.
    tick.sort_by(|one, other| one.topic.name.cmp(&other.topic.name));
    tick.dedup_by(|later, earlier| is_same(later, earlier));
    Some(tick)
}

#[cfg(test)]
mod tests {
    use super::*;
    use ringwing_recorder::log::reader::Topic;
    use std::sync::Arc;

    fn message(tick: i64, topic: &str, data: u8) -> LogMessage {
        let topic = Topic { name: topic.into(), schema: None };
        LogMessage { topic: Arc::new(topic), tick: Some(tick), log_time: 0, data: vec![data] }
    }

    #[test]
    fn the_order_of_topics_within_a_tick_does_not_matter() {
        let (log, state, faults) =
            (message(1, "/log", 1), message(1, "/uav/001/state", 2), message(1, "/faults", 3));
        let second = message(1, "/log", 9);
        let next = message(2, "/faults", 3);
        let found: Vec<_> =
            by_tick([&state, &log, &faults, &log, &second, &next].into_iter().cloned()).collect();
        assert_eq!(found, [faults, log, second, state, next]);
    }
}
