//! Logs that other programs rewrote: in every way that the MCAP format allows, they give the figures of the original.

use super::*;
use crate::{
    FlightSummary, Metrics,
    log::{Opening, recover::recover, salvage::LogDamages},
    process::recording::Recording,
    testing::{self, flight, place, ring_of},
};
use mcap::{
    Attachment, Compression, MAGIC, Message, MessageStream, Summary, WriteOptions, Writer,
    records::{Metadata, op},
};
use ringwing_flight::{Event, Tick, TimedEvent, WorldReport};
use std::{fs, io::Cursor, ops::Range};

/// The flight of all these tests: four UAVs for two seconds; the recorder lost a tenth of them.
fn scenario() -> Scenario {
    let mut scenario = ring_of(4, 40.0);
    scenario.time.duration_s = 2.0;
    scenario
}

/// A complete log of `scenario` whose UAVs swing through `ticks`.
fn log_of(scenario: &Scenario, ticks: Range<i64>) -> Vec<u8> {
    let (_folder, path) = place();
    let text = scenario.to_toml();
    let opening = Opening { text: &text, ..testing::opening(scenario) };
    let mut recording = Recording::begin(Some(&path), &opening, true).unwrap();
    for (tick, sentence) in [(30, "link 1->2 hold"), (90, "isolate 3")] {
        let event = Event::LinkFault { sentence: sentence.into() };
        recording.log_event(TimedEvent { tick: Tick(tick), event });
    }
    let last_tick = ticks.end - 1;
    let frames = flight(scenario, ticks);
    let recorded = frames.iter().filter(|frame| !(120..140).contains(&frame.tick));
    recorded.for_each(|frame| recording.observe(frame, None).unwrap());
    let world = WorldReport {
        last_tick,
        complete: true,
        payload_hash: "2e0766c04283bf8b".into(),
        collisions: Vec::new(),
        failsafes: 0,
        refused_commands: 0,
        reused_commands: 0,
        missed_deadlines: 0,
        unanswered_ticks: 0,
        late_max_us: 0.0,
        latency: None,
    };
    recording.finish(Some(&world)).unwrap();
    fs::read(path).unwrap()
}

fn original() -> Vec<u8> {
    log_of(&scenario(), 0..200)
}

/// Everything that a tool says about a log.
#[derive(Debug, PartialEq)]
struct Figures {
    flight: FlightSummary,
    payload_hash: Option<String>,
    doubled: u64,
    conflict: Option<String>,
    shortfalls: Shortfalls,
}

impl Figures {
    /// These figures without the remarks of a log whose messages are out of order or doubled.
    fn without_notes(self) -> Self {
        Self { doubled: 0, shortfalls: Shortfalls { notes: Vec::new(), ..self.shortfalls }, ..self }
    }
}

fn open(file: &[u8]) -> Reader<Cursor<&[u8]>> {
    Reader::of(Path::new("a.mcap"), Cursor::new(file)).unwrap()
}

fn figures(file: &[u8]) -> Figures {
    let mut reader = open(file);
    let scenario = reader.scenario().unwrap();
    let shortfalls = reader.shortfalls(&scenario);
    let payload_hash = reader.result().and_then(|result| result.get("world.payload_hash")).cloned();
    let (mut metrics, mut doubled, mut conflict) = (Metrics::new(&scenario), 0, None);
    for tick in reader.ticks(&scenario) {
        doubled += tick.doubled;
        conflict = conflict.or_else(|| tick.conflict.clone());
        tick.events.iter().for_each(|event| metrics.on_event(event));
        if tick.has_uavs() {
            metrics.observe(&tick.frame);
        }
    }
    Figures { flight: metrics.summary(), payload_hash, doubled, conflict, shortfalls }
}

/// The content of a log, as the `mcap` crate reads it.
struct Content<'a> {
    attachments: Vec<Attachment<'a>>,
    metadata: Vec<Metadata>,
    messages: Vec<Message<'a>>,
}

fn content(file: &[u8]) -> Content<'_> {
    let summary = Summary::read(file).unwrap().unwrap();
    let indexes = (&summary.attachment_indexes, &summary.metadata_indexes);
    Content {
        attachments: indexes.0.iter().map(|index| mcap::read::attachment(file, index).unwrap()).collect(),
        metadata: indexes.1.iter().map(|index| mcap::read::metadata(file, index).unwrap()).collect(),
        messages: MessageStream::new(file).unwrap().map(Result::unwrap).collect(),
    }
}

/// Where a rewriter puts attachments and metadata.
#[derive(Debug, Clone, Copy)]
enum Extras {
    First,
    Last,
}

