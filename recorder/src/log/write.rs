//! Writes a log so that it opens at any time, even if its writer dies within a write.
//!
//! Metadata, attachments and channels come first, so that they survive whatever happens later. Must never measure a
//! flight: frames, events and views come in as arguments.

use super::{LAYOUT, RESULT, RUN, SCENARIO, sink::Sink};
use crate::{
    RecorderError,
    clock::Clock,
    metrics::Frame,
    show::{layout, view::TickView},
    stream::{MessageSink, MessageStream, mode_name},
};
use foxglove::Schema;
use mcap::{
    Attachment, McapResult, WriteOptions, Writer,
    records::{MessageHeader, Metadata},
    write::NoSeek,
};
use ringwing_bus::write_whole;
use ringwing_flight::{Shape, TickTiming, TimedEvent};
use ringwing_scenario::Scenario;
use std::{
    borrow::Cow,
    collections::BTreeMap,
    fs::File,
    path::{Path, PathBuf},
    time::{Duration, Instant},
};

/// The copy of the layout beside the log, which Foxglove imports.
const LAYOUT_FILE: &str = "layout.json";
/// The program that wrote the log, in its header. mcap's own default would change with every version of that library.
const LIBRARY: &str = concat!("ringwing ", env!("CARGO_PKG_VERSION"));
/// Bytes of messages per chunk. Larger chunks compress better; a reader has to unpack a whole one for any message in it.
const CHUNK_BYTES: u64 = 1 << 20;
/// Flushes per simulated second. In real time a tick may wait 0.25 s for its commands, so with two a dead recorder loses
/// less than 1 s. More flushes make smaller chunks, which compress worse.
const FLUSHES_HZ: u32 = 2;

/// What a log begins with.
#[derive(Debug, Clone, Copy)]
pub struct Opening<'a> {
    /// The scenario.
    pub scenario: &'a Scenario,
    /// The text that the scenario was read from.
    pub text: &'a str,
    /// Whether the log gets wall-clock times.
    pub timing: bool,
    /// When the run was started, in UTC, if the log is to say that.
    pub started_at: Option<&'a str>,
}

/// A log under construction.
pub(crate) struct LogWriter {
    stream: MessageStream,
    file: LogFile,
}

/// The file of a log, and what it holds so far.
struct LogFile {
    path: PathBuf,
    writer: Writer<NoSeek<Sink>>,
    clock: Clock,
    messages: u64,
    /// Number of messages by channel.
    counts: Vec<u64>,
    /// The flush interval of the messages since the last flush.
    interval: i64,
    flushed: Instant,
}

impl LogWriter {
    /// Creates a log at `path`, in place of any file there.
    pub(crate) fn create(path: &Path, opening: &Opening) -> Result<Self, RecorderError> {
        let file = File::create(path).map_err(RecorderError::log(path, "created"))?;
        let layout = layout::render(opening.scenario, opening.timing);
        let writer = open(file, opening, &layout).map_err(RecorderError::log(path, "written"))?;
        let beside = path.with_file_name(LAYOUT_FILE);
        write_whole(&beside, layout).map_err(RecorderError::log(&beside, "written"))?;
        let mut file = LogFile {
            path: path.to_owned(),
            writer,
            clock: Clock::new(opening.scenario.time.rate_hz),
            messages: 0,
            counts: Vec::new(),
            interval: 0,
            flushed: Instant::now(),
        };
        let stream = MessageStream::open(&mut file, opening.scenario, opening.timing)?;
        Ok(Self { stream, file })
    }

    /// Number of messages so far.
    pub(crate) fn messages(&self) -> u64 {
        self.file.messages
    }

    /// Leaves the introduction out, because a copied `/log` has it already.
    pub(crate) fn skip_introduction(&mut self) {
        self.stream.skip_introduction();
    }

    /// Writes a tick with its events and its view, in the order of topics.
    pub(crate) fn write_frame(
        &mut self,
        frame: &Frame,
        timing: Option<&TickTiming>,
        events: &[TimedEvent],
        view: &TickView,
    ) -> Result<(), RecorderError> {
        // Flush between ticks only: a successor takes over whatever the file holds, and in half a tick some UAVs
        // would seem to be gone.
        self.file.flush_if_due(frame.tick)?;
        self.stream.write_frame(&mut self.file, frame, timing, events, view)
    }

