//! What a viewer that joins late has to know: the last message of each topic that is written on change, and what has happened.
//!
//! Must never remember raw data: they come in every tick.

use super::{ByChannel, log};
use foxglove::{
    RawChannel, SinkId,
    websocket::{ChannelView, Client, ServerListener},
};
use ringwing_recorder::schema::topics::{self, UavTopic};
use std::{
    collections::VecDeque,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};

/// How many events a late viewer gets. Fewer hide how a flight began; more crowd out what is newer in the viewer's queue, which
/// holds 1024 messages.
const EVENTS_KEPT: usize = 300;

/// Remembers messages for late viewers. Clones share what they remember.
#[derive(Clone, Default)]
pub(crate) struct Memory(Arc<Mutex<ByChannel<Kept>>>);

/// The messages of a topic that are kept, oldest first.
struct Kept {
    channel: Arc<RawChannel>,
    most: usize,
    /// Each with its log time.
    messages: VecDeque<(u64, Vec<u8>)>,
}

impl Memory {
    /// Begins to remember the messages on `channel`, as far as its topic asks for that.
    pub(crate) fn add(&self, channel: &Arc<RawChannel>) {
        let most = kept_of(channel.topic());
        let kept = Kept { channel: Arc::clone(channel), most, messages: VecDeque::new() };
        self.lock().insert(channel.id().into(), kept);
    }

    /// Sends a message to all viewers, and remembers it if it has to.
    pub(crate) fn send(&self, channel: &RawChannel, log_time: u64, data: &[u8]) {
        // Hold the lock while sending: a viewer that joins at this moment gets the newest message last.
        let mut all = self.lock();
        keep(&mut all, channel, log_time, data);
        log(channel, log_time, data, None);
    }

    /// Forgets all messages: what is played begins anew.
    pub(crate) fn clear(&self) {
        self.lock().values_mut().for_each(|kept| kept.messages.clear());
    }

    /// Remembers a message, as [`Self::send`] does, without sending it.
    pub(crate) fn note(&self, channel: &RawChannel, log_time: u64, data: &[u8]) {
        keep(&mut self.lock(), channel, log_time, data);
    }

    /// Sends what is remembered of every topic to all viewers.
    pub(crate) fn send_all(&self) {
        self.lock().values().for_each(|kept| kept.send_to(None));
    }

    fn lock(&self) -> MutexGuard<'_, ByChannel<Kept>> {
        // What is remembered is whole between any two statements, so a panic elsewhere does no harm.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn keep(all: &mut ByChannel<Kept>, channel: &RawChannel, log_time: u64, data: &[u8]) {
    let Some(kept) = all.get_mut(&channel.id().into()).filter(|kept| kept.most > 0) else { return };
    if kept.messages.len() == kept.most {
        kept.messages.pop_front();
    }
    kept.messages.push_back((log_time, data.to_owned()));
}

impl ServerListener for Memory {
    fn on_subscribe(&self, client: Client, channel: ChannelView) {
        // The lock is held while sending, as in `send`: no newer message overtakes an older one.
        if let Some(kept) = self.lock().get(&channel.id().into()) {
            kept.send_to(client.sink_id());
        }
    }
}

impl Kept {
    fn send_to(&self, viewer: Option<SinkId>) {
        for (log_time, data) in &self.messages {
            log(&self.channel, *log_time, data, viewer);
        }
    }
}

/// How many messages of `topic` a late viewer gets.
fn kept_of(topic: &str) -> usize {
    match topic {
        topics::LOG | topics::EVENTS => EVENTS_KEPT,
        topics::TIMING | topics::LINKS => 0,
        _ if UavTopic::parse(topic).is_some() => 0,
        _ => 1,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use foxglove::{ChannelBuilder, Context, Schema};

    #[test]
    fn the_last_state_and_the_last_events_are_kept_and_raw_data_are_not() {
        let (context, memory) = (Context::new(), Memory::default());
        let counts = [topics::OBSTACLE_SCENE, topics::LOG, "/uav/001/state"].map(|topic| {
            let builder = ChannelBuilder::new(topic).message_encoding("protobuf").context(&context);
            let channel = builder.schema(Schema::new("x", "protobuf", b"")).build_raw().unwrap();
            memory.add(&channel);
            for time in 0..1000 {
                memory.send(&channel, time, b"message");
            }
            let all = memory.lock();
            let kept = &all[&channel.id().into()].messages;
            assert!(kept.is_empty() || kept.back().unwrap().0 == 999, "{topic}");
            kept.len()
        });
        assert_eq!(counts, [1, EVENTS_KEPT, 0]);
        memory.clear();
        assert!(memory.lock().values().all(|kept| kept.messages.is_empty()));
    }
}