fn rewritten(content: &Content, options: WriteOptions, extras: Extras) -> Vec<u8> {
    let mut file = Cursor::new(Vec::new());
    let mut writer = options.compression_threads(0).create(&mut file).unwrap();
    if matches!(extras, Extras::First) {
        write_extras(&mut writer, content);
    }
    for message in &content.messages {
        writer.write(message).unwrap();
    }
    if matches!(extras, Extras::Last) {
        write_extras(&mut writer, content);
    }
    writer.finish().unwrap();
    drop(writer);
    file.into_inner()
}

fn write_extras(writer: &mut Writer<&mut Cursor<Vec<u8>>>, content: &Content) {
    content.attachments.iter().for_each(|attachment| writer.attach(attachment).unwrap());
    content.metadata.iter().for_each(|metadata| writer.write_metadata(metadata).unwrap());
}

fn options() -> WriteOptions {
    WriteOptions::new().chunk_size(Some(20_000))
}

/// The ways to write a log that the format allows, apart from the order of its records.
fn ways_to_write() -> Vec<(&'static str, WriteOptions)> {
    vec![
        ("zstd", options()),
        ("lz4", options().compression(Some(Compression::Lz4))),
        ("not compressed", options().compression(None)),
        ("one chunk", options().chunk_size(None)),
        ("tiny chunks", options().chunk_size(Some(500))),
        ("no chunks", options().use_chunks(false)),
        ("no summary", options().emit_summary_records(false).emit_summary_offsets(false)),
        ("no statistics", options().emit_statistics(false)),
        ("no message index", options().emit_message_indexes(false)),
        (
            "no index",
            options()
                .emit_chunk_indexes(false)
                .emit_attachment_indexes(false)
                .emit_metadata_indexes(false)
                .emit_message_indexes(false),
        ),
        ("nothing repeated", options().repeat_channels(false).repeat_schemas(false)),
        (
            "no checksums",
            options()
                .calculate_chunk_crcs(false)
                .calculate_data_section_crc(false)
                .calculate_summary_section_crc(false)
                .calculate_attachment_crcs(false),
        ),
        ("no seeking", options().disable_seeking(true)),
    ]
}

#[test]
fn every_way_to_write_a_log_gives_its_figures_and_can_be_recovered() {
    let file = original();
    let (expected, content) = (figures(&file), content(&file));
    assert_eq!((&expected.conflict, &expected.shortfalls), (&None, &Shortfalls::default()));
    assert_eq!((expected.flight.ticks, expected.flight.faults), (180, 2));
    let (folder, path) = place();
    for extras in [Extras::First, Extras::Last] {
        for (number, (name, options)) in ways_to_write().into_iter().enumerate() {
            let rewritten = rewritten(&content, options, extras);
            assert_eq!(figures(&rewritten), expected, "{name}, {extras:?}");
            fs::write(&path, &rewritten).unwrap();
            let out = folder.path().join(format!("{number}-{extras:?}.mcap"));
            let recovered = recover(&path, &out).unwrap();
            assert!(recovered.is_whole() && recovered.has_ended, "{name}, {extras:?}: {recovered:?}");
            assert_eq!(figures(&fs::read(out).unwrap()), expected, "recovered: {name}, {extras:?}");
        }
    }
}

#[test]
fn messages_in_any_order_give_the_same_figures() {
    let file = original();
    let expected = figures(&file);
    let mut content = content(&file);
    content.messages.sort_by(|one, other| one.channel.topic.cmp(&other.channel.topic));
    let by_topic = rewritten(&content, options(), Extras::Last);
    content.messages.reverse();
    let reversed = rewritten(&content, options(), Extras::First);
    for (name, rewritten) in [("by topic", by_topic), ("reversed", reversed)] {
        let found = figures(&rewritten);
        assert!(
            found.shortfalls.notes[0].contains("messages are out of order, the first is of /"),
            "{found:?}"
        );
        assert_eq!(found.without_notes(), expected, "{name}");
        let times: Vec<u64> = open(&rewritten).map(|message| message.log_time).collect();
        assert!(times.is_sorted() && times.len() == content.messages.len(), "{name}");
    }
}

#[test]
fn a_log_that_is_read_again_from_its_beginning_is_the_same() {
    let file = original();
    let mut content = content(&file);
    content.messages.reverse();
    let reversed = rewritten(&content, options(), Extras::First);
    for file in [file.as_slice(), &reversed] {
        let mut reader = open(file);
        let first: Vec<_> = reader.by_ref().collect();
        assert_eq!(first, reader.rewind().collect::<Vec<_>>());
    }
}