    /// Writes events that came after the last frame, the frame of `tick`.
    pub(crate) fn write_last_events(
        &mut self,
        tick: i64,
        events: &[TimedEvent],
    ) -> Result<(), RecorderError> {
        self.stream.write_last_events(&mut self.file, tick, events)
    }

    /// Writes a message of another log of this flight, whose header already names a channel of this one.
    pub(crate) fn copy(&mut self, header: &MessageHeader, data: &[u8]) -> Result<(), RecorderError> {
        self.file.flush_if_due(i64::from(header.sequence))?;
        self.file.write(header, data)
    }

    /// Lets `write` add other records to the file.
    pub(crate) fn extend<T>(
        &mut self,
        write: impl FnOnce(&mut Writer<NoSeek<Sink>>) -> McapResult<T>,
    ) -> Result<T, RecorderError> {
        write(&mut self.file.writer).map_err(RecorderError::log(&self.file.path, "written"))
    }

    /// Writes all messages so far to the file.
    pub(crate) fn flush(&mut self) -> Result<(), RecorderError> {
        self.file.flush()
    }

    /// Moves the log to `path` in one step, in place of the file there.
    pub(crate) fn move_to(&mut self, path: &Path) -> Result<(), RecorderError> {
        // The open file stays the same file under its new name, so writing simply continues.
        std::fs::rename(&self.file.path, path).map_err(RecorderError::log(&self.file.path, "renamed"))?;
        path.clone_into(&mut self.file.path);
        Ok(())
    }

    /// Flushes if the last flush was more than `period` of wall-clock time ago.
    pub(crate) fn flush_if_older(&mut self, period: Duration) -> Result<(), RecorderError> {
        if self.file.flushed.elapsed() > period { self.file.flush() } else { Ok(()) }
    }

    /// Ends the log with its `result` and its index.
    pub(crate) fn finish(&mut self, mut result: BTreeMap<String, String>) -> Result<(), RecorderError> {
        result.extend(self.stream.judged_counts(&self.file.counts));
        let metadata = Metadata { name: RESULT.into(), metadata: result };
        self.extend(|writer| writer.write_metadata(&metadata))?;
        self.file.writer.finish().map(drop).map_err(RecorderError::log(&self.file.path, "finished"))
    }
}

impl LogFile {
    fn write(&mut self, header: &MessageHeader, data: &[u8]) -> Result<(), RecorderError> {
        self.count(header.channel_id);
        self.writer.write_to_known_channel(header, data).map_err(RecorderError::log(&self.path, "written"))
    }

    fn count(&mut self, channel: u16) {
        let channel = usize::from(channel);
        // A takeover can add channels that this writer has not registered.
        self.counts.resize(self.counts.len().max(channel + 1), 0);
        self.counts[channel] += 1;
        self.messages += 1;
    }

    fn flush_if_due(&mut self, tick: i64) -> Result<(), RecorderError> {
        let interval = self.clock.interval(tick, FLUSHES_HZ);
        if interval == self.interval {
            return Ok(());
        }
        self.interval = interval;
        self.flush()
    }

    /// Writes all messages so far to the file.
    fn flush(&mut self) -> Result<(), RecorderError> {
        self.flushed = Instant::now();
        // Before the first message only channels wait, and a chunk without messages makes Foxglove stop reading: see `open`.
        if self.messages == 0 {
            return Ok(());
        }
        self.writer.flush().map_err(RecorderError::log(&self.path, "written"))
    }
}

impl MessageSink for LogFile {
    type Error = RecorderError;

    fn add_channel(&mut self, topic: &str, schema: &Schema, encoding: &str) -> Result<u16, RecorderError> {
        // The writer returns the number of an equal schema that it has already, so topics of one type share a schema.
        let schema_id = self.writer.add_schema(&schema.name, &schema.encoding, &schema.data);
        schema_id
            .and_then(|schema_id| self.writer.add_channel(schema_id, topic, encoding, &BTreeMap::new()))
            .map_err(RecorderError::log(&self.path, "written"))
    }

