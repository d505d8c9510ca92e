//! Serves a log to Foxglove as if the flight went on now: at any speed, with pauses and seeks from the viewer.
//!
//! Must never change the log, and never keep more of it in memory than what late viewers have to know.

mod clock;

use crate::{
    LiveAddress, LiveUrl, ViewerError,
    server::{LiveServer, Offer, memory::Memory},
};
use clock::PlayClock;
use foxglove::{
    Schema,
    websocket::{ChannelView, Client, PlaybackControlRequest, PlaybackState, PlaybackStatus, ServerListener},
};
use ringwing_bus::StopFlag;
use ringwing_recorder::{
    log::reader::{LogMessage, Reader},
    stream::MessageSink,
};
use std::{
    collections::BTreeMap,
    iter::Peekable,
    path::{Path, PathBuf},
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    thread,
    time::{Duration, Instant},
};

/// How often the player looks for wishes and for messages that are due. Less often makes the picture jerk; more often burns CPU.
const POLL: Duration = Duration::from_millis(10);
/// The only encoding of messages that ringwing writes. Messages of other programs in other encodings are left out.
const PROTOBUF: &str = "protobuf";

/// How to serve a log.
#[derive(Debug, Clone, Copy)]
pub struct PlaybackOptions {
    /// Where to listen.
    pub address: LiveAddress,
    /// How many times as fast as it was flown.
    pub speed: f64,
}

/// Serves the log that `path` names until this process is asked to stop; tells `announce` where.
pub fn serve_log(
    path: &Path,
    options: &PlaybackOptions,
    announce: impl FnOnce(&LiveUrl),
) -> Result<(), ViewerError> {
    let stop = StopFlag::on_signals()?;
    let reader = Reader::open(path)?;
    let (path, scenario) = (reader.path().to_owned(), reader.scenario()?);
    // The server has to know the range of times when it starts, so read the whole log once before.
    let outline = Outline::of(reader).ok_or_else(|| ViewerError::Empty(path.display().to_string()))?;
    let controls = Controls::new(outline.first, options.speed);
    let offer = Offer {
        scenario: &scenario,
        ask: None,
        times: Some((outline.first, outline.last)),
        listener: Arc::new(controls.clone()),
    };
    let mut server = LiveServer::start(&options.address, &offer, controls.memory.clone())?;
    let channels = outline.add_to(&mut server)?;
    announce(server.url());
    Player { path, server, channels, controls, stop }.play()
}

/// What a log holds.
struct Outline {
    topics: BTreeMap<String, Schema>,
    first: u64,
    last: u64,
}

impl Outline {
    /// Reads the whole log; `None` if it has no message that can be shown.
    fn of(reader: Reader) -> Option<Self> {
        let (mut topics, mut times) = (BTreeMap::new(), None);
        for message in reader {
            let Some(schema) = message.topic.schema.as_ref().filter(|schema| schema.encoding == PROTOBUF)
            else {
                continue;
            };
            let time = message.log_time;
            let (first, last) = times.unwrap_or((time, time));
            times = Some((first.min(time), last.max(time)));
            // `entry` would copy the name of the topic for every message of the log.
            if !topics.contains_key(&message.topic.name) {
                let schema = Schema::new(&schema.name, &schema.encoding, schema.data.clone());
                topics.insert(message.topic.name.clone(), schema);
            }
        }
        let (first, last) = times?;
        Some(Self { topics, first, last })
    }

    /// Adds a channel for each topic; returns their numbers.
    fn add_to(&self, server: &mut LiveServer) -> Result<BTreeMap<String, u16>, ViewerError> {
        let add = |(topic, schema): (&String, &Schema)| {
            Ok((topic.clone(), server.add_channel(topic, schema, PROTOBUF)?))
        };
        self.topics.iter().map(add).collect()
    }
}

/// What viewers wish. Clones share it.
#[derive(Clone)]
struct Controls {
    clock: Arc<Mutex<PlayClock>>,
    memory: Memory,
}

impl Controls {
    fn new(first: u64, speed: f64) -> Self {
        let clock = Arc::new(Mutex::new(PlayClock::at(first, speed)));
        Self { clock, memory: Memory::default() }
    }

