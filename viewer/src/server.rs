//! A server of one flight for Foxglove: channels, time, parameters, and a service for requests.
//!
//! Must never wait for a client. Messages queue up for each client, and of one that lags the oldest are dropped.

pub(crate) mod memory;
mod requests;
pub(crate) mod url;

use crate::{LiveAddress, ViewerError, parameters::ScenarioParameters};
use foxglove::{
    ChannelBuilder, Context, FoxgloveError, PartialMetadata, RawChannel, Schema, WebSocketServer,
    WebSocketServerHandle,
    websocket::{Capability, PlaybackState, ServerListener},
};
use memory::Memory;
pub(crate) use requests::Ask;
use ringwing_recorder::{Clock, stream::MessageSink};
use ringwing_scenario::Scenario;
use std::{collections::BTreeMap, io::ErrorKind, sync::Arc};
use url::LiveUrl;

/// What a server is about.
pub(crate) struct Offer<'a> {
    /// The scenario of the flight.
    pub(crate) scenario: &'a Scenario,
    /// Carries requests to the flight, if it is a live one.
    pub(crate) ask: Option<Ask>,
    /// The first and the last time of a recorded flight.
    pub(crate) times: Option<(u64, u64)>,
    /// Gets the wishes of viewers.
    pub(crate) listener: Arc<dyn ServerListener>,
}

/// A running server.
pub(crate) struct LiveServer {
    handle: WebSocketServerHandle,
    context: Arc<Context>,
    channels: Vec<Arc<RawChannel>>,
    memory: Memory,
    clock: Clock,
    url: LiveUrl,
}

impl LiveServer {
    /// Starts a server at `address` that remembers in `memory` what late viewers have to know.
    pub(crate) fn start(address: &LiveAddress, offer: &Offer, memory: Memory) -> Result<Self, ViewerError> {
        // The library's default context is one for the whole process: a second server would serve these channels as
        // well.
        let context = Context::new();
        let handle =
            listen(address, |port| configure(&context, offer).bind(address.host().to_string(), port))?;
        let url = LiveUrl::new(address.host(), handle.port());
        let clock = Clock::new(offer.scenario.time.rate_hz);
        Ok(Self { handle, context, channels: Vec::new(), memory, clock, url })
    }

    /// Where viewers find it.
    pub(crate) fn url(&self) -> &LiveUrl {
        &self.url
    }

    /// How many viewers are connected.
    pub(crate) fn clients(&self) -> usize {
        self.handle.client_count()
    }

    /// Sends a message that was recorded at `log_time`.
    pub(crate) fn send(&self, channel: u16, log_time: u64, data: &[u8]) {
        self.memory.send(&self.channels[usize::from(channel)], log_time, data);
    }

    /// Remembers a message for viewers without sending it.
    pub(crate) fn note(&self, channel: u16, log_time: u64, data: &[u8]) {
        self.memory.note(&self.channels[usize::from(channel)], log_time, data);
    }

    /// Tells viewers what time it is in the flight.
    pub(crate) fn tell_time(&self, log_time: u64) {
        self.handle.broadcast_time(log_time);
    }

    /// Tells viewers how a recorded flight is played.
    pub(crate) fn tell_playback(&self, state: PlaybackState) {
        self.handle.broadcast_playback_state(state);
    }

    /// The log time of `tick`.
    pub(crate) fn log_time(&self, tick: i64) -> u64 {
        self.clock.log_time_ns(tick)
    }
}

impl MessageSink for LiveServer {
    type Error = ViewerError;

    fn add_channel(&mut self, topic: &str, schema: &Schema, encoding: &str) -> Result<u16, ViewerError> {
        let builder = ChannelBuilder::new(topic).schema(schema.clone()).message_encoding(encoding);
        let channel = builder.context(&self.context).build_raw();
        let channel = channel
            .map_err(|error| ViewerError::Channel { topic: topic.to_owned(), problem: error.to_string() })?;
        self.memory.add(&channel);
        self.channels.push(channel);
        Ok(self.channels.len() as u16 - 1)
    }

    fn put(&mut self, channel: u16, tick: i64, data: &[u8]) -> Result<(), ViewerError> {
        self.send(channel, self.log_time(tick), data);
        Ok(())
    }
}

/// Starts the server that `configured` makes for a port, at the first port of `address` that is free.
fn listen(
    address: &LiveAddress,
    configured: impl Fn(u16) -> WebSocketServer,
) -> Result<WebSocketServerHandle, ViewerError> {
    let mut problem = String::new();
    // Starting consumes a server, so each port needs a new one.
    for port in address.ports() {
        match configured(port).start_blocking() {
            Ok(handle) => return Ok(handle),
            Err(FoxgloveError::Bind(error)) if error.kind() == ErrorKind::AddrInUse => {
                problem = error.to_string();
            }
            // Any other problem, such as an address of another machine, is the same at every port.
            Err(error) => return Err(ViewerError::Listen { address: *address, problem: error.to_string() }),
        }
    }
    Err(ViewerError::Listen { address: *address, problem })
}

fn configure(context: &Arc<Context>, offer: &Offer) -> WebSocketServer {
    let Offer { scenario, ask, times, listener } = offer;
    let server = WebSocketServer::new()
        .context(context)
        .name(format!("ringwing: {}, seed {}", scenario.name, scenario.seed))
        .capabilities([Capability::Time])
        .supported_encodings([requests::ENCODING])
        .services(ask.clone().map(requests::service))
        .parameter_handler(Arc::new(ScenarioParameters::of(scenario)))
        .listener(Arc::clone(listener));
    match times {
        Some((first, last)) => server.playback_time_range(*first, *last),
        None => server,
    }
}

/// Sends `data` on `channel`, recorded at `log_time`, to one viewer or to all.
fn log(channel: &RawChannel, log_time: u64, data: &[u8], viewer: Option<foxglove::SinkId>) {
    // Without a time of its own, a message gets that of the wall clock, and viewers would sort it elsewhere.
    channel.log_with_meta_to_sink(data, PartialMetadata { log_time: Some(log_time) }, viewer);
}

/// Channels by their numbers, as a viewer names them.
type ByChannel<T> = BTreeMap<u64, T>;