    fn put(&mut self, channel_id: u16, tick: i64, data: &[u8]) -> Result<(), RecorderError> {
        // Both times are simulated: a wall-clock time would make the files of equal flights differ. The sequence is
        // the tick, because readers group messages into ticks by it.
        let log_time = self.clock.log_time_ns(tick);
        self.write(
            &MessageHeader { channel_id, sequence: tick as u32, log_time, publish_time: log_time },
            data,
        )
    }
}

fn open(file: File, opening: &Opening, layout: &str) -> McapResult<Writer<NoSeek<Sink>>> {
    let mut writer = WriteOptions::new()
        .library(LIBRARY)
        .profile("")
        .chunk_size(Some(CHUNK_BYTES))
        // The default depends on the number of cores, and the bytes of the file would, too.
        .compression_threads(0)
        // A quarter less work than the default level, for 2 % more bytes.
        .compression_level(1)
        // The sink only appends: complete each chunk in memory instead of going back to its header.
        .disable_seeking(true)
        .create(NoSeek::new(Sink::new(file)))?;
    writer.write_metadata(&Metadata { name: RUN.into(), metadata: describe(opening) })?;
    // Simulated time here, too: the moment of writing would make the files of equal flights differ.
    let start = Clock::new(opening.scenario.time.rate_hz).log_time_ns(0);
    let attachments = [(SCENARIO, "application/toml", opening.text), (LAYOUT, "application/json", layout)];
    for (name, media_type, text) in attachments {
        writer.attach(&Attachment {
            log_time: start,
            create_time: start,
            name: name.into(),
            media_type: media_type.into(),
            data: Cow::Borrowed(text.as_bytes()),
        })?;
    }
    // Flush before the channels: a chunk without messages has no index, and Foxglove stops reading there.
    writer.flush()?;
    Ok(writer)
}