    fn clock(&self) -> MutexGuard<'_, PlayClock> {
        // The clock is whole between any two statements, so a panic elsewhere does no harm.
        self.clock.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl ServerListener for Controls {
    fn on_subscribe(&self, client: Client, channel: ChannelView) {
        self.memory.on_subscribe(client, channel);
    }

    fn on_playback_control_request(&self, request: PlaybackControlRequest) -> Option<PlaybackState> {
        let mut clock = self.clock();
        let now = Instant::now();
        clock.heed(&request, now);
        Some(PlaybackState {
            did_seek: request.seek_time.is_some(),
            request_id: Some(request.request_id),
            ..state(&clock, now)
        })
    }
}

fn state(clock: &PlayClock, now: Instant) -> PlaybackState {
    PlaybackState {
        status: if clock.is_playing() { PlaybackStatus::Playing } else { PlaybackStatus::Paused },
        current_time: clock.time(now),
        playback_speed: clock.speed() as f32,
        did_seek: false,
        request_id: None,
    }
}

/// Plays one log.
struct Player {
    path: PathBuf,
    server: LiveServer,
    channels: BTreeMap<String, u16>,
    controls: Controls,
    stop: StopFlag,
}

/// What ends a pass through the log.
enum PassEnd {
    /// A viewer wants to see this time.
    Seek(u64),
    /// There is nothing more to play.
    Ended,
    /// The process is asked to stop.
    Stopped,
}

impl Player {
    fn play(&self) -> Result<(), ViewerError> {
        // A flight that nobody sees need not begin.
        while self.server.clients() == 0 {
            if self.stop.is_set() {
                return Ok(());
            }
            thread::sleep(POLL);
        }
        self.controls.clock().start(Instant::now());
        let mut seek = None;
        loop {
            // What late viewers have to know depends on all messages before, so each seek, also one forward, begins
            // with the first message.
            let mut messages = Reader::open(&self.path)?.peekable();
            if let Some(time) = seek.take() {
                self.catch_up(&mut messages, time);
            }
            let mut end = self.pass(messages);
            if let PassEnd::Ended = end {
                self.server.tell_playback(PlaybackState {
                    status: PlaybackStatus::Ended,
                    ..state(&self.controls.clock(), Instant::now())
                });
                // The server goes on: a viewer may still seek back into the flight.
                end = self.wait_for_seek();
            }
            match end {
                PassEnd::Seek(time) => seek = Some(time),
                PassEnd::Ended | PassEnd::Stopped => return Ok(()),
            }
        }
    }

    /// Shows the state of the flight at `time`, without what led to it.
    fn catch_up(&self, messages: &mut Peekable<Reader>, time: u64) {
        self.controls.memory.clear();
        while let Some(message) = messages.next_if(|message| message.log_time <= time) {
            if let Some(channel) = self.channels.get(&message.topic.name) {
                self.server.note(*channel, message.log_time, &message.data);
            }
        }
        self.controls.memory.send_all();
        self.server.tell_time(time);
    }

    /// Sends `messages` when their times come.
    fn pass(&self, messages: Peekable<Reader>) -> PassEnd {
        let mut shown = 0;
        for message in messages {
            if let Some(end) = self.wait_for(message.log_time) {
                return end;
            }
            // All messages of a tick have the same time, so announce it once.
            if message.log_time != shown {
                shown = message.log_time;
                self.server.tell_time(shown);
            }
            self.send(&message);
        }
        PassEnd::Ended
    }

    fn send(&self, message: &LogMessage) {
        if let Some(channel) = self.channels.get(&message.topic.name) {
            self.server.send(*channel, message.log_time, &message.data);
        }
    }

    /// Waits until the flight has come to `time`; returns what ends the pass before.
    fn wait_for(&self, time: u64) -> Option<PassEnd> {
        loop {
            let mut clock = self.controls.clock();
            // Look for a seek first: a viewer may jump while the flight is paused.
            if let Some(time) = clock.take_seek() {
                return Some(PassEnd::Seek(time));
            }
            // After a pause, several messages may be due already. They wait, too: the picture must stand.
            if clock.time(Instant::now()) >= time && clock.is_playing() {
                return None;
            }
            // The server's thread needs the clock to take a wish, so never sleep while holding it.
            drop(clock);
            if self.stop.is_set() {
                return Some(PassEnd::Stopped);
            }
            thread::sleep(POLL);
        }
    }

    fn wait_for_seek(&self) -> PassEnd {
        // No flight gets as far as this time, so only a seek or the stop ends the wait.
        self.wait_for(u64::MAX).unwrap_or(PassEnd::Stopped)
    }
}