#[test]
fn sequence_numbers_are_not_needed() {
    let file = original();
    let mut content = content(&file);
    content.messages.iter_mut().for_each(|message| message.sequence = 0);
    assert_eq!(figures(&rewritten(&content, options(), Extras::Last)), figures(&file));
}

#[test]
fn a_log_without_the_topics_of_viewers_gives_the_same_figures() {
    let file = original();
    let mut content = content(&file);
    let is_kept = |topic: &str| topic.starts_with("/uav/") || topic == "/events";
    content.messages.retain(|message| is_kept(&message.channel.topic));
    assert_eq!(figures(&rewritten(&content, options(), Extras::Last)), figures(&file));
}

/// Which messages a program keeps.
type Kept = fn(&Message) -> bool;

#[test]
fn a_log_that_lacks_a_part_of_the_flight_says_which() {
    let file = original();
    let cases: [(Kept, &str); 4] = [
        (
            |message| {
                !message.channel.topic.starts_with("/uav/003") && message.channel.topic != "/uav/004/state"
            },
            "the log lacks 2 of 4 UAVs: it has no topic /uav/003/state, /uav/004/state",
        ),
        (|message| !message.channel.topic.ends_with("/control"), "720 of 720 messages of /uav/*/control are"),
        (|message| message.channel.topic != "/events", "3 of 3 messages of /events are missing"),
        (|message| message.sequence >= 100, "400 of 720 messages of /uav/*/state are missing"),
    ];
    for (is_kept, expected) in cases {
        let mut content = content(&file);
        content.messages.retain(is_kept);
        let Shortfalls { problems, .. } = figures(&rewritten(&content, options(), Extras::Last)).shortfalls;
        assert!(problems.iter().any(|problem| problem.starts_with(expected)), "{expected}: {problems:?}");
    }
}

/// The file that holds the records of all `files`, one log after the other.
fn merged(files: &[&[u8]]) -> Vec<u8> {
    let mut all = Content { attachments: Vec::new(), metadata: Vec::new(), messages: Vec::new() };
    for file in files {
        let Content { attachments, metadata, messages } = content(file);
        all.attachments.extend(attachments);
        all.metadata.extend(metadata);
        all.messages.extend(messages);
    }
    all.messages.sort_by_key(|message| message.log_time);
    rewritten(&all, options(), Extras::Last)
}

#[test]
fn parts_of_a_flight_that_were_joined_again_give_its_figures() {
    let file = original();
    let part = |ticks: Range<u32>| {
        let mut content = content(&file);
        content.messages.retain(|message| ticks.contains(&message.sequence));
        rewritten(&content, options(), Extras::First)
    };
    let joined = merged(&[&part(0..80), &part(80..200)]);
    assert_eq!(figures(&joined), figures(&file));
    let overlapping = figures(&merged(&[&part(0..100), &part(80..200)]));
    // States and controls of 20 ticks, and one event.
    assert_eq!(overlapping.doubled, 20 * 8 + 1);
    assert_eq!(overlapping.without_notes(), figures(&file));
}

#[test]
fn two_flights_in_one_file_are_told_apart() {
    let file = original();
    let mut other = scenario();
    other.seed = 2;
    let both = merged(&[&file, &log_of(&other, 0..200)]);
    let error = open(&both).scenario().unwrap_err().to_string();
    assert!(error.contains("two flights: synthetic, seed 1 and synthetic, seed 2"), "{error}");
    // The same scenario, but the messages of UAV 2 are those of a second earlier.
    let mut shifted = content(&file);
    shifted.messages.retain(|message| message.channel.topic == "/uav/002/state");
    for message in &mut shifted.messages {
        (message.log_time, message.sequence) = (message.log_time + 1_000_000_000, message.sequence + 100);
    }
    let shifted = rewritten(&shifted, options(), Extras::First);
    assert_eq!(figures(&merged(&[&file, &shifted])).conflict, Some("/uav/002/state".into()));
    let appended = [file.as_slice(), &file].concat();
    let problems = figures(&appended).shortfalls.problems;
    assert!(problems[0].contains("more bytes after the end of the log"), "{problems:?}");
}

/// The records of a file without chunks or of its top level: opcode and place.
fn records(file: &[u8]) -> Vec<(u8, Range<usize>)> {
    let (mut records, mut at) = (Vec::new(), MAGIC.len());
    while at + MAGIC.len() < file.len() {
        let length = u64::from_le_bytes(file[at + 1..at + 9].try_into().unwrap()) as usize;
        records.push((file[at], at..at + 9 + length));
        at += 9 + length;
    }
    records
}