/// The metadata about the run.
fn describe(opening: &Opening) -> BTreeMap<String, String> {
    let scenario = opening.scenario;
    let formation = scenario.formation();
    let mut run = BTreeMap::from([
        ("name", scenario.name.clone()),
        ("seed", scenario.seed.to_string()),
        ("version", env!("CARGO_PKG_VERSION").into()),
        ("uavs", formation.count().to_string()),
        ("spacing_m", formation.spacing_m().to_string()),
        ("rate_hz", scenario.time.rate_hz.to_string()),
        ("law", scenario.control.law.name().into()),
        ("mode", mode_name(scenario).into()),
        ("duration_s", scenario.time.duration_s.to_string()),
    ]);
    if *formation.shape() == Shape::Ring {
        run.insert("radius_m", formation.radius_m().to_string());
    } else {
        run.insert("shape", scenario.formation.shape.name().into());
    }
    // Log times are simulated, so this alone tells at what time of day a real-time run was flown.
    run.extend(opening.started_at.map(|time| ("started_at", time.into())));
    run.into_iter().map(|(key, value)| (key.into(), value)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        schema::topics,
        testing::{self, flight, messages, place, record, ring_of},
    };
    use foxglove::messages::Log;
    use mcap::Summary;
    use prost::Message;
    use std::fs;

    #[test]
    fn after_every_flush_the_file_opens_as_it_is() {
        let (_folder, path) = place();
        let scenario = ring_of(3, 40.0);
        let mut recording = testing::recording(&path, &scenario);
        let mut last_in_file = Vec::new();
        for frame in flight(&scenario, 0..260) {
            recording.observe(&frame, None).unwrap();
            let file = fs::read(&path).unwrap();
            last_in_file.push(messages(&file).last().map(|message| message.tick));
            assert_eq!(mcap::read::footer(&file).unwrap().summary_start, 0);
        }
        // Each half second is flushed as soon as the next one begins.
        assert_eq!([49, 50, 99, 259].map(|tick| last_in_file[tick]), [None, Some(49), Some(49), Some(249)]);
        recording.finish(None).unwrap();
        let file = fs::read(&path).unwrap();
        let summary = Summary::read(&file).unwrap().unwrap();
        assert_eq!(summary.stats.unwrap().message_count, messages(&file).len() as u64);
    }

    #[test]
    fn messages_come_in_order_of_time_and_topic() {
        let (_folder, path) = place();
        let scenario = ring_of(4, 40.0);
        record(&path, &scenario, &flight(&scenario, 0..120));
        let seen = messages(&fs::read(&path).unwrap());
        let of_tick =
            |tick: u32| seen.iter().filter(|m| m.tick == tick).map(|m| m.topic.clone()).collect::<Vec<_>>();
        assert!(seen.is_sorted_by_key(|message| (message.log_time, message.topic.clone())));
        assert_eq!(of_tick(0)[..5], ["/faults", "/geo/leader", "/geo/uavs", "/leader/pose", "/log"]);
        assert_eq!(of_tick(0)[11..15], ["/swarm/metrics", "/swarm/state", "/tf", "/uav/001/control"]);
        assert_eq!(of_tick(1).len(), 8);
        assert_eq!(seen.iter().filter(|message| message.topic == topics::LEADER_POSE).count(), 24);
        assert_eq!(seen[0].log_time, 1_767_225_600_000_000_000);
    }

    #[test]
    fn channels_have_the_order_of_their_topics_in_swarms_of_a_thousand_too() {
        let (_folder, path) = place();
        let scenario = ring_of(1001, 40.0);
        let opening = Opening { timing: true, ..testing::opening(&scenario) };
        let mut log = LogWriter::create(&path, &opening).unwrap();
        log.finish(BTreeMap::new()).unwrap();
        let summary = Summary::read(&fs::read(&path).unwrap()).unwrap().unwrap();
        let found: Vec<_> =
            (1..=summary.channels.len() as u16).map(|id| &summary.channels[&id].topic).collect();
        assert!(found.is_sorted() && found.len() == 2022);
        assert!(found.iter().zip(topics::ALL).all(|(found, named)| *found == named));
        assert_eq!(found[20], "/uav/0001/control");
    }

    #[test]
    fn a_log_has_the_run_its_scenario_and_its_result() {
        let (_folder, path) = place();
        let scenario = ring_of(6, 40.0);
        record(&path, &scenario, &flight(&scenario, 0..20));
        let file = fs::read(&path).unwrap();
        let line = messages(&file).into_iter().find(|message| message.topic == topics::LOG).unwrap();
        let line = Log::decode(&*line.data).unwrap();
        assert_eq!(
            (line.name, line.message),
            ("run".into(), "6 UAVs, paper law, 100 Hz, lockstep, seed 1".into())
        );
        let summary = Summary::read(&file).unwrap().unwrap();
        let metadata = |index: usize| mcap::read::metadata(&file, &summary.metadata_indexes[index]).unwrap();
        let (run, result) = (metadata(0), metadata(1));
        assert_eq!((run.name.as_str(), run.metadata["law"].as_str()), (RUN, "paper"));
        assert_eq!((run.metadata["uavs"].as_str(), run.metadata["rate_hz"].as_str()), ("6", "100"));
        assert_eq!((result.name.as_str(), result.metadata["last_tick"].as_str()), (RESULT, "19"));
        assert!(result.metadata.contains_key("closest_pair.distance_m"));
        let attachment = mcap::read::attachment(&file, &summary.attachment_indexes[0]).unwrap();
        assert_eq!((attachment.name.as_str(), &*attachment.data), (SCENARIO, testing::TEXT.as_bytes()));
    }

    #[test]
    fn equal_flights_make_equal_files() {
        let scenario = ring_of(5, 40.0);
        let files = [0, 1].map(|_| {
            let (_folder, path) = place();
            record(&path, &scenario, &flight(&scenario, 0..333));
            fs::read(&path).unwrap()
        });
        assert!(files[0] == files[1]);
    }

    #[test]
    fn an_error_names_the_log_that_cannot_be_created() {
        let scenario = ring_of(3, 40.0);
        let error =
            LogWriter::create(Path::new("/nowhere/run.mcap"), &testing::opening(&scenario)).err().unwrap();
        assert!(error.to_string().starts_with("log /nowhere/run.mcap: cannot be created: "), "{error}");
        let full = LogWriter::create(Path::new("/dev/full"), &testing::opening(&scenario)).err().unwrap();
        assert!(full.to_string().contains("No space left on device"), "{full}");
    }
}