/// A file of these records, with an end that states no checksum.
fn assembled(records: &[&[u8]]) -> Vec<u8> {
    let end = [&[op::DATA_END, 4][..], &[0; 11], &[op::FOOTER, 20], &[0; 27]].concat();
    [MAGIC, &records.concat(), &end, MAGIC].concat()
}

#[test]
fn channels_may_be_repeated_and_messages_may_lie_between_chunks() {
    let file = original();
    let whole = content(&file);
    let unchunked = rewritten(&whole, options().use_chunks(false), Extras::First);
    let chunked = rewritten(&whole, options(), Extras::First);
    let is_content = |opcode: u8| {
        [op::HEADER, op::SCHEMA, op::CHANNEL, op::MESSAGE, op::ATTACHMENT, op::METADATA, op::CHUNK]
            .contains(&opcode)
    };
    let of = |file: &'_ [u8]| {
        let records = records(file).into_iter().take_while(|(opcode, _)| *opcode != op::DATA_END);
        let records = records.filter(|(opcode, _)| is_content(*opcode));
        records.map(|(opcode, place)| (opcode, file[place].to_vec())).collect::<Vec<_>>()
    };
    let (plain, chunks) = (of(&unchunked), of(&chunked));
    let names = |(opcode, _): &&(u8, Vec<u8>)| [op::SCHEMA, op::CHANNEL].contains(opcode);
    let names: Vec<_> = plain.iter().filter(names).map(|(_, record)| record.clone()).collect();
    let repeated: Vec<_> = plain
        .iter()
        .enumerate()
        .flat_map(|(number, (_, record))| {
            let again = if number % 200 == 199 { names.clone() } else { Vec::new() };
            again.into_iter().chain([record.clone()])
        })
        .collect();
    // A log in chunks, followed by the same messages without chunks.
    let mixed: Vec<_> = chunks
        .iter()
        .map(|(_, record)| record.clone())
        .chain(plain.iter().filter(|(opcode, _)| *opcode == op::MESSAGE).map(|(_, record)| record.clone()))
        .collect();
    let slices = |records: &[Vec<u8>]| assembled(&records.iter().map(Vec::as_slice).collect::<Vec<_>>());
    assert_eq!(figures(&slices(&repeated)), figures(&file));
    let mixed = figures(&slices(&mixed));
    assert_eq!((mixed.doubled, mixed.shortfalls.problems.len()), (720 * 2 + 3, 0));
    assert_eq!(mixed.without_notes(), figures(&file));
}

#[test]
fn channels_may_have_any_numbers() {
    let file = original();
    let content = content(&file);
    let mut renumbered = Cursor::new(Vec::new());
    let mut writer = options().create(&mut renumbered).unwrap();
    for message in &content.messages {
        let channel = &message.channel;
        let schema = channel.schema.as_ref().unwrap();
        let (id, number) = (60_000 - schema.id, 65_000 - channel.id);
        writer.add_schema_with_id(id, &schema.name, &schema.encoding, &schema.data).unwrap();
        writer
            .add_channel_with_id(number, id, &channel.topic, &channel.message_encoding, &channel.metadata)
            .unwrap();
        let (sequence, log_time, publish_time) = (message.sequence, message.log_time, message.publish_time);
        let header = MessageHeader { channel_id: number, sequence, log_time, publish_time };
        writer.write_to_known_channel(&header, &message.data).unwrap();
    }
    write_extras(&mut writer, &content);
    writer.finish().unwrap();
    drop(writer);
    assert_eq!(figures(renumbered.get_ref()), figures(&file));
}

#[test]
fn a_log_whose_first_bytes_are_damaged_keeps_the_rest() {
    let file = original();
    for (name, options) in ways_to_write() {
        let mut broken = rewritten(&content(&file), options, Extras::Last);
        broken[..20].fill(0);
        let found = figures(&broken);
        let problems = found.shortfalls.problems.clone();
        assert!(
            problems[0].contains("the first bytes are not those of an MCAP file"),
            "{name}: {problems:?}"
        );
        assert_eq!(found.payload_hash, figures(&file).payload_hash, "{name}");
        assert_eq!(found.flight, figures(&file).flight, "{name}");
    }
}

#[test]
fn damage_in_a_log_without_chunks_costs_the_messages_that_it_hits() {
    let file = original();
    let content = content(&file);
    let mut broken = rewritten(&content, options().use_chunks(false), Extras::Last);
    let middle = broken.len() / 2;
    broken[middle..middle + 300].fill(0xff);
    let left = open(&broken).count();
    assert!((content.messages.len() - 10..content.messages.len()).contains(&left), "{left}");
    assert!(figures(&broken).payload_hash.is_some());
    assert_ne!(open(&broken).damages(), &LogDamages::default());
}
